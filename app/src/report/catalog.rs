//! What was found in the catalog, as text.

use super::text::in_columns;
use palpate_sessions::catalog::{Entry, Found};

/// One line a session, and how many there are.
#[must_use]
pub fn list(found: &Found, page: usize, pages: usize) -> String {
    if found.count == 0 {
        return "no session is like that".into();
    }
    let head = [
        "started", "specimen", "operator", "protocol", "length", "verdict", "folder",
    ];
    let mut lines = vec![head.map(String::from).to_vec()];
    lines.extend(found.entries.iter().map(line));
    let sessions = if found.count == 1 {
        "session"
    } else {
        "sessions"
    };
    let mut text = format!("{}\n{} {sessions}", in_columns(&lines), found.count);
    if pages > 1 {
        text += &format!(", page {page} of {pages}");
    }
    text
}

fn line(entry: &Entry) -> Vec<String> {
    if let (true, Some(trouble)) = (entry.session_id.is_empty(), &entry.trouble) {
        return vec![format!("{}: {trouble}", entry.folder)];
    }
    let or_dash = |text: &str| match one_line(text) {
        text if text.is_empty() => "-".to_owned(),
        text => text,
    };
    let length = match entry.ending {
        Some(_) => format!("{:.1} s", entry.duration_s),
        None => format!("{:.1} s, no end", entry.duration_s),
    };
    // To the second: `2026-03-05T14:15:07.000Z`.
    let started = entry.started_at.get(..19).unwrap_or(&entry.started_at);
    vec![
        started.replace('T', " "),
        or_dash(&entry.specimen),
        or_dash(&entry.operator),
        or_dash(&entry.protocol),
        length,
        entry.verdict.map_or("-".into(), |it| it.to_string()),
        one_line(&entry.folder),
    ]
}

/// A text without anything that would end its line or move the cursor.
fn one_line(text: &str) -> String {
    let plain = text
        .trim()
        .chars()
        .map(|letter| if letter.is_control() { ' ' } else { letter });
    plain.collect()
}
