use autonomy::command::Ordered;
use wire::command::CommandKind;
use wire::id::CommandId;
use wire::policy::Waived;

fn forged(id: CommandId, kind: CommandKind) -> Ordered {
    Ordered { id, kind, intent: [0; 32], moved: None, window: None, waived: Waived::default() }
}

fn main() {}
