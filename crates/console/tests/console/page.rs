//! The page in a real browser: the four answers at every size, a server that dies, hostile text, taps.
//!
//! The pictures are a console's own, of the yard that the window's tests have too.

use std::sync::atomic::{AtomicUsize, Ordering};

use console::page::FILES;
use link::web::{Content, Page, Served};
use serde_json::{Value, json};

use crate::browser::{Browser, Tab};
use crate::yard::Yard;
use crate::{scenes, yard};

/// Widths of a phone, a small and a large screen.
const WIDTHS: [u32; 3] = [390, 1280, 1920];

/// Serves the page with these pictures, one after the other and then the last one again, each 20 ms old.
fn served(pictures: Vec<Value>) -> Served {
    let asked = AtomicUsize::new(0);
    let picture = move || {
        let nth = asked.fetch_add(1, Ordering::Relaxed).min(pictures.len() - 1);
        json!({ "held_ms": 20, "picture": pictures[nth] }).to_string()
    };
    let site = || serde_json::to_string(&yard::site()).unwrap();
    let made = |path, content| Page { path, media: "application/json", content: Content::Made(content) };
    let mut pages: Vec<Page> =
        FILES.map(|(path, media, text)| Page { path, media, content: Content::Fixed(text) }).into();
    pages.push(made("picture", Box::new(picture)));
    pages.push(made("site", Box::new(site)));
    Served::open(0, pages).unwrap()
}

/// The last second of a yard, so that there is something to plot.
fn last_second(yard: &Yard) -> Vec<Value> {
    yard.bench.pictures[yard.bench.pictures.len().saturating_sub(12)..].to_vec()
}

/// Runs `look` on a browser, if there is one.
fn in_a_browser(name: &str, look: impl FnOnce(&mut Browser)) {
    match Browser::start(name) {
        Some(mut browser) => look(&mut browser),
        None => eprintln!("skipped: chromium is not installed"),
    }
}

/// The page's text for the mode, why, since when, the next step and whether it is true.
fn answers(tab: &mut Tab<'_>) -> [String; 5] {
    [".mode", ".why", ".since", ".next", ".truth"].map(|part| {
        tab.value(&format!("document.querySelector('#banner {part}').innerText")).as_str().unwrap().to_owned()
    })
}

/// Text below 13 px, and whether the page can be scrolled sideways.
const UNREADABLE: &str = "[...document.querySelectorAll('body *')].filter((one) => [...one.childNodes].some((node) => \
     node.nodeType === 3 && node.data.trim()) && parseFloat(getComputedStyle(one).fontSize) < 13).map((one) => one.outerHTML)";
const SIDEWAYS: &str = "document.documentElement.scrollWidth > document.documentElement.clientWidth";

#[test]
#[ignore = "long: a browser"]
fn every_answer_is_on_the_page_at_every_size() {
    in_a_browser("answers", |browser| {
        for (name, scene) in scenes::SCENES {
            let pictures = last_second(&scene());
            let last = pictures.last().unwrap().clone();
            let worst = &last["worst_first"][0]["unit"];
            let units = last["units"].as_array().unwrap().iter().chain(last["unheard"].as_array().unwrap());
            let banner = units.clone().find(|unit| unit["unit"] == *worst).unwrap()["banner"].clone();
            let served = served(vec![last]);
            for (width, scheme) in WIDTHS.iter().flat_map(|width| [(*width, "dark"), (*width, "light")]) {
                let mut tab = browser.open(&served.address(), width, scheme);
                tab.until("document.querySelector('#banner .truth') && document.getElementById('current').hidden");
                // On a busy host a picture may come late, and the page then says so.
                for part in ["mode", "why", "since", "next", "truth"] {
                    let headline = &banner[part]["headline"];
                    tab.until(&format!("document.querySelector('#banner .{part}').innerText.includes({headline})"));
                }
                assert_eq!(tab.value(SIDEWAYS), false, "{name}: sideways at {width}");
                assert_eq!(tab.value(UNREADABLE), json!([]), "{name}: small text at {width}");
            }
        }
    });
}

