//! `lab results`: docs/results.md from the records in docs/results/.

use runner::failure::{Exit, Failure};
use runner::{Context, out};

use crate::results::{FOLDER, PAGE, page};

pub(super) fn run(context: &Context) -> Result<Exit, Failure> {
    let root = context.root()?;
    let text = page(&root.join(FOLDER)).map_err(|reason| Failure::new(Exit::Usage, reason))?;
    out::write_text(&root, PAGE, &text)?;
    out::say(format_args!("{PAGE}"));
    Ok(Exit::Fine)
}
