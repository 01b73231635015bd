//! Edits, reviews and facts of a session in the words that command line, window and page share.

use palpate_model::rig::SignalFacts;
use palpate_sessions::{EditChange, HealthSummary, Review};

/// A time to the second, UTC.
#[must_use]
pub fn format_utc(time: &chrono::DateTime<chrono::Utc>) -> String {
    time.format("%Y-%m-%d %H:%M:%SZ").to_string()
}

#[must_use]
pub fn describe_edit(change: &EditChange) -> String {
    match change {
        EditChange::Verdict { verdict } => verdict.to_string(),
        EditChange::Note => "note".to_owned(),
        EditChange::About { entries } => entries.pairs(),
        EditChange::Tags { add, remove } => tags(add, remove),
        EditChange::Review { decision, .. } => format!("review, {}", decision.name()),
        EditChange::Contact { number, position_mm, was_mm } => {
            format!("contact {number} at {:.3} mm instead of {:.3} mm", position_mm.0, was_mm.0)
        }
    }
}

/// Tags that are added and removed.
pub(crate) fn tags(add: &[String], remove: &[String]) -> String {
    let added = add.iter().map(|tag| format!("+{tag}"));
    let signs = added.chain(remove.iter().map(|tag| format!("-{tag}")));
    format!("tags {}", signs.collect::<Vec<_>>().join(" "))
}

#[must_use]
pub fn describe_review(review: &Review) -> String {
    let stands = match review.changed.as_slice() {
        [] => "and nothing has changed since".to_owned(),
        changed => format!(
            "but {} changed since, so the session must be reviewed again",
            changed.join(", ")
        ),
    };
    let decision = review.decision.name();
    format!("{decision} by {}, {stands}", review.by)
}

/// The worst readings of the computer, each with its name.
#[must_use]
pub fn describe_health(health: &HealthSummary) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    if let Some(worst) = &health.worst {
        let mut parts = vec![
            format!("at most {:.1} ms late", worst.lateness_s * 1e3),
            format!("queue at most {:.1} % full", worst.queue_share * 100.0),
        ];
        let sync = worst.sync_s.map(|secs| secs * 1e3);
        parts.extend(sync.map(|millis| format!("longest disk synchronisation {millis:.1} ms")));
        let free = worst.free_bytes.map(|bytes| bytes as f64 / 1e9);
        parts.extend(free.map(|gigabytes| format!("at least {gigabytes:.1} GB of disk free")));
        parts.push(format!("{} readings missing", worst.missed_readings));
        lines.push(("computer", parts.join(", ")));
    }
    if health.clock_jumps > 0 {
        lines.push((
            "clock",
            format!(
                "the wall clock was set {} times during the run, by up to {:+.1} s; sample times do not depend on it",
                health.clock_jumps, health.clock_jump_s
            ),
        ));
    }
    let events = health.events.iter();
    lines.extend(events.map(|(at_s, text)| ("event", format!("at {at_s:.1} s: {text}"))));
    lines
}

#[must_use]
pub fn describe_signal(signal: &SignalFacts) -> [String; 3] {
    let range = signal
        .range_v
        .map_or(String::new(), |[low, high]| format!(", range {low:.3} to {high:.3} V"));
    let count = signal
        .resolution_v
        .map_or(String::new(), |volts| format!(", one count {:.3} mV", volts * 1e3));
    [
        format!("{:.2} Hz{range}{count}", signal.sample_rate_hz),
        format!("filter {}", signal.filter),
        signal.aliasing.clone(),
    ]
}
