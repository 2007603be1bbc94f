use wire::refusal::Refusal;

fn invented() -> Refusal {
    Refusal::Session { expected: Default::default(), got: Default::default() }
}

fn main() {}
