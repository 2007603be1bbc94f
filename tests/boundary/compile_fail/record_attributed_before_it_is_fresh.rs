use wire::trust::Framed;

fn hasty(framed: Framed<'_>) {
    let _ = framed.decode_hop().unwrap().by_session();
}

fn main() {}
