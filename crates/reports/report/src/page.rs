//! The reviewer's page: one self-contained HTML file, no script, dark and light, printable.
//!
//! Verdict first. Every drawing has its table. A section stands here for each kind of result; results are not judged again.

mod ablation;
mod cells;
mod claims;
mod cost;
mod curves;
mod latency;
mod matrix;
mod missions;
mod provenance;
mod summary;
mod verdict;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::Dossier;
use crate::figure::{Figure, Table, palette_sheet};

/// Background of the page, light.
pub(crate) const PAPER_LIGHT: &str = "#ffffff";
/// Background of the page, dark.
pub(crate) const PAPER_DARK: &str = "#161412";

/// The whole page.
pub fn page(dossier: &Dossier) -> String {
    let (rules, light, dark) = palette_sheet();
    let style = format!(
        ":root{{--paper:{PAPER_LIGHT};{light}}}\
         @media (prefers-color-scheme:dark){{:root{{--paper:{PAPER_DARK};{dark}}}}}\
         @media print{{:root{{--paper:{PAPER_LIGHT};{light}}}}}{rules}{}",
        include_str!("page/style.css")
    );
    let sections: Vec<Section> = sections(dossier).into_iter().filter(|s| !s.body.is_empty()).collect();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                @if let Some(seconds) = dossier.renew_s { meta http-equiv="refresh" content=(seconds); }
                title { (dossier.title) }
                style { (PreEscaped(style)) }
            }
            body {
                header {
                    h1 { (dossier.title) }
                    p class="quiet" {
                        "A simulation on one machine's loopback; the adversary attacks the twin and nothing else. Each figure and table names its n; "
                        "n of the twin, of the real stacks and of live runs are never added."
                    }
                    (verdict::verdict(dossier))
                }
                nav aria-label="Sections" { ul { @for s in &sections { li { a href={ "#" (s.id) } { (s.title) } } } } }
                main {
                    @for s in &sections { section id=(s.id) aria-labelledby={ (s.id) "-title" } {
                        h2 id={ (s.id) "-title" } { (s.title) }
                        (PreEscaped(&s.body))
                    } }
                }
                footer { p { "Made by holdsafe " (dossier.version) " from the files listed under “Where it comes from”." } }
            }
        }
    };
    page.into_string()
}

struct Section {
    id: &'static str,
    title: &'static str,
    body: String,
}

fn sections(dossier: &Dossier) -> Vec<Section> {
    let section = |id, title, body: Markup| Section { id, title, body: body.into_string() };
    vec![
        section("matrix", "The threat matrix", matrix::section(dossier)),
        section("cells", "Cell by cell", cells::section(dossier)),
        section("runs", "Runs over time", html! { @for story in &dossier.stories { (summary::section(story)) } }),
        section("missions", "How far missions came", missions::section(dossier)),
        section("latency", "How soon", latency::section(dossier)),
        section("curves", "How strong an attack may be", curves::section(dossier)),
        section("ablation", "What each check is worth", ablation::section(dossier)),
        section("cost", "What it costs", cost::section(dossier)),
        section("claims", "What is claimed, and on what", claims::section(dossier)),
        section("provenance", "Where it comes from", provenance::section(dossier)),
    ]
}

/// Every figure of the page, in its order.
pub fn figures(dossier: &Dossier) -> Vec<Figure> {
    let mut all = matrix::figures(dossier);
    all.extend(dossier.stories.iter().map(summary::drawn));
    all.extend(latency::figures(dossier));
    all.extend(curves::figures(dossier));
    all.extend(cost::figures(dossier));
    all
}

/// A figure: the drawing, its caption, and the numbers.
fn figure(figure: &Figure) -> Markup {
    html! {
        figure id=(figure.name) {
            div class="scroll" tabindex="0" role="region" aria-label={ (figure.title) ", drawing" } {
                (PreEscaped(figure.drawing.inline(&figure.title)))
            }
            figcaption { strong { (figure.title) "." } " " (figure.caption) }
            details { summary { "The same in numbers" } (table(&figure.table, &figure.title)) }
        }
    }
}

/// A table that scrolls by itself where the page is narrow.
fn table(table: &Table, label: &str) -> Markup {
    html! {
        div class="scroll" tabindex="0" role="region" aria-label={ (label) ", table" } {
            table {
                thead { tr { @for cell in &table.head { th scope="col" { (cell) } } } }
                tbody { @for row in &table.rows { tr { @for cell in row { td { (cell) } } } } }
            }
        }
    }
}

/// Colours and their words.
fn key(classes: &[(&str, &str)]) -> Markup {
    html! {
        ul class="key" { @for (class, word) in classes { li {
            svg width="12" height="12" aria-hidden="true" { rect class=(class) width="12" height="12" {} }
            (word)
        } } }
    }
}

