//! What is known of the session in front: verdict, health, how it ended, calibration, hashes, events, the fit.

use super::ReviewScreen;
use super::subject::ReviewSubject;
use crate::screens::exact_fit::{exact_ui, interval_ui};
use crate::widgets::{alarm_ui, fact_ui, quiet_ui, section_ui, sentence_ui, tokens_of};
use crate::workers::review::SessionFacts;
use crate::workers::review::fit::SessionFit;
use eframe::egui::{Button, CollapsingHeader, Label, RichText, ScrollArea, Sense, Ui};
use palpate_figures::uncertain::{interval, plain};
use palpate_sessions::edits::DataQuality;

/// Letters of a hash that tell it apart at a glance; the whole one is copied.
const HASH_SHOWN: usize = 12;
/// Height of the list of events in points, and of one.
const EVENTS_HEIGHT: f32 = 132.0;
const EVENT_HEIGHT: f32 = 20.0;

impl ReviewScreen {
    pub(super) fn draw_right(&mut self, ui: &mut Ui) {
        let Some(front) = self.front() else {
            quiet_ui(ui, "no session is shown");
            return;
        };
        section_ui(ui, "Session in front");
        sentence_ui(ui, front.name.as_str());
        if let Some(head) = &front.recording.head {
            fact_ui(ui, "id", head.manifest.session_id.as_str());
            let samples = format!(
                "{} over {:.1} s, begun {}",
                head.samples,
                head.last.seconds().0,
                head.manifest.started_at_text()
            );
            fact_ui(ui, "samples", samples);
        }
        match &front.recording.facts {
            Some(facts) => facts_ui(ui, facts),
            None => quiet_ui(ui, "more facts appear when the whole session has been read"),
        }
        let moved = events_ui(ui, front);
        match &front.fit {
            Some(Ok(fit)) => fit_ui(ui, fit),
            Some(Err(reason)) => {
                section_ui(ui, "Exact fit");
                alarm_ui(ui, format!("No exact fit: {reason}"));
            }
            None => {}
        }
        if let Some(t) = moved {
            self.cursors[0] = Some(t - self.front().map_or(0.0, |one| one.shift(self.time_origin)));
        }
    }
}

fn facts_ui(ui: &mut Ui, facts: &SessionFacts) {
    let names = [
        ("specimen", &facts.specimen),
        ("operator", &facts.operator),
        ("probe", &facts.indenter),
        ("protocol", &facts.protocol),
        ("rig", &facts.rig),
    ];
    for (name, value) in names.into_iter().filter(|(_, value)| !value.is_empty()) {
        fact_ui(ui, name, value);
    }
    match &facts.verdict {
        None => fact_ui(ui, "verdict", "none"),
        Some((DataQuality::Valid, reason)) => fact_ui(ui, "verdict", format!("valid: {reason}")),
        Some((verdict, reason)) => alarm_ui(ui, format!("verdict: {verdict}: {reason}")),
    }
    match &facts.end {
        Some(end) => fact_ui(ui, "ending", format!("{}: {}", end.outcome, end.reason)),
        None => alarm_ui(ui, "ending: none, the recording was interrupted"),
    }
    let (health, is_well) = facts.health_words();
    if is_well {
        fact_ui(ui, "health", health)
    } else {
        alarm_ui(ui, format!("health: {health}"))
    }
    if let Some(calibration) = &facts.calibration {
        let taken = calibration.taken_at.as_deref();
        let taken = taken.map_or(String::new(), |at| format!(", taken {at}"));
        fact_ui(ui, "calibration", format!("{}{taken}", calibration.name));
    }
    if !facts.hashes.is_empty() {
        CollapsingHeader::new("SHA-256 of its files").show(ui, |ui| hashes_ui(ui, facts));
    }
    for note in &facts.notes {
        quiet_ui(ui, note);
    }
}

/// Draws the hash of each file, and a button that copies it.
fn hashes_ui(ui: &mut Ui, facts: &SessionFacts) {
    let tokens = tokens_of(ui);
    for hash in &facts.hashes {
        // Names of files may be long; the panel stays as wide as it is.
        let short: String = hash.sha256.chars().take(HASH_SHOWN).collect();
        let words = RichText::new(format!("{} {short}", hash.what)).color(tokens.text_quiet);
        ui.add(Label::new(words.small()).truncate().sense(Sense::empty()))
            .on_hover_text(&hash.sha256);
        let name = format!("copy SHA-256 of {}", hash.what);
        if ui.add(Button::new(name).small().truncate()).clicked() {
            ui.ctx().copy_text(hash.sha256.clone());
        }
    }
}

/// Draws the events; returns the time of the one that was pressed, for cursor A.
fn events_ui(ui: &mut Ui, front: &ReviewSubject) -> Option<f64> {
    let facts = front.recording.facts.as_ref()?;
    let tokens = tokens_of(ui);
    section_ui(ui, "Events and notes");
    if facts.events.is_empty() {
        quiet_ui(ui, "none");
        return None;
    }
    let mut chosen = None;
    ScrollArea::vertical()
        .id_salt("review_events")
        .max_height(EVENTS_HEIGHT)
        .auto_shrink([false, true])
        .show_rows(ui, EVENT_HEIGHT, facts.events.len(), |ui, shown| {
            for event in &facts.events[shown] {
                let t = front.recording.track.time_of(event.after_sample);
                let at = t.map_or(String::new(), |t| format!("{t:.2} s  "));
                let ink = match (event.is_alarm, event.is_note) {
                    (true, _) => tokens.alarm_text,
                    (_, true) => tokens.text,
                    _ => tokens.text_quiet,
                };
                let words = RichText::new(format!("{at}{}", event.text)).color(ink).small();
                let label = Label::new(words).truncate().sense(Sense::click());
                let hint = format!("{}\nclick to set cursor A here", event.text);
                if ui.add(label).on_hover_text(hint).clicked() {
                    chosen = t;
                }
            }
        });
    chosen
}

fn fit_ui(ui: &mut Ui, fit: &SessionFit) {
    exact_ui(ui, &fit.report);
    section_ui(ui, "95 % from the profile likelihood");
    match &fit.profile {
        Err(reason) => quiet_ui(ui, format!("none: {reason}")),
        Ok(profile) => {
            for found in profile {
                let known = fit.report.parameter(&found.name);
                let known = known.and_then(|known| Some((known.value, known.std_error?)));
                let words = match ([found.low, found.high], known) {
                    ([Some(low), Some(high)], Some((value, error))) => {
                        interval([low, high], value, error)
                    }
                    (ends, _) => {
                        let [low, high] = ends.map(|end| end.map_or("open".to_owned(), plain));
                        format!("[{low}, {high}]")
                    }
                };
                interval_ui(ui, &found.name, &words);
            }
        }
    }
    for note in &fit.notes {
        quiet_ui(ui, note);
    }
}
