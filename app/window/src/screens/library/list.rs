//! The sessions found: catalog entries of those in sight, and which are chosen.

use crate::widgets::{
    ChoiceTable, Column, Emphasis, Glyph, ScrollPosition, SelectionMode, TableAction, TableCell,
    TableLine,
};
use eframe::egui::Ui;
use palpate_analysis::catalog_search::CatalogSearchResult;
use palpate_analysis::report::catalog::one_line;
use palpate_sessions::catalog::{CatalogEntry, CatalogOrder, ReviewFilter};
use palpate_sessions::edits::{DataQuality, ReviewDecision};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Entries that are kept, apart from those just read.
const ENTRIES_MAX: usize = 5000;
/// Rows above and below those in sight that are read with them.
const MARGIN: usize = 60;

/// Heading, width, whether it has numbers, and the order that the heading sorts by.
const COLUMNS: [(&str, f32, bool, Option<CatalogOrder>); 10] = [
    ("started (UTC)", 154.0, false, Some(CatalogOrder::Started)),
    ("specimen", 124.0, false, Some(CatalogOrder::Specimen)),
    ("verdict", 78.0, false, Some(CatalogOrder::Verdict)),
    ("review", 88.0, false, Some(CatalogOrder::Review)),
    ("health", 86.0, false, None),
    ("protocol", 110.0, false, Some(CatalogOrder::Protocol)),
    ("operator", 84.0, false, Some(CatalogOrder::Operator)),
    ("length", 70.0, true, Some(CatalogOrder::Duration)),
    ("tags", 110.0, false, None),
    ("folder", 320.0, false, None),
];

#[derive(Debug, Default)]
pub(super) struct SessionList {
    folders: Vec<String>,
    entries: BTreeMap<String, (CatalogEntry, u64)>,
    generation: u64,
    chosen: BTreeSet<String>,
    /// Raised with every change of those chosen.
    choice: u64,
    at: Option<String>,
    anchor: Option<String>,
    scrolled: ScrollPosition,
    in_sight: Range<usize>,
}

/// What the list asks of its screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ListRequest {
    /// Review the sessions chosen.
    Open,
    Sort(CatalogOrder),
}

impl SessionList {
    /// Takes the result of a search. Sessions that it does not have are no longer chosen.
    pub fn take(&mut self, found: &mut CatalogSearchResult) {
        self.folders = std::mem::take(&mut found.folders);
        self.generation += 1;
        self.choice += 1;
        self.learn(std::mem::take(&mut found.first));
        let there: BTreeSet<&String> = self.folders.iter().collect();
        self.chosen.retain(|folder| there.contains(folder));
        for one in [&mut self.at, &mut self.anchor] {
            one.take_if(|folder| !there.contains(folder));
        }
    }

    /// Takes catalog entries.
    pub fn learn(&mut self, entries: Vec<CatalogEntry>) {
        let now = self.generation;
        if self.entries.len() > ENTRIES_MAX {
            self.entries.retain(|_, (_, of)| *of == now);
        }
        let entries = entries.into_iter();
        self.entries.extend(entries.map(|entry| (entry.folder.clone(), (entry, now))));
    }

    /// Sessions in sight or chosen whose entry is missing or old.
    pub fn unknown(&self) -> Vec<String> {
        let from = self.in_sight.start.saturating_sub(MARGIN);
        let to = (self.in_sight.end + MARGIN).min(self.folders.len());
        let in_sight = self.folders.get(from..to).unwrap_or_default();
        let chosen = self.chosen.iter().take(MARGIN);
        let is_old = |folder: &&String| {
            let known = self.entries.get(*folder);
            known.is_none_or(|(_, of)| *of != self.generation)
        };
        in_sight.iter().chain(chosen).filter(is_old).cloned().collect()
    }

    pub fn count(&self) -> usize {
        self.folders.len()
    }

    /// The folders of those chosen, in the order of the list.
    pub fn chosen(&self) -> Vec<String> {
        let is_chosen = |folder: &&String| self.chosen.contains(*folder);
        self.folders.iter().filter(is_chosen).cloned().collect()
    }

    /// Another number whenever the sessions chosen, or their order, may have changed.
    pub fn choice(&self) -> u64 {
        self.choice
    }

    pub fn chosen_count(&self) -> usize {
        self.chosen.len()
    }

    /// Of the sessions chosen, as far as they are read.
    pub fn chosen_entries(&self) -> impl Iterator<Item = &CatalogEntry> {
        let known = self.chosen.iter().filter_map(|one| self.entries.get(one));
        known.map(|(entry, _)| entry)
    }

    /// The only session chosen, and the generation of its entry.
    pub fn only(&self) -> Option<(&CatalogEntry, u64)> {
        let folder = self.chosen.first().filter(|_| self.chosen.len() == 1)?;
        let (entry, of) = self.entries.get(folder)?;
        Some((entry, *of))
    }

