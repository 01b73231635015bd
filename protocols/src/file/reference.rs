//! The reference of the language, written from the table that reads it.

use super::keys::{COMMON, Key, KeyNeed};
use super::monitors::MONITOR_KEYS;
use super::procedure::LOOP_KEYS;
use super::quantity::QuantityKind;
use crate::steps::KINDS;
use palpate_model::metadata::METADATA_KEYS;
use std::fmt::Write;

/// Every step with its keys, units and usual values, then loops, monitors, units and what can be asked, in Markdown.
#[must_use]
pub fn reference() -> String {
    let mut text = String::new();
    for kind in KINDS.iter().filter(|kind| kind.build.is_some()) {
        section(&mut text, &format!("`{}`", kind.word), kind.about, kind.keys);
        if let Some(note) = kind.note {
            text.push_str(&note());
        }
    }
    section(&mut text, "Every step", "Every step may have these keys.", &COMMON);
    let about = "A loop has `steps = [ ... ]` and either `repeat = 10` or `for_each = { speed = [\"0.75 mm/s\", \"1.5 mm/s\"] }`.";
    section(&mut text, "Loops", about, &LOOP_KEYS);
    let about = "`above` or `below` is the threshold; `resume` is the value at which the monitor resets. Both have the unit of the watched quantity.";
    section(&mut text, "`[[monitor]]`", about, &MONITOR_KEYS);
    text.push_str("### Units\n\n| kind | units |\n|---|---|\n");
    for kind in QuantityKind::with_units() {
        let units = kind.units().join(", ");
        let _ = writeln!(text, "| {} | {units} |", kind.name().trim_start_matches("a "));
    }
    text.push_str("\n### Keys of `ask`\n\n| key | meaning |\n|---|---|\n");
    for key in METADATA_KEYS {
        let _ = writeln!(text, "| `{}` | {} |", key.name, key.meaning);
    }
    text
}

fn section(text: &mut String, title: &str, about: &str, keys: &[Key]) {
    // Writing to a string does not fail.
    let _ = writeln!(
        text,
        "### {title}\n\n{about}\n\n| key | kind | default | meaning |\n|---|---|---|---|"
    );
    for key in keys {
        let without = match key.need {
            KeyNeed::Required => "required".to_owned(),
            KeyNeed::Optional => String::new(),
            KeyNeed::Usual(usual) => format!("`{usual}`"),
        };
        let kind = key.kind.name();
        let kind = kind.strip_prefix("a ").unwrap_or(kind);
        let _ = writeln!(text, "| `{}` | {kind} | {without} | {} |", key.name, key.about);
    }
    text.push('\n');
}
