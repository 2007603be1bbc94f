//! `holdsafe guest check GUEST.TOML`: the program exercised without a run.

use std::path::Path;

use guest::Conduct;
use guest::check::Checked;
use results::report::GuestChecked;
use runner::failure::{Exit, Failure};
use runner::{Context, guest_options, out};
use wire::codec::Text;
use wire::guest::MAX_WHY;

pub(super) fn run(context: &Context, file: &Path) -> Result<Exit, Failure> {
    let guest = guest_options::guest(file, Conduct::Bare)?;
    let checked = guest::check::check(&guest);
    let (_, level) = confine::best(&std::env::current_exe()?, &confine::as_service()).map_err(Failure::internal)?;
    let fine = checked.fine();
    if context.json {
        out::print_json("guest-check", &GuestChecked::new(checked, level.to_string()))?;
    } else {
        print_result(&checked);
        out::say(format_args!("confinement: {level}"));
    }
    Ok(if fine { Exit::Fine } else { Exit::Unexpected })
}

fn print_result(checked: &Checked) {
    let Checked { guest, steps, asked, driven_m, .. } = checked;
    out::say(format_args!("{guest}: {steps} of {asked} steps answered, {driven_m:.1} m driven of 20 m"));
    if let Some(found) = &checked.failure {
        let place = if found.step == 0 { "at the start".to_owned() } else { format!("in step {}", found.step) };
        out::say(format_args!("failed {place}: {}: {}", found.fault, Text::<MAX_WHY>::new(&found.why).as_str()));
    }
    for remark in &checked.remarks {
        out::say(format_args!("remark: {remark}"));
    }
    if checked.fine() && checked.remarks.is_empty() {
        out::say(format_args!("nothing to remark; a second process answered the same"));
    }
}
