use wire::id::{NodeId, PeerId};

fn says(peer: PeerId) -> NodeId {
    peer.into()
}

fn same(peer: PeerId, node: NodeId) -> bool {
    peer == node
}

fn main() {}
