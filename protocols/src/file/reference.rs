//! The reference of the language, written from the table that reads it.

use super::ASKABLE;
use super::document::MONITOR_KEYS;
use super::procedure::LOOP_KEYS;
use super::quantity::Kind;
use super::words::{COMMON, Key, Need, WORDS};
use std::fmt::Write;

/// Every step with its keys, units and usual values, then loops, monitors, units and what can be asked, in Markdown.
#[must_use]
pub fn reference() -> String {
    let mut text = String::new();
    for word in &WORDS {
        section(
            &mut text,
            &format!("`{}`", word.name),
            word.about,
            word.keys,
        );
    }
    section(
        &mut text,
        "Every step",
        "These keys go with any step.",
        &COMMON,
    );
    let about = "`repeat = 10` or `for_each = { speed = [\"0.75 mm/s\", \"1.5 mm/s\"] }`, and `steps = [ ... ]`.";
    section(&mut text, "Loops", about, &LOOP_KEYS);
    let about = "`above` or `below` is the threshold and `resume` the value at which it is past, in the unit of what is watched.";
    section(&mut text, "`[[monitor]]`", about, &MONITOR_KEYS);
    text.push_str("### Units\n\n| kind | units |\n|---|---|\n");
    for kind in [
        Kind::Speed,
        Kind::Length,
        Kind::Force,
        Kind::Time,
        Kind::Mass,
        Kind::Frequency,
        Kind::ForceRate,
        Kind::Voltage,
    ] {
        let units = kind.units().join(", ");
        let _ = writeln!(
            text,
            "| {} | {units} |",
            kind.name().trim_start_matches("a ")
        );
    }
    text.push_str("\n### What `ask` knows\n\n| key | meaning |\n|---|---|\n");
    for (key, about) in ASKABLE {
        let _ = writeln!(text, "| `{key}` | {about} |");
    }
    text
}

fn section(text: &mut String, title: &str, about: &str, keys: &[Key]) {
    // Writing to a string does not fail.
    let _ = writeln!(
        text,
        "### {title}\n\n{about}\n\n| key | kind | without it | meaning |\n|---|---|---|---|"
    );
    for key in keys {
        let without = match key.need {
            Need::Required => "needed".to_owned(),
            Need::Optional => String::new(),
            Need::Usual(usual) => format!("`{usual}`"),
        };
        let kind = key.kind.name();
        let kind = kind.strip_prefix("a ").unwrap_or(kind);
        let _ = writeln!(
            text,
            "| `{}` | {kind} | {without} | {} |",
            key.name, key.about
        );
    }
    text.push('\n');
}
