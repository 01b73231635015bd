//! Pages and figures: what they hold, that nothing in them is markup that people wrote, and that hashes tell a change.

use crate::support::{
    answer, assert_prints, assert_refused, json, palpate, short_run, stderr, stdout, succeeded,
};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Everything that could break a page: markup, quotes, entities, control letters, letters that turn the writing.
const HOSTILE: &str = "</td><script>alert('x')</script> \"q\" & &lt; \u{202e}txt";

/// Elements that a page may have, and those of them that have no end.
const KNOWN: &str = "html head meta title style body main section h1 h2 h3 p strong ul li pre table caption thead tbody tr th \
                     td figure figcaption svg rect polyline polygon circle text";
const EMPTY: [&str; 1] = ["meta"];

/// Reads a page strictly: every element is known, closed in its place and has quoted attributes; every text is escaped.
/// Returns the texts.
fn strict(page: &str) -> Vec<String> {
    let known: BTreeSet<&str> = KNOWN.split_whitespace().collect();
    let body = page.strip_prefix("<!DOCTYPE html>\n").expect("a doctype");
    let (body, seal) = body.rsplit_once("<!-- ").expect("a seal");
    assert!(seal.ends_with(" -->\n"), "{seal}");
    let (mut open, mut texts, mut heading): (Vec<String>, Vec<String>, u32) = Default::default();
    let mut rest = body;
    while let Some((text, more)) = rest.split_once('<') {
        check_text(text, open.last().map_or("", String::as_str));
        texts.push(text.to_owned());
        let (tag, more) = more.split_once('>').expect("a tag that ends");
        rest = more;
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "</{name}> closes something else");
            continue;
        }
        let (tag, is_closed) = match tag.strip_suffix('/') {
            Some(tag) => (tag, true),
            None => (tag, false),
        };
        let (name, attributes) = tag.split_once(' ').unwrap_or((tag, ""));
        assert!(known.contains(name), "<{tag}> is no element of a page");
        check_attributes(attributes);
        if let Some(level) = name.strip_prefix('h').and_then(|level| level.parse().ok()) {
            assert!(level <= heading + 1, "h{level} after h{heading}");
            heading = level;
        }
        if name == "th" {
            assert!(attributes.contains("scope=\"row\"") || attributes.contains("scope=\"col\""));
        }
        if name == "svg" {
            assert!(rest.trim_start().starts_with("<title>"), "a figure without a title");
        }
        if !is_closed && !EMPTY.contains(&name) {
            open.push(name.to_owned());
        }
    }
    assert!(open.is_empty(), "{open:?} stay open");
    assert!(page.contains("<html lang=\"en\">"));
    assert_eq!(page.matches("<figure>").count(), page.matches("<figcaption>").count());
    texts
}

fn check_attributes(mut attributes: &str) {
    while !attributes.trim().is_empty() {
        let (name, value) = attributes.trim_start().split_once("=\"").expect("a quoted value");
        let is_name = name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '-');
        assert!(is_name && !name.starts_with("on"), "{name}");
        assert!(!["href", "src", "style"].contains(&name), "{name}");
        let (value, more) = value.split_once('"').expect("a value that ends");
        check_text(value, "attribute");
        attributes = more;
    }
}

fn check_text(text: &str, place: &str) {
    if place == "style" {
        assert!(!text.contains("url(") && !text.contains("@import"));
        return;
    }
    assert!(!text.contains('>'), "{text}");
    for part in text.split('&').skip(1) {
        let (name, _) = part.split_once(';').expect("an entity that ends");
        assert!(["amp", "lt", "gt", "quot", "apos"].contains(&name), "&{name};");
    }
    let is_bad = |letter: char| letter.is_control() && letter != '\n' || letter == '\u{202e}';
    assert!(!text.contains(is_bad), "{text:?}");
}