/// Lower case, digits and hyphens: for anchors and names of files.
fn slug(name: &str) -> String {
    let mut slug = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            slug.push(c.to_ascii_lowercase());
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
    }
    slug.trim_end_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use results::summary::{Lasted, Refusals, RunSummary};

    use crate::Recording;
    use crate::reader::{Results, golden};

    fn dossier() -> Dossier {
        let mut results = Results::default();
        let mut search = golden("search");
        search["watermark"] = serde_json::Value::Null;
        search["findings"][0]["word"] = "<img src=//a.b/c onerror=alert(1)>".into();
        results.read("search.json", search.to_string().as_bytes()).expect("a search");
        let lasted = |label: &str| Lasted { what: label.to_owned(), from: 1.0, to: 2.0 };
        let refused =
            Refusals { by: "gateway".to_owned(), reason: "stale".to_owned(), n: 3, at: vec![lasted("stale")] };
        let story = RunSummary {
            name: "</style><script>alert(1)</script>".to_owned(),
            seconds: 9.0,
            flaw: Some("cut".to_owned()),
            modes: vec![lasted("READY")],
            authority: Vec::new(),
            done: vec![lasted("<script>")],
            refused: vec![refused],
            why: Vec::new(),
        };
        let (title, version) = ("a & b".to_owned(), "0".to_owned());
        let recording = Recording {
            name: story.name.clone(),
            sha256: "ab".repeat(32),
            holds: false,
            outcome: Some("NOMINAL".to_owned()),
            invalid: story.flaw.clone(),
        };
        let (stories, recordings) = (vec![story], vec![recording]);
        Dossier { title, version, results, stories, recordings, ..Dossier::default() }
    }

    #[test]
    fn page_loads_no_resource_and_runs_no_script() {
        let page = page(&dossier());
        assert!(!page.contains("<script") && !page.contains("<img") && !page.contains("<link"), "{page}");
        assert!(!page.contains("url(") && !page.contains("@import"), "{page}");
        let addresses = page.matches("http").count();
        assert_eq!(addresses, page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count());
    }

    #[test]
    fn finding_and_broken_log_lead_the_verdict() {
        let page = page(&dossier());
        let (head, rest) = page.split_once("<main>").expect("a body");
        assert!(
            head.contains("verdict bad")
                && head.contains("1 minimal attack sequence")
                && head.contains("1 of 1 recordings is INVALID"),
            "{head}"
        );
        assert!(head.find("INVALID") < head.find("No trials"), "before what results say: {head}");
        assert!(rest.contains("&lt;img src=//a.b/c"), "{rest}");
        assert!(rest.contains("does not hold") && rest.contains(&"ab".repeat(32)), "with digest and custody: {rest}");
        assert!(rest.matches("INVALID").count() >= 3, "at its figure and its table, too: {rest}");
    }

    #[test]
    fn drawings_have_numbers_and_anchors_sections() {
        let page = page(&dossier());
        assert_eq!(page.matches("<figure").count(), page.matches("The same in numbers").count());
        for anchor in page.split("href=\"#").skip(1).filter_map(|rest| rest.split('"').next()) {
            let leads = ["section", "figure"].iter().any(|to| page.contains(&format!("<{to} id=\"{anchor}\"")));
            assert!(leads, "{anchor}");
        }
    }

    #[test]
    fn rows_are_as_long_as_their_headers() {
        let mut dossier = dossier();
        for kind in ["matrix", "run", "reference", "campaign", "curve", "ablation"] {
            let mut golden = golden(kind);
            // A claim rests on rows under a full policy alone.
            for row in golden["rows"].as_array_mut().into_iter().flatten() {
                row["watermark"] = serde_json::Value::Null;
                for kind in row["kinds"].as_array_mut().into_iter().flatten() {
                    (kind["ablation"], kind["counts"]) = (false.into(), true.into());
                }
            }
            dossier.results.read(kind, golden.to_string().as_bytes()).expect("a golden result");
        }
        let page = page(&dossier);
        assert!(page.contains("Claims, table") && page.contains("cell by cell, table"), "{page}");
        let (mut tables, cells) = (0, |row: &str| row.matches("<th").count() + row.matches("<td").count());
        for table in page.split("<table>").skip(1).filter_map(|rest| rest.split("</table>").next()) {
            let rows: Vec<&str> = table.split("<tr>").skip(1).collect();
            assert!(rows.iter().all(|row| cells(row) == cells(rows[0])), "{table}");
            tables += 1;
        }
        assert!(tables > 5, "{tables}");
    }

    #[test]
    fn the_same_results_give_the_same_page() {
        assert_eq!(page(&dossier()), page(&dossier()));
    }

    #[test]
    fn a_slug_is_an_anchor() {
        assert_eq!(slug("a/b C--d."), "a-b-c-d");
    }
}
