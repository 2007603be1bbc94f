//! A shape for each class, so that no class is known by its colour alone.

use evidence::trial::Outcome;
use maud::{Markup, PreEscaped, html};

use crate::figure::class_of_outcome;

/// The shape of a class, 14 pixels, in its colour; within a filled cell the sheet gives it the colour of the letters.
pub(super) fn shape(class: Outcome) -> Markup {
    html! {
        svg class="sh" width="14" height="14" viewBox="0 0 14 14" aria-hidden="true" {
            g class=(class_of_outcome(class.name())) { (PreEscaped(path(class))) }
        }
    }
}

fn path(class: Outcome) -> &'static str {
    match class {
        Outcome::HoldSafe => "<rect x=\"2\" y=\"2\" width=\"10\" height=\"10\"/>",
        Outcome::Rejected => "<circle cx=\"7\" cy=\"7\" r=\"5.4\"/>",
        Outcome::Undetected => "<path d=\"M7 .6 13.4 7 7 13.4.6 7Z\"/>",
        Outcome::Unsafe => {
            "<path d=\"M2.6.8 7 5.2 11.4.8 13.2 2.6 8.8 7l4.4 4.4-1.8 1.8L7 8.8l-4.4 4.4L.8 11.4 5.2 7 .8 2.6Z\"/>"
        }
        Outcome::Late => "<path d=\"M7 1.4 13.2 12.6H.8Z\"/>",
        Outcome::Degraded => {
            "<path d=\"M7 1.6a5.4 5.4 0 0 1 0 10.8Z\"/><circle class=\"ring\" cx=\"7\" cy=\"7\" r=\"5.4\"/>"
        }
        Outcome::FalseTrip => "<rect x=\"1\" y=\"5\" width=\"12\" height=\"4\"/>",
        Outcome::Stuck => "<path d=\"M3 2h3v10H3ZM8 2h3v10H8Z\"/>",
        Outcome::GuestFailed => "<path d=\"M1 4.6h12v4.8H1ZM4.6 1h4.8v12H4.6Z\"/>",
        Outcome::Invalid => "<path d=\"M1 1h12v2.4H1ZM1 5.8h12v2.4H1ZM1 10.6h12V13H1Z\"/>",
        Outcome::Nominal => "<circle class=\"ring\" cx=\"7\" cy=\"7\" r=\"5.4\"/>",
    }
}