/// A session with every kind of edit, all with hostile text; returns the name of its folder.
fn talked_of(at: &Path) -> &'static str {
    let more = ["--specimen", HOSTILE, "--operator", HOSTILE, "--indenter", HOSTILE, "--seed", "3"];
    succeeded(&short_run(at, "press", &more));
    let reason = ["--reason", HOSTILE, "--by", HOSTILE];
    for words in [
        &["verdict", "press", "suspect"][..],
        &["mask", "press", "--name", "knock <b>", "--leave-out", "70..71"],
        &["mask", "press", "--name", "other", "--leave-out", "60..61"],
        &["withdraw", "press", "other"],
        &["recalibrate", "press", "--calibration", "thesis", "--name", "recalibrated"],
        &["fit", "press", "--save", "all & \"more\"", "--include-rejected"],
        &["review", "press", "--accept"],
    ] {
        succeeded(&palpate(at, &[words, &reason].concat()));
    }
    "press"
}

#[test]
fn a_page_holds_everything_and_nothing_in_it_is_markup() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let session = talked_of(at);
    let made = palpate(at, &["report", session, "--html", "page.html", "--json"]);
    succeeded(&made);
    let object = json(&made);
    assert_eq!(object["command"], "report");
    let page = fs::read_to_string(at.join("page.html")).unwrap();
    let texts = strict(&page);
    let all = texts.join("\n");
    for words in [
        "Measurement",
        "suspect, says",
        "accepted by",
        "nothing has changed since",
        "tau_eps",
        "95 % interval",
        "systematic",
        "Force over time",
        "Targets and achieved values",
        "contact at",
        "knock &lt;b&gt;",
        "withdrawn by",
        "Fit 'all &amp; &quot;more&quot;' found:".replace('\'', "&apos;").as_str(),
        "interlocks",
        "SHA-256",
        "edits.jsonl",
        "analyses.jsonl",
    ] {
        assert!(all.contains(words), "no '{words}'");
    }
    // Every file with the hash that any other program finds.
    let files = object["files"].as_array().unwrap();
    assert!(files.len() >= 3, "{files:?}");
    for file in files {
        let name = file["file"].as_str().unwrap();
        let bytes = fs::read(at.join(session).join(name)).unwrap();
        let hash = palpate_sessions::text::sha256(&bytes);
        assert_eq!(file["sha256"], hash.as_str());
        assert!(all.contains(&hash), "{name}");
    }
    // Five figures at most a few thousand points each: a page that can be mailed.
    assert!(page.len() < 1_000_000, "{}", page.len());
    let again = palpate(at, &["report", session, "--html", "page.html"]);
    assert_refused(&again, 2, "exists already");
}

#[test]
fn total_intervals_and_budget_of_a_recorded_session_and_of_its_stored_fit_are_on_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let log = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/sessions/ramp-hold-lab/000.mcap");
    fs::create_dir(at.join("press")).unwrap();
    fs::copy(log, at.join("press/000.mcap")).unwrap();
    let kept = ["fit", "press", "--save", "kept", "--reason", "first", "--by", "Ada"];
    succeeded(&palpate(at, &kept));
    succeeded(&palpate(at, &["report", "press", "--html", "page.html"]));
    let page = fs::read_to_string(at.join("page.html")).unwrap();
    strict(&page);
    let fit = answer(&palpate(at, &["fit", "press", "--json"]));
    let tau = &fit["parameters"][0];
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let (low, high) = (number(&tau["total95"][0]), number(&tau["total95"][1]));
    let entries = tau["budget"].as_array().unwrap().iter();
    let errors: Vec<f64> = entries.map(|entry| number(&entry["error"])).collect();
    let largest = errors.iter().copied().fold(0.0, f64::max);
    let variance: f64 = errors.iter().map(|error| error.powi(2)).sum();
    let share = 100.0 * largest.powi(2) / variance;
    for words in [
        format!("<td>[{low:.4}, {high:.4}]</td>"),
        format!(" ({share:.0} %)</strong></td>"),
        "<th scope=\"col\">total 95 % interval</th>".to_owned(),
        "Uncertainty budget: ".to_owned(),
        "to reduce the contribution of".to_owned(),
    ] {
        assert!(page.matches(&words).count() >= 2, "{words}");
    }
}

