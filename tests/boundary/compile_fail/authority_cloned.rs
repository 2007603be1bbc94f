use autonomy::authority::ActAuthority;

fn twice(authority: ActAuthority) -> (ActAuthority, ActAuthority) {
    (authority.clone(), authority)
}

fn main() {}
