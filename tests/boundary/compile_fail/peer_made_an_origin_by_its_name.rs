use wire::id::{NodeId, PeerId};

fn named(peer: PeerId) -> Option<NodeId> {
    NodeId::from_name(peer.name())
}

fn numbered(peer: PeerId, origin: NodeId) -> bool {
    peer.index() == origin.index()
}

fn main() {}