#[test]
fn the_same_sessions_make_the_same_page_but_for_its_date() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "a", &["--seed", "3"]));
    succeeded(&short_run(at, "b", &["--seed", "4"]));
    for name in ["one.html", "two.html"] {
        succeeded(&palpate(at, &["report", "a", "b", "--html", name, "--align", "contact"]));
    }
    let read = |name: &str| {
        let page = fs::read_to_string(at.join(name)).unwrap();
        strict(&page);
        let lines = page.lines().filter(|line| !line.starts_with("<p class=\"made\">"));
        let kept: Vec<String> = lines.map(str::to_owned).collect();
        assert_eq!(kept.len() + 1, page.lines().count());
        kept
    };
    let page = read("one.html");
    assert_eq!(page, read("two.html"));
    let page = page.join("\n");
    for words in ["Comparison of 2 sessions", "Parameters", "contact was found"] {
        assert!(page.contains(words), "{words}");
    }
    assert_eq!(page.matches("<section class=\"session\">").count(), 2);
}

#[test]
fn a_page_proves_what_it_describes() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "press", &["--seed", "3"]));
    succeeded(&palpate(at, &["report", "press", "--html", "page.html"]));
    let check = |more: &[&str]| palpate(at, &[&["report", "--check"], more].concat());
    let whole = check(&["page.html"]);
    succeeded(&whole);
    assert_prints(&whole, "as described");
    succeeded(&check(&["page.html", "press"]));
    // Elsewhere the session has to be named.
    fs::create_dir(at.join("mail")).unwrap();
    fs::copy(at.join("page.html"), at.join("mail/page.html")).unwrap();
    let lost = check(&["mail/page.html"]);
    assert_eq!(lost.status.code(), Some(2), "{}", stderr(&lost));
    succeeded(&check(&["mail/page.html", "press"]));
    // Another word in the page.
    let page = fs::read_to_string(at.join("page.html")).unwrap();
    fs::write(at.join("changed.html"), page.replacen("Force", "Farce", 1)).unwrap();
    let changed = check(&["changed.html"]);
    assert_refused(&changed, 1, "was changed");
    // A later edit.
    let why = ["--reason", "hair under the probe", "--by", "Ada"];
    succeeded(&palpate(
        at,
        &[&["mask", "press", "--name", "m", "--leave-out", "70..71"], &why[..]].concat(),
    ));
    let later = check(&["page.html", "--json"]);
    assert_eq!(later.status.code(), Some(1));
    let object = stdout(&later);
    assert!(object.contains("analyses.jsonl"), "{object}");
    // One bit of the log.
    fs::remove_file(at.join("press/analyses.jsonl")).unwrap();
    succeeded(&check(&["page.html"]));
    let log = at.join("press/000.mcap");
    let log = if log.is_file() { log } else { at.join("press/session.mcap") };
    let mut bytes = fs::read(&log).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&log, bytes).unwrap();
    let damaged = check(&["page.html"]);
    assert_eq!(damaged.status.code(), Some(1), "{}", stderr(&damaged));
    assert!(stdout(&damaged).contains("page describes"));
    // What is no page.
    fs::write(at.join("other.html"), "<html></html>").unwrap();
    assert_eq!(check(&["other.html"]).status.code(), Some(2));
    assert_eq!(check(&["none.html"]).status.code(), Some(2));
}

