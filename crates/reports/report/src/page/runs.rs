//! The kept runs that the finding names, over time: attack, guards, mode, display and truth on one axis; and the chain of why.
//!
//! A named run has a second one beside it, the nearest to it that ended otherwise. The others are folded.

use maud::{Markup, PreEscaped, html};
use results::summary::{ChainLink, Lasted, RunSummary, Why};

use super::finding::Finding;
use super::{slug, table, words};
use crate::Dossier;
use crate::figure::{Figure, Lane, Span, Table, Timeline, class_of_mode};

/// Rows of injections that are drawn.
const INJECTIONS: usize = 3;

/// The runs that a page tells at length, the named first, and all others.
pub(super) fn chosen<'a>(dossier: &'a Dossier, findings: &[Finding]) -> (Vec<&'a RunSummary>, Vec<&'a RunSummary>) {
    let all: Vec<&RunSummary> = dossier.stories.iter().collect();
    let about = findings.first().map(|finding| finding.about.as_slice()).unwrap_or_default();
    let is_named = |story: &&&RunSummary| about.iter().any(|name| story.name.starts_with(&format!("{name}, seed ")));
    let broken = all.iter().find(|story| story.flaw.is_some());
    let restricted = || all.iter().find(|story| !story.why.is_empty());
    let Some(first) = broken.or_else(|| all.iter().find(is_named)).or_else(restricted).or(all.first()) else {
        return (Vec::new(), Vec::new());
    };
    // Of a run that nothing answered, the reader wants to see what an answer looks like.
    let other = all
        .iter()
        .enumerate()
        .filter(|(_, story)| ending(story) != ending(first) && story.why.is_empty() != first.why.is_empty())
        .max_by_key(|(i, story)| (in_common(&story.name, &first.name), std::cmp::Reverse(*i)))
        .map(|(_, story)| story);
    let told: Vec<&RunSummary> = std::iter::once(*first).chain(other.copied()).collect();
    let rest = all.iter().filter(|story| !told.iter().any(|of| std::ptr::eq(*of, **story))).copied().collect();
    (told, rest)
}

/// The class after the name of a kept trial.
fn ending(story: &RunSummary) -> &str {
    story.name.rsplit_once(": ").map_or("", |(_, class)| class)
}

/// The name of a kept trial as people read it; another is a folder.
pub(super) fn named(story: &RunSummary) -> String {
    match story.name.split_once(", seed ") {
        Some((variation, rest)) => {
            format!("{}, seed {rest}", words::capital(&variation.replace('/', ", ").replace(", model", ", twin")))
        }
        None => story.name.clone(),
    }
}

/// Parts of two names that are the same.
fn in_common(a: &str, b: &str) -> usize {
    let parts = |name: &str| name.split(['/', ' ', ',']).map(str::to_owned).collect::<Vec<_>>();
    parts(a).iter().zip(parts(b)).filter(|(a, b)| *a == b).count()
}

/// Timelines and chains.
pub(super) fn section(told: &[&RunSummary], rest: &[&RunSummary]) -> Markup {
    html! { @if !told.is_empty() {
        h2 { "What happened, on one axis" }
        p class="say" {
            (words::number(told.len() as u64, "kept run")) ". Between the mode and what was shown lies the display’s delay. Attack and truth are the simulator’s and the attackers’ own word, which no operator had."
        }
        @for story in told { (drawing(story)) }
        @if !rest.is_empty() { details {
            summary { (words::number(rest.len() as u64, "more kept run")) }
            @for story in rest { (drawing(story)) }
        } }
        (chains(told))
        @if rest.iter().any(|story| !story.why.is_empty()) { details {
            summary { "Why the mode changed in the other runs" }
            @for story in rest { @for why in &story.why { h3 { (named(story)) } (chain(why)) } }
        } }
    } }
}

