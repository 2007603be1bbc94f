use autonomy::authority::ActAuthority;
use autonomy::state::PrepareToAct;

fn kept(held: PrepareToAct) -> ActAuthority {
    held.authority
}

fn main() {}