#[test]
#[ignore = "long: a browser"]
fn page_of_a_dead_server_is_not_current() {
    in_a_browser("dead", |browser| {
        let served = served(last_second(&scenes::nominal()));
        let mut tab = browser.open(&served.address(), 390, "dark");
        tab.until("/Fresh and verified/.test(document.querySelector('#banner .truth').innerText)");
        assert_eq!(tab.value("document.getElementById('current').hidden"), true);
        drop(served);
        tab.until("!document.getElementById('current').hidden");
        let top = tab.value("document.getElementById('current').innerText");
        assert!(top.as_str().unwrap().starts_with("NOT CURRENT"), "{top}");
        let [mode, _, since, _, truth] = answers(&mut tab);
        assert!(mode.contains("was READY") && since.contains("not known") && truth.contains("No: it is old"));
        let fresh = "/fresh|● ≤|● picture/i.test([...document.querySelectorAll('main, footer')].map((one) => one.innerText).join())";
        assert_eq!(tab.value(fresh), false, "{}", tab.value("document.body.innerText"));
        assert!(tab.value("document.getElementById('said').textContent").as_str().unwrap().starts_with("not current"));
    });
}

/// Names come from elsewhere: they are text, wherever they stand.
#[test]
#[ignore = "long: a browser"]
fn hostile_text_stays_text() {
    in_a_browser("hostile", |browser| {
        const EVIL: &str = "<img id=evil src=x onerror=alert(1)>";
        let mut picture = last_second(&scenes::lost()).pop().unwrap();
        spoil(&mut picture, EVIL);
        let served = served(vec![picture]);
        let mut tab = browser.open(&served.address(), 390, "dark");
        tab.until("document.getElementById('said').textContent.includes('<img')");
        assert_eq!(tab.value("document.querySelectorAll('#evil, img').length"), 0);
        assert_eq!(tab.value(SIDEWAYS), false);
    });
}

/// Puts `evil` in place of every sentence and name that a picture has from elsewhere.
fn spoil(value: &mut Value, evil: &str) {
    match value {
        Value::Object(fields) => fields.iter_mut().for_each(|(name, value)| match name.as_str() {
            "freshness" | "sign" => {}
            _ => spoil(value, evil),
        }),
        Value::Array(all) if all.first().is_some_and(Value::is_string) && all.len() == 2 => all[1] = json!(evil),
        Value::Array(all) => all.iter_mut().for_each(|value| spoil(value, evil)),
        Value::String(text) => evil.clone_into(text),
        Value::Null | Value::Bool(_) | Value::Number(_) => {}
    }
}

#[test]
#[ignore = "long: a browser"]
fn tapped_unit_is_chosen_and_stays_so() {
    in_a_browser("taps", |browser| {
        let served = served(last_second(&scenes::degraded()));
        let mut tab = browser.open(&served.address(), 390, "dark");
        tab.until("document.querySelector('#banner .mode').innerText.includes('DEGRADED')");
        tab.value("(row = document.querySelector('#units [data-unit=unit-b]'), row.focus(), row.click())");
        tab.until("document.querySelector('#banner .mode').innerText.includes('unit-b')");
        tab.until("document.querySelector('#banner .worse').innerText.includes('unit-a is worse: DEGRADED')");
        // Several pictures later the row is the same node, is still pressed, and has the focus.
        tab.value("asked = performance.getEntriesByType('resource').length");
        tab.until("performance.getEntriesByType('resource').length > asked + 5");
        let kept = "row.isConnected && row.getAttribute('aria-pressed') === 'true' && document.activeElement === row";
        assert_eq!(tab.value(kept), true);
        tab.until("(document.querySelector('#banner .worse').click(), true)");
        tab.until("document.querySelector('#banner .mode').innerText.includes('DEGRADED')");
    });
}

/// For `tools/release/pictures`: the page of a unit that holds, into the file that the environment names.
#[test]
#[ignore = "long: draws a picture"]
fn page_is_photographed() {
    let Some(into) = std::env::var_os("HOLDSAFE_PICTURE") else { return };
    let last = last_second(&scenes::hold_safe()).pop().unwrap();
    let served = served(vec![last]);
    let screenshot = format!("--screenshot={}", into.to_string_lossy());
    let options = ["--headless=new", "--no-sandbox", "--hide-scrollbars", "--window-size=1280,900", "--timeout=4000"];
    let status = std::process::Command::new("chromium").args(options).args([&screenshot, &served.address()]).status();
    assert!(status.unwrap().success());
}