    fn choose(&mut self, row: usize, how: SelectionMode) {
        let Some(folder) = self.folders.get(row).cloned() else { return };
        self.choice += 1;
        let place = |one: &Option<String>| {
            let one = one.as_ref()?;
            self.folders.iter().position(|folder| folder == one)
        };
        match how {
            SelectionMode::Only => self.chosen = BTreeSet::from([folder.clone()]),
            SelectionMode::Toggle => {
                if !self.chosen.remove(&folder) {
                    self.chosen.insert(folder.clone());
                }
            }
            SelectionMode::Extend => {
                let from = place(&self.anchor).unwrap_or(row);
                let rows = from.min(row)..=from.max(row);
                self.chosen = self.folders[rows].iter().cloned().collect();
            }
        }
        if how != SelectionMode::Extend || self.anchor.is_none() {
            self.anchor = Some(folder.clone());
        }
        self.at = Some(folder);
    }

    pub fn ui(&mut self, ui: &mut Ui, sorted: (CatalogOrder, bool)) -> Vec<ListRequest> {
        let columns = COLUMNS.map(|(head, width, is_number, _)| {
            let head = head.to_owned();
            Column { head, width, is_number, print: None }
        });
        let by = COLUMNS.iter().position(|column| column.3 == Some(sorted.0));
        let at = self.at.as_ref();
        let table = ChoiceTable {
            name: "Sessions",
            columns: &columns,
            can_sort: &|column| COLUMNS[column].3.is_some(),
            sorted: by.map(|by| (by, sorted.1)),
            count: self.folders.len(),
            at: at.and_then(|at| self.folders.iter().position(|folder| folder == at)),
            line: &|index| {
                let folder = &self.folders[index];
                match self.entries.get(folder) {
                    Some((entry, _)) => line(entry),
                    None => unread(folder),
                }
            },
            is_chosen: &|index| self.chosen.contains(&self.folders[index]),
        };
        let mut scrolled = self.scrolled;
        let (acts, in_sight) = table.ui(ui, &mut scrolled);
        self.scrolled = scrolled;
        self.in_sight = in_sight;
        let mut requests = Vec::new();
        for act in acts {
            match act {
                TableAction::Choose(row, how) => self.choose(row, how),
                TableAction::ChooseAll => {
                    self.choice += 1;
                    self.chosen = self.folders.iter().cloned().collect();
                }
                TableAction::Open => requests.push(ListRequest::Open),
                TableAction::Sort(column) => {
                    requests.extend(COLUMNS[column].3.map(ListRequest::Sort))
                }
            }
        }
        requests
    }
}

/// The row of a session whose entry is not read yet.
fn unread(folder: &str) -> TableLine {
    let mut cells = vec![TableCell::default(); COLUMNS.len()];
    if let Some(last) = cells.last_mut() {
        *last = TableCell { emphasis: Emphasis::Quiet, ..TableCell::text(folder) };
    }
    TableLine { name: format!("Session {folder}"), cells }
}

/// State of a session's files according to the catalog: a glyph, a word, and what is wrong.
pub(super) fn health(entry: &CatalogEntry) -> (Glyph, &'static str, Option<&str>) {
    match (&entry.trouble, &entry.ending) {
        (Some(trouble), _) if entry.is_newer => (Glyph::Question, "newer", Some(trouble)),
        (Some(trouble), _) => (Glyph::Diamond, "damaged", Some(trouble)),
        (None, None) => (Glyph::Half, "unfinished", None),
        (None, Some(_)) => (Glyph::Disc, "whole", None),
    }
}

pub(super) fn verdict(entry: &CatalogEntry) -> (Glyph, &'static str) {
    match entry.verdict {
        Some(DataQuality::Valid) => (Glyph::Tick, "valid"),
        Some(DataQuality::Suspect) => (Glyph::Question, "suspect"),
        Some(DataQuality::Rejected) => (Glyph::Cross, "rejected"),
        None if entry.trouble.is_some() => (Glyph::Dash, "unknown"),
        None => (Glyph::Dash, "none"),
    }
}

pub(super) fn review(entry: &CatalogEntry) -> (Glyph, &'static str) {
    let review = ReviewFilter::of(entry.review.as_ref());
    let mark = match review {
        ReviewFilter::Given(ReviewDecision::Accepted) => Glyph::Tick,
        ReviewFilter::Given(ReviewDecision::Rejected) => Glyph::Cross,
        ReviewFilter::Given(ReviewDecision::Repeat) => Glyph::Repeat,
        ReviewFilter::Outdated => Glyph::Question,
        ReviewFilter::None => Glyph::Dash,
    };
    match review {
        ReviewFilter::None if entry.trouble.is_some() => (mark, "unknown"),
        review => (mark, review.word()),
    }
}

