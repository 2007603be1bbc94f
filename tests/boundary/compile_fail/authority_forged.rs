use autonomy::authority::ActAuthority;
use wire::id::{CommandId, TrackId, WorldId};
use wire::policy::Waived;
use wire::time::Instant;

fn forged(command: CommandId) -> ActAuthority {
    ActAuthority {
        serial: 1,
        track: TrackId(1),
        command,
        world: WorldId(0),
        until: Instant(u64::MAX),
        waived: Waived::default(),
    }
}

fn main() {}
