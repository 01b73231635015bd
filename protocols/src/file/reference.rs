//! The reference of the language, written from the table that reads it.

use super::procedure::LOOP_KEYS;
use super::quantity::Kind;
use super::watch::MONITOR_KEYS;
use super::words::{COMMON, Key, Need, WORDS};
use crate::plans::FindContact;
use palpate_sessions::about::KEYS;
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
        if word.name == "find-contact" {
            text.push_str(&usual_search());
        }
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
    for key in KEYS {
        let _ = writeln!(text, "| `{}` | {} |", key.name, key.meaning);
    }
    text
}

/// What a search for contact does without keys.
fn usual_search() -> String {
    let search = FindContact::default();
    let press = search.press.map_or("no press".to_owned(), |press| {
        format!("a press to {} and a dwell of {}", press.force, press.dwell)
    });
    format!(
        "Without keys: a first pass at {}, felt at {}, {press}, a retreat of {} mm, a second pass at {} to {}, a \
         recovery of {}, a standard error of {} mm at most.\n\n",
        search.approach_speed,
        search.criterion,
        search.retreat_mm,
        search.pass_speed,
        search.pass_force,
        search.recovery,
        search.std_error_mm_max
    )
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