#[test]
fn figures_are_drawn_and_wrong_use_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "press", &["--seed", "3"]));
    for of in ["force-time", "force-depth", "residual", "calibration"] {
        let file = format!("{of}.svg");
        succeeded(&palpate(at, &["report", "press", "--figure", &file, "--of", of]));
        let svg = fs::read_to_string(at.join(&file)).unwrap();
        assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>\n"), "{of}");
        assert!(svg.contains("<title>") && !svg.contains("NaN"), "{of}");
    }
    let png = ["report", "press", "--figure", "figure.png"];
    succeeded(&palpate(at, &png));
    let pixels = fs::read(at.join("figure.png")).unwrap();
    assert!(pixels.starts_with(b"\x89PNG\r\n\x1a\n") && pixels.len() > 10_000);
    let part = ["report", "press", "--figure", "part.svg", "--from", "70", "--until", "71"];
    succeeded(&palpate(at, &part));
    for (words, printed) in [
        (&["report"][..], "give a session"),
        (&["report", "press", "press"], "one session"),
        (&["report", "--html", "p.html"], "give the sessions"),
        (&["report", "press", "--figure", "a.gif"], "has no known file type"),
        (&["report", "press", "--figure", "a.svg", "--from", "2", "--until", "1"], "not before"),
        (
            &["report", "press", "--figure", "a.svg", "--of", "residual", "--from", "2"],
            "apply only to force-time",
        ),
        (&["report", "press", "--html", "p.html", "--analysis", "none"], "has no analysis"),
        (&["report", "press", "--analysis", "none"], "--analysis applies only to"),
        (&["report", "nowhere", "--html", "p.html"], "nowhere"),
    ] {
        let refused = palpate(at, words);
        assert_eq!(refused.status.code(), Some(2), "{words:?}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(printed), "{words:?}: {}", stderr(&refused));
        assert!(!at.join("p.html").exists() && !at.join("a.svg").exists());
    }
}

#[test]
fn an_imported_session_has_a_page_that_says_what_is_not_known() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let row = |i: u32| {
        let t = 0.1 * f64::from(i);
        let depth = t.min(5.0);
        let force = 0.2 * depth * (1.0 + (-(t - 5.0).max(0.0) / 3.0).exp());
        format!("{t},{depth},{force}\n")
    };
    let table =
        "time (s),depth (mm),force (N)\n".to_owned() + &(0..200).map(row).collect::<String>();
    fs::write(at.join("gel <3>.csv"), table).unwrap();
    succeeded(&palpate(at, &["import", "gel <3>.csv", "--into", "in"]));
    let session = fs::read_dir(at.join("in")).unwrap().next().unwrap().unwrap().path();
    let session = session.display().to_string();
    succeeded(&palpate(at, &["report", &session, "--html", "page.html"]));
    let texts = strict(&fs::read_to_string(at.join("page.html")).unwrap()).join("\n");
    for words in ["imported from", "in its file", "tau_eps", "no record of a run"] {
        assert!(texts.contains(words), "no '{words}'");
    }
    assert!(!texts.contains("total 95 %") && !texts.contains("Uncertainty budget"));
    let refused = palpate(at, &["report", &session, "--figure", "c.svg", "--of", "calibration"]);
    assert_eq!(refused.status.code(), Some(1), "{}", stderr(&refused));
}

#[test]
fn the_strict_reading_refuses_what_it_should() {
    let page = |part: &str| {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><body><h1>t</h1>{part}</body></html>\n<!-- seal -->\n"
        )
    };
    assert!(strict(&page("<p>plain &amp; well</p>")).contains(&"plain &amp; well".to_owned()));
    for wrong in [
        "<p>open",
        "<p>crossed</b>",
        "<script>x</script>",
        "<p onload=\"x\">t</p>",
        "<p>a & b</p>",
        "<p>a > b</p>",
        "<p>\u{202e}</p>",
        "<h3>after h1</h3>",
        "<th>no scope</th>",
        "<figure>no caption</figure>",
        "<svg width=\"1\"></svg>",
    ] {
        let page = page(wrong);
        assert!(std::panic::catch_unwind(|| strict(&page)).is_err(), "{wrong}");
    }
}
