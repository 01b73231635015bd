//! The queue of specimens as text.

use super::catalog::one_line;
use super::text::table;
use crate::specimen_queue::visible_items;
use palpate_sessions::specimen_queue::{QueueItem, SpecimenQueue};
use std::path::PathBuf;

/// A line a specimen, and what they add up to.
#[must_use]
pub fn queue_text(queue: &SpecimenQueue) -> String {
    if queue.items.is_empty() {
        return "the queue is empty; 'palpate queue add' adds specimens".into();
    }
    let head = "number | specimen | protocol | state | runs | last session";
    let rows = table(head, visible_items(queue).iter().map(line));
    format!("{rows}\n{}: {}", queue.name, counts_text(queue))
}

fn line(item: &QueueItem) -> Vec<String> {
    let state = match item.reason.as_str() {
        "" => item.state.to_string(),
        reason => format!("{} ({})", item.state, one_line(reason)),
    };
    let last = item.sessions.last().map_or("-".into(), |last: &PathBuf| last.display().to_string());
    vec![
        item.number.to_string(),
        one_line(&item.wanted.specimen),
        one_line(&item.wanted.protocol),
        state,
        item.sessions.len().to_string(),
        last,
    ]
}

/// How many wait and what became of the others, in one sentence.
#[must_use]
pub fn counts_text(queue: &SpecimenQueue) -> String {
    let counts = queue.counts();
    let mut parts = vec![
        format!("{} waiting", counts.waiting),
        format!("{} accepted", counts.accepted),
        format!("{} rejected", counts.rejected),
        format!("{} skipped", counts.skipped),
    ];
    if counts.without_verdict > 0 {
        parts.push("1 without a verdict".into());
    }
    let runs = if counts.runs == 1 { "1 run".into() } else { format!("{} runs", counts.runs) };
    parts.push(format!("{runs}, {} of them rejected", counts.rejected_runs));
    let seeds: Vec<String> = queue.seeds.iter().map(u64::to_string).collect();
    if !seeds.is_empty() {
        parts.push(format!("random order with seed {}", seeds.join(", then ")));
    }
    parts.join(", ")
}
