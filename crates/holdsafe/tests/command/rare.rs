//! `holdsafe estimate`: the same estimate by any number of threads, bounds where there are any, and refusals with their
//! reasons.

use super::holdsafe;

#[test]
fn rare_event_estimate_is_independent_of_threads() {
    let rare = |jobs: &str| {
        let texts =
            ["estimate", "nominal", "--set", "conditions.loss=0.3", "--event", "hold-safe", "--levels", "250,450"];
        let output =
            holdsafe(&[&texts[..], &["--trials", "12", "--repetitions", "3", "--jobs", jobs, "--json"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let mut object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        // Its duration is no part of the result.
        object["cpu_seconds"].take();
        object["plain"]["cpu_seconds"].take();
        object
    };
    let object = rare("1");
    assert_eq!(object, rare("2"), "other threads, another estimate");
    assert_eq!(object["stages"].as_array().unwrap().len(), 3, "two levels and the event: {object}");
    assert!(object["estimate"].as_f64().unwrap() > 0.0 && object["set"]["conditions.loss"] == 0.3, "{object}");
}

/// Plain trials give a bound.
#[test]
fn event_never_seen_has_no_estimate() {
    let rare = |more: &[&str]| {
        let texts = ["estimate", "nominal", "--event", "lease", "--trials", "5", "--repetitions", "2", "--json"];
        let output = holdsafe(&[&texts[..], more].concat());
        assert_eq!(output.status.code(), Some(4), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    assert!(rare(&["--levels", "100,5000"])["interval_95"].is_null(), "splitting that ends on the way bounds nothing");
    let upper = rare(&["--levels", "5000"])["interval_95"][1].as_f64().unwrap();
    assert!((upper - 0.3085).abs() < 1e-4, "none of 10, as the tables have it: {upper}");
}

#[test]
fn an_estimate_that_cannot_begin_says_why() {
    for (arguments, message) in [
        (&["estimate", "nominal"][..], "--event <EVENT>"),
        (&["estimate", "nominal", "--event", "lease"], "the last of --levels says what the event is"),
        (&["estimate", "nominal", "--event", "fence", "--levels", "900,2000"], "numbers that fall towards the event"),
        (&["estimate", "nominal", "--event", "hold-safe", "--levels", "nan"], "numbers that rise towards the event"),
        (&["estimate", "nominal", "--event", "hold-safe", "--set", "conditions.loss=2"], "conditions.loss"),
        (&["estimate", "nominal", "--event", "hold-safe", "--set", "conditions"], "PATH=VALUE"),
        (&["estimate", "teammate", "--event", "hold-safe"], "`teammate` has several cells; choose one with --cell"),
        (&["estimate", "certificates", "--event", "hold-safe"], "runs on the real stacks in memory"),
    ] {
        let output = holdsafe(arguments);
        let screen = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {screen}");
        assert!(screen.contains(message), "{arguments:?}: {screen}");
    }
}