fn drawing(story: &RunSummary) -> Markup {
    let (figure, timeline) = (drawn(story), timeline(story));
    html! {
        figure class="run" id=(figure.name) {
            strong { (figure.title) }
            div class="wid" { (PreEscaped(timeline.wide().inline(&figure.title))) }
            div class="nar" { (PreEscaped(timeline.narrow().inline(&figure.title))) }
            @if story.flaw.is_some() { figcaption { (figure.caption) } }
            details { summary { "The same in numbers" } (table(&figure.table, &figure.title)) }
        }
    }
}

fn chains(told: &[&RunSummary]) -> Markup {
    let Some(story) = told.iter().find(|story| !story.why.is_empty()) else {
        return html! { h2 { "Why" } p { "In none of these runs was the unit restricted: no guard failed for as long as it takes, and so there is no chain of causes." } };
    };
    let [first, more @ ..] = story.why.as_slice() else { return html! {} };
    html! {
        h2 { (heading(first)) }
        p class="say" { (named(story)) ". From the services’ signed logs alone: no word of an attacker and no truth of the simulator." }
        (chain(first))
        @if !more.is_empty() { details {
            summary { (words::number(more.len() as u64, "more change")) " of mode in this run" }
            @for why in more { h3 { (why.change) " at " (format!("{:.3}", why.at)) " s: " (why.cause) } (chain(why)) }
        } }
    }
}

fn heading(why: &Why) -> String {
    match why.change.rsplit_once(' ').map(|(_, mode)| mode) {
        Some("HOLD_SAFE") => "Why the unit stopped".to_owned(),
        Some("DEGRADED") => "Why the unit slowed down".to_owned(),
        _ => "Why the mode changed".to_owned(),
    }
}

fn chain(why: &Why) -> Markup {
    // The chain comes by stage; a reader follows the time.
    let mut links: Vec<&ChainLink> = why.chain.iter().collect();
    links.sort_by(|a, b| a.at.total_cmp(&b.at));
    html! { ol class="why" { @for link in links { (link_markup(link, why)) } } }
}

fn link_markup(link: &ChainLink, why: &Why) -> Markup {
    let key = matches!(link.stage.as_str(), "guard" | "transition");
    let what = if link.stage == "transition" {
        format!("{}: {}", why.change.replace(" to ", " → "), why.cause)
    } else {
        link.what.clone()
    };
    html! { li class=[key.then_some("k")] {
        time { (format!("{:.4} s", link.at)) }
        span { (link.by) }
        p { (what) }
    } }
}

/// The figure of one run, for files.
pub(super) fn drawn(story: &RunSummary) -> Figure {
    let (mark, reason) = story.flaw.as_ref().map_or_else(Default::default, |flaw| {
        (if ending(story) == "INVALID" { "" } else { " (INVALID)" }, format!("INVALID, evidence of nothing: {flaw}. "))
    });
    Figure {
        name: format!("run-{}", slug(&story.name)),
        title: format!("{}{mark}", named(story)),
        caption: format!("{reason}One run of {:.1} s.", story.seconds),
        drawing: timeline(story).wide(),
        table: rows(story),
    }
}

fn timeline(story: &RunSummary) -> Timeline {
    let mut lanes = injections(story);
    let spans = |all: &[Lasted], class: &'static str| all.iter().map(|l| span(l, class)).collect::<Vec<_>>();
    let lane = |name: &str, spans: Vec<Span>, empty: &str| Lane {
        name: name.to_owned(),
        spans,
        curve: Vec::new(),
        empty: empty.to_owned(),
    };
    // A single refusal while sessions open is no news; what an attack meets is refused again and again.
    if let Some(most) = story.refused.iter().find(|refused| refused.n > 5) {
        let name = format!("{} of {}: {}", most.n, most.by, words::refusal(&most.reason));
        let mut refusals = spans(&most.at, "refusal");
        if let [only] = refusals.as_mut_slice() {
            only.name = name;
        } else {
            refusals.iter_mut().skip(1).for_each(|span| span.name.clear());
            refusals.iter_mut().take(1).for_each(|span| span.name.clone_from(&name));
        }
        lanes.push(lane("Refused", refusals, ""));
    }
    lanes.push(lane("Guards that fail", spans(&story.guards, "guard"), "all hold"));
    let modes = story.modes.iter().map(|l| span(l, class_of_mode(&l.what))).collect();
    lanes.push(lane("Mode of unit-a", modes, ""));
    lanes.push(lane("What was shown", displayed(story), "nothing"));
    if !story.truth.is_empty() {
        let curve = story.truth.iter().map(|point| (point.at, point.speed)).collect();
        lanes.push(Lane { curve, ..lane("Truth: speed, m/s", Vec::new(), "") });
    }
    let first = story.done.iter().map(|l| l.from).reduce(f64::min);
    Timeline { lanes, seconds: story.seconds, mark: first.map(|at| (at, format!("{at:.2} s: it begins"))) }
}

