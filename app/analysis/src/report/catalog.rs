//! Results of a catalog search as text.

use super::text::{in_columns, table};
use palpate_sessions::catalog::{CatalogEntry, CatalogPage, HistoryEvent, ReviewFilter};

/// One line a session, and how many there are.
#[must_use]
pub fn list(found: &CatalogPage, page: usize, pages: usize) -> String {
    if found.count == 0 {
        return "no session matches".into();
    }
    let head = "started | specimen | operator | protocol | length | verdict | review | folder";
    let sessions = if found.count == 1 { "session" } else { "sessions" };
    let more = if found.has_more { "more than " } else { "" };
    let listed = table(head, found.entries.iter().map(line));
    let mut text = format!("{listed}\n{more}{} {sessions}", found.count);
    match (found.has_more, pages > 1) {
        (true, _) => text += &format!(", page {page}"),
        (false, true) => text += &format!(", page {page} of {pages}"),
        (false, false) => {}
    }
    text
}

fn line(entry: &CatalogEntry) -> Vec<String> {
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
    let mut folder = one_line(&entry.folder);
    if !entry.tags.is_empty() {
        folder += &format!("  [{}]", entry.tags.join(", "));
    }
    // The entry may then be outdated or incomplete.
    if let Some(trouble) = &entry.trouble {
        folder += &format!("  ({})", one_line(trouble));
    }
    vec![
        started.replace('T', " "),
        or_dash(&entry.specimen),
        or_dash(&entry.operator),
        or_dash(&entry.protocol),
        length,
        match entry.verdict {
            Some(verdict) => verdict.to_string(),
            None if entry.trouble.is_some() => "?".into(),
            None => "-".into(),
        },
        match entry.review.as_ref() {
            None if entry.trouble.is_some() => "?".into(),
            review => ReviewFilter::of(review).word().to_owned(),
        },
        folder,
    ]
}

/// One line an event, oldest first.
#[must_use]
pub fn history(events: &[HistoryEvent]) -> String {
    let line = |event: &HistoryEvent| {
        let at = event.at.get(..19).map_or("undated".to_owned(), |at| at.replace('T', " "));
        let by = match event.by.as_str() {
            "" => "-".to_owned(),
            by => one_line(by),
        };
        let what = one_line(&event.sentence);
        let what = match event.folder.as_str() {
            "" => what,
            folder => format!("{what} ({})", one_line(folder)),
        };
        vec![at, event.what.clone(), by, what]
    };
    in_columns(&events.iter().map(line).collect::<Vec<_>>())
}

/// A text without anything that would end its line or move the cursor.
pub fn one_line(text: &str) -> String {
    text.trim().chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_that_were_not_counted_are_said_to_be_there() {
        let found = |count, has_more| {
            let entries = vec![CatalogEntry::default()];
            let text = list(&CatalogPage { count, has_more, entries }, 2, 500);
            text.lines().last().unwrap_or_default().to_owned()
        };
        assert_eq!(found(10_000, true), "more than 10000 sessions, page 2");
        assert_eq!(found(10_000, false), "10000 sessions, page 2 of 500");
    }
}
