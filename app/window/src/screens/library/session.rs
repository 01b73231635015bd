//! Facts of the sessions chosen.

use super::list::{health, review, second, verdict};
use crate::widgets::{
    GLYPH_RADIUS, GLYPH_WIDTH, Glyph, fact_name_ui, fact_ui, glyph_at, quiet_ui, section_ui,
    small_alarm_ui, small_ui, tokens_of,
};
use eframe::egui::{Label, RichText, ScrollArea, Sense, Ui, vec2};
use palpate_analysis::catalog_search::SessionHistory;
use palpate_analysis::report::catalog::one_line;
use palpate_figures::uncertain::plain;
use palpate_sessions::catalog::{CatalogEntry, NamedValueSource, SessionOrigin};
use std::collections::BTreeSet;
use std::path::Path;

/// Values shown of one kind.
const VALUES: usize = 24;
/// Names shown of several sessions.
const NAMES: usize = 6;
/// Height of the history in points.
const HISTORY: f32 = 150.0;

/// A fact with a glyph before its word.
fn marked_ui(ui: &mut Ui, name: &str, mark: Glyph, word: &str, is_wrong: bool) {
    let tokens = tokens_of(ui);
    let ink = if is_wrong { tokens.alarm_text } else { tokens.text };
    ui.horizontal_top(|ui| {
        fact_name_ui(ui, name);
        let height = ui.text_style_height(&eframe::egui::TextStyle::Body);
        let (place, _) = ui.allocate_exact_size(vec2(GLYPH_WIDTH * 0.6, height), Sense::hover());
        glyph_at(ui.painter(), mark, place.center(), GLYPH_RADIUS, ink);
        ui.add(Label::new(RichText::new(word).color(ink)).wrap());
    });
}

/// Draws one session. `history` is none until it is read.
pub(super) fn session_ui(
    ui: &mut Ui,
    entry: &CatalogEntry,
    history: Option<&Result<SessionHistory, String>>,
) {
    section_ui(ui, "Session");
    let mut fact = |name: &str, value: &str| {
        if !value.is_empty() {
            fact_ui(ui, name, one_line(value));
        }
    };
    fact("specimen", &entry.specimen);
    fact("operator", &entry.operator);
    let version = entry.protocol_version.map_or(String::new(), |it| format!(", version {it}"));
    fact("protocol", &format!("{}{version}", entry.protocol));
    fact("started", &format!("{} UTC", second(&entry.started_at)));
    fact("length", &format!("{:.1} s, {} samples", entry.duration_s, entry.samples));
    fact("probe", &entry.indenter);
    fact("rig", &entry.rig_identity);
    fact("calibrated", &entry.calibration);
    fact("load cell", &entry.cell);
    fact(
        "origin",
        match entry.origin {
            SessionOrigin::Recorded => "recorded here",
            SessionOrigin::Imported => "imported from another program's file",
            SessionOrigin::Recovered => "recovered from a damaged or interrupted session",
        },
    );
    let ending = entry.ending.as_deref().unwrap_or_default();
    fact("ending", &with_reason(ending, &entry.reason));
    fact("folder", &entry.folder);
    let (mark, word, trouble) = health(entry);
    let word = trouble.map_or(word.to_owned(), |why| format!("{word}: {}", one_line(why)));
    marked_ui(ui, "health", mark, &word, trouble.is_some());
    let (mark, word) = verdict(entry);
    marked_ui(ui, "verdict", mark, &with_reason(word, &entry.verdict_reason), false);
    let (mark, word) = review(entry);
    let reviewed = entry.review.as_ref().map_or(word.to_owned(), |review| {
        let by = format!("{word}, by {}", review.by);
        let changed = match review.changed.as_slice() {
            [] => String::new(),
            changed => format!("; changed since: {}", changed.join(", ")),
        };
        with_reason(&by, &review.reason) + &changed
    });
    marked_ui(ui, "review", mark, &reviewed, false);
    let tags = match entry.tags.as_slice() {
        [] => "none".to_owned(),
        tags => one_line(&tags.join(", ")),
    };
    fact_ui(ui, "tagged", tags);
    let analyses: Vec<String> = entry
        .analyses
        .iter()
        .map(|one| format!("{} '{}'", one.what, one_line(&one.name)))
        .collect();
    if !analyses.is_empty() {
        fact_ui(ui, "analyses", analyses.join(", "));
    }
    history_ui(ui, history);
    values_ui(ui, entry);
}

