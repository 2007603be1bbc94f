use wire::trust::Framed;

fn hasty(framed: Framed<'_>) {
    let _ = framed.decode_session_message().unwrap().by_session();
}

fn main() {}
