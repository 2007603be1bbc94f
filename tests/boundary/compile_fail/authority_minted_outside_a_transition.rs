use autonomy::authority::ActAuthority;

fn main() {
    let _ = ActAuthority::mint;
}
