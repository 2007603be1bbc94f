use wire::time::{Age, Span};

fn young() -> Age {
    Age(Span::ZERO)
}

fn main() {}