fn with_reason(word: &str, reason: &str) -> String {
    match reason {
        "" => word.to_owned(),
        reason => format!("{word}: {}", one_line(reason)),
    }
}

fn history_ui(ui: &mut Ui, history: Option<&Result<SessionHistory, String>>) {
    match history {
        None => quiet_ui(ui, "reading notes and history"),
        Some(Err(err)) => small_alarm_ui(ui, err),
        Some(Ok(history)) => {
            for note in &history.notes {
                fact_ui(ui, "noted", format!("{} ({})", one_line(&note.reason), note.by));
            }
            if history.events.is_empty() {
                return;
            }
            section_ui(ui, "History");
            ScrollArea::vertical().id_salt("history").max_height(HISTORY).show(ui, |ui| {
                for event in &history.events {
                    let words = format!(
                        "{} {} {}: {}",
                        second(&event.at),
                        event.by,
                        event.what,
                        one_line(&event.sentence)
                    );
                    small_ui(ui, words);
                }
            });
        }
    }
}

fn values_ui(ui: &mut Ui, entry: &CatalogEntry) {
    for (source, title) in [
        (NamedValueSource::About, "Labels"),
        (NamedValueSource::Plan, "Protocol values"),
        (NamedValueSource::Fit, "Saved fits"),
    ] {
        let values: Vec<_> = entry.named.iter().filter(|one| one.source == source).collect();
        if values.is_empty() {
            continue;
        }
        section_ui(ui, title);
        for one in values.iter().take(VALUES) {
            // A number that was converted has its unit in its text.
            let text = match (one.number, source) {
                (Some(number), NamedValueSource::Fit) => format!("{} {}", plain(number), one.unit),
                _ => one.text.clone(),
            };
            ui.add(Label::new(one_line(&format!("{} {text}", one.name))).truncate());
        }
        if values.len() > VALUES {
            quiet_ui(ui, format!("and {} more", values.len() - VALUES));
        }
    }
}

/// Draws what several sessions have in common. `count` are chosen.
pub(super) fn several_ui<'a>(
    ui: &mut Ui,
    count: usize,
    entries: impl Iterator<Item = &'a CatalogEntry>,
) {
    section_ui(ui, &format!("{count} sessions chosen"));
    let entries: Vec<&CatalogEntry> = entries.collect();
    if entries.len() < count {
        return;
    }
    let names = |of: fn(&CatalogEntry) -> &str| {
        let names: BTreeSet<&str> = entries.iter().map(|entry| of(entry)).collect();
        let mut words: Vec<String> = names.iter().take(NAMES).map(|name| one_line(name)).collect();
        if names.len() > NAMES {
            words.push(format!("and {} more", names.len() - NAMES));
        }
        words.join(", ")
    };
    fact_ui(ui, "specimens", names(|entry| &entry.specimen));
    fact_ui(ui, "operators", names(|entry| &entry.operator));
    fact_ui(ui, "protocols", names(|entry| &entry.protocol));
    fact_ui(ui, "verdicts", names(|entry| verdict(entry).1));
    fact_ui(ui, "reviews", names(|entry| review(entry).1));
    fact_ui(ui, "health", names(|entry| health(entry).1));
    let of_all = entries.iter().skip(1).fold(
        entries.first().map_or(BTreeSet::new(), |one| one.tags.iter().collect()),
        |common: BTreeSet<&String>, one| {
            common.into_iter().filter(|tag| one.tags.contains(tag)).collect()
        },
    );
    let tags: Vec<String> = of_all.into_iter().map(|tag| one_line(tag)).collect();
    if !tags.is_empty() {
        fact_ui(ui, "all tagged", tags.join(", "));
    }
}

/// Draws the command line that replays a session.
pub(super) fn replay_ui(ui: &mut Ui, folder: &Path) {
    section_ui(ui, "Replay");
    let line = format!("palpate replay \"{}\" --window", folder.display());
    ui.add(Label::new(RichText::new(&line).monospace()).wrap());
    if ui.button("Copy command").clicked() {
        ui.ctx().copy_text(line);
    }
}