/// To the second: `2026-03-05T14:15:07.000Z`.
pub(super) fn second(at: &str) -> String {
    at.get(..19).unwrap_or(at).replace('T', " ")
}

fn line(entry: &CatalogEntry) -> TableLine {
    let or_dash = |text: &str| match one_line(text) {
        text if text.is_empty() => "-".to_owned(),
        text => text,
    };
    let started = second(&entry.started_at);
    let (health_mark, health, trouble) = health(entry);
    let ((verdict_mark, verdict), (review_mark, review)) = (verdict(entry), review(entry));
    let health_emphasis = trouble.map_or(Emphasis::Plain, |_| Emphasis::Alarm);
    let emphasis = |word: &str| match word {
        "none" | "unknown" => Emphasis::Quiet,
        _ => Emphasis::Plain,
    };
    let why = trouble.map_or(String::new(), |why| format!(": {}", one_line(why)));
    let name = format!(
        "Session {}, {}, {}, {started}, verdict {verdict}, review {review}, {health}{why}, {}",
        or_dash(&entry.specimen),
        or_dash(&entry.protocol),
        or_dash(&entry.operator),
        one_line(&entry.folder)
    );
    let cells = vec![
        TableCell::text(started),
        TableCell::text(or_dash(&entry.specimen)),
        TableCell::marked(verdict_mark, verdict, emphasis(verdict)),
        TableCell::marked(review_mark, review, emphasis(review)),
        TableCell::marked(health_mark, health, health_emphasis),
        TableCell::text(or_dash(&entry.protocol)),
        TableCell::text(or_dash(&entry.operator)),
        TableCell::text(format!("{:.1} s", entry.duration_s)),
        TableCell::text(one_line(&entry.tags.join(", "))),
        TableCell { emphasis: Emphasis::Quiet, ..TableCell::text(one_line(&entry.folder)) },
    ];
    TableLine { name, cells }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(folders: &[&str]) -> CatalogSearchResult {
        let entry = |folder: &&str| CatalogEntry {
            folder: (*folder).to_owned(),
            ..CatalogEntry::default()
        };
        CatalogSearchResult {
            folders: folders.iter().map(ToString::to_string).collect(),
            first: folders.iter().take(2).map(entry).collect(),
            ..CatalogSearchResult::default()
        }
    }

    #[test]
    fn rows_are_chosen_one_several_and_from_to() {
        let mut list = SessionList::default();
        list.take(&mut found(&["a", "b", "c", "d", "e"]));
        list.choose(1, SelectionMode::Only);
        assert_eq!(list.chosen(), ["b"]);
        list.choose(3, SelectionMode::Extend);
        assert_eq!(list.chosen(), ["b", "c", "d"]);
        list.choose(0, SelectionMode::Extend);
        assert_eq!(list.chosen(), ["a", "b"]);
        list.choose(4, SelectionMode::Toggle);
        list.choose(0, SelectionMode::Toggle);
        assert_eq!(list.chosen(), ["b", "e"]);
        // Another search: what is gone is chosen no more, the rest stays, in the new order.
        list.take(&mut found(&["e", "x", "b"]));
        assert_eq!(list.chosen(), ["e", "b"]);
        list.take(&mut found(&["e"]));
        assert_eq!(list.chosen(), ["e"]);
        assert_eq!(list.only().map(|(entry, _)| entry.folder.as_str()), Some("e"));
        list.choose(9, SelectionMode::Only);
        assert_eq!(list.chosen(), ["e"]);
    }

    #[test]
    fn old_entries_in_sight_are_read_again() {
        let mut list = SessionList::default();
        list.take(&mut found(&["a", "b", "c"]));
        list.in_sight = 0..3;
        assert_eq!(list.unknown(), ["c"]);
        list.learn(found(&["c"]).first);
        assert!(list.unknown().is_empty());
        list.take(&mut found(&["a", "b", "c"]));
        // What was known is shown until it was read again.
        assert_eq!(list.unknown(), ["c"]);
        assert!(list.entries.contains_key("c"));
    }

    #[test]
    fn a_row_has_its_state_in_words_and_shapes() {
        let mut entry = CatalogEntry {
            folder: "s/1".into(),
            ending: Some("finish".into()),
            verdict: Some(DataQuality::Suspect),
            ..CatalogEntry::default()
        };
        assert_eq!(health(&entry).1, "whole");
        assert_eq!(verdict(&entry), (Glyph::Question, "suspect"));
        assert_eq!(review(&entry), (Glyph::Dash, "none"));
        entry.ending = None;
        assert_eq!(health(&entry), (Glyph::Half, "unfinished", None));
        entry.trouble = Some("chunk 3 is\ndamaged".into());
        entry.verdict = None;
        let name = line(&entry).name;
        assert!(
            name.contains("verdict unknown, review unknown, damaged: chunk 3 is damaged"),
            "{name}"
        );
    }
}