fn span(of: &Lasted, class: &'static str) -> Span {
    Span { name: of.what.clone(), class, from: of.from, to: of.to }
}

/// A lane a kind of injection, in the page's one colour where it had no answer.
fn injections(story: &RunSummary) -> Vec<Lane> {
    let class = if ending(story) == "UNDETECTED" { "attack-unnoticed" } else { "attack" };
    let lane =
        |spans, empty: &str| Lane { name: "Attack".to_owned(), spans, curve: Vec::new(), empty: empty.to_owned() };
    let mut kinds: Vec<&str> = Vec::new();
    // Reports of an insider are told with their number; what it did to send them is the same again.
    for of in story.done.iter().filter(|of| story.claims.is_none() || !of.what.ends_with(": Forward")) {
        if !kinds.contains(&of.what.as_str()) {
            kinds.push(&of.what);
        }
    }
    let of_kind = |kind: &&str| {
        story
            .done
            .iter()
            .filter(|of| of.what == *kind)
            .map(|of| Span { name: told_claims(story, &of.what), ..span(of, class) })
            .collect()
    };
    let lanes: Vec<Lane> = kinds.iter().take(INJECTIONS).map(|kind| lane(of_kind(kind), "")).collect();
    if lanes.is_empty() { vec![lane(Vec::new(), "none")] } else { lanes }
}

/// Reports of an insider with their number and their distance from the truth; anything else as it is.
fn told_claims(story: &RunSummary, what: &str) -> String {
    match (story.claims, what.split_once(" sends a report of ")) {
        (Some(claims), Some((who, rest))) => {
            let of = rest.split(' ').next().unwrap_or_default();
            format!(
                "{} reports of {of}, by {}; {} m off at most",
                claims.n,
                who.trim_end_matches(':'),
                words::three_digits(claims.off_m)
            )
        }
        _ => what.to_owned(),
    }
}

/// The display, a restriction with its delay behind the mode.
fn displayed(story: &RunSummary) -> Vec<Span> {
    let late = |shown: &Lasted| {
        let restricts = matches!(shown.what.as_str(), "HOLD_SAFE" | "DEGRADED");
        let mode = story
            .modes
            .iter()
            .rfind(|mode| mode.what == shown.what && mode.from <= shown.from)
            .filter(|_| restricts)?;
        Some(format!("{}, {:.0} ms later", shown.what, (shown.from - mode.from) * 1e3))
    };
    story
        .shown
        .iter()
        .map(|of| Span { name: late(of).unwrap_or_else(|| of.what.clone()), ..span(of, "shown") })
        .collect()
}

fn rows(story: &RunSummary) -> Table {
    let mut table = Table::new(&["kind", "what", "from (s)", "to (s)"]);
    let mut put = |kind: &str, name: &str, l: &Lasted| {
        table.rows.push(vec![kind.to_owned(), name.to_owned(), format!("{:.3}", l.from), format!("{:.3}", l.to)]);
    };
    let kinds = [
        ("done to it", &story.done),
        ("guards that fail", &story.guards),
        ("mode", &story.modes),
        ("authority", &story.authority),
        ("shown", &story.shown),
    ];
    for (kind, all) in kinds {
        all.iter().for_each(|l| put(kind, &l.what, l));
    }
    for refused in &story.refused {
        let name = format!("{} (n {})", refused.reason, refused.n);
        refused.at.iter().for_each(|l| put(&refused.by, &name, l));
    }
    table
}
