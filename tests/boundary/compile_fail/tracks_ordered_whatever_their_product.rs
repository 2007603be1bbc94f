use wire::policy::Policy;
use wire::track::Tracks;
use wire::trust::{Accepted, Attributed, BusMessage, Window};

fn hasty(tracks: Attributed<BusMessage<'_, Tracks>>, policy: &Policy, window: &mut Window) -> Accepted<Tracks> {
    tracks.on_channel(policy, window).unwrap().accept_body()
}

fn main() {}
