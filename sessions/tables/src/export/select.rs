//! Selection of samples and columns.

use super::columns::time_of;
use palpate_model::rig::Phase;
use palpate_sessions::manifest::Manifest;
use palpate_sessions::record::SampleRow;
use serde::Serialize;

/// The default is all samples and the default columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleSelection {
    /// Empty for all.
    pub phases: Vec<Phase>,
    /// Empty for all.
    pub cycles: Vec<u32>,
    /// Names; empty for the default columns.
    pub columns: Vec<String>,
    /// Earliest time in s since the session's first sample.
    pub from_s: Option<f64>,
    /// Latest time in s.
    pub to_s: Option<f64>,
    /// Keeps only every n-th selected sample, without averaging; `None` keeps all.
    pub every: Option<u64>,
}

#[derive(Serialize)]
struct SelectionJson<'a> {
    phases: Vec<&'a str>,
    cycles: &'a [u32],
    from_s: Option<f64>,
    to_s: Option<f64>,
    every: u64,
}

impl SampleSelection {
    /// Whether a sample at time `t` in s is selected, apart from [`Self::every`].
    pub(super) fn takes(&self, t: f64, row: &SampleRow) -> bool {
        (self.phases.is_empty() || self.phases.contains(&row.phase))
            && (self.cycles.is_empty() || self.cycles.contains(&row.cycle))
            && self.from_s.is_none_or(|from| t >= from)
            && self.to_s.is_none_or(|to| t <= to)
    }

    /// Whether some samples are left out.
    pub fn is_partial(&self) -> bool {
        let all = Self { columns: self.columns.clone(), ..Self::default() };
        *self != all
    }

    pub(super) fn step(&self) -> u64 {
        self.every.unwrap_or(1).max(1)
    }

    /// File name of a table; a thinned one is marked.
    pub fn file_name(&self, stem: &str, ending: &str) -> String {
        match self.step() {
            1 => format!("{stem}.{ending}"),
            every => format!("{stem}.every{every}.{ending}"),
        }
    }

    /// As one JSON object, for metadata.
    pub(super) fn to_json(&self) -> String {
        let json = SelectionJson {
            phases: self.phases.iter().map(|phase| phase.name()).collect(),
            cycles: &self.cycles,
            from_s: self.from_s,
            to_s: self.to_s,
            every: self.step(),
        };
        serde_json::json!(json).to_string()
    }

    pub(super) fn sentence(&self) -> String {
        let mut parts = Vec::new();
        if !self.phases.is_empty() {
            let names: Vec<&str> = self.phases.iter().map(|phase| phase.name()).collect();
            parts.push(format!("phases {}", names.join(", ")));
        }
        if !self.cycles.is_empty() {
            let numbers: Vec<String> = self.cycles.iter().map(u32::to_string).collect();
            parts.push(format!("cycles {}", numbers.join(", ")));
        }
        parts.extend(self.from_s.map(|from| format!("from {from} s")));
        parts.extend(self.to_s.map(|to| format!("to {to} s")));
        if self.step() > 1 {
            let every = self.step();
            parts.push(format!("one of every {every} of these samples, without averaging"));
        }
        match parts.is_empty() {
            true => "All samples of the session.".into(),
            false => format!("A part of the session: {}.", parts.join("; ")),
        }
    }
}

/// Selects samples that pass by one at a time.
pub(super) struct Picker<'a> {
    manifest: &'a Manifest,
    selection: &'a SampleSelection,
    first_tick: Option<u64>,
    /// Samples seen so far, and those selected of them before [`SampleSelection::every`].
    seen: u64,
    selected: u64,
}

impl<'a> Picker<'a> {
    pub const fn new(manifest: &'a Manifest, selection: &'a SampleSelection) -> Self {
        Self { manifest, selection, first_tick: None, seen: 0, selected: 0 }
    }

    pub const fn seen(&self) -> u64 {
        self.seen
    }

    /// The number of the next sample and its time in s, if it is selected.
    pub fn pick(&mut self, row: &SampleRow) -> Option<(u64, f64)> {
        let first_tick = *self.first_tick.get_or_insert(row.tick);
        let (number, t_s) = (self.seen, time_of(self.manifest, row, first_tick));
        self.seen += 1;
        if !self.selection.takes(t_s, row) {
            return None;
        }
        let is_picked = self.selected.is_multiple_of(self.selection.step());
        self.selected += 1;
        is_picked.then_some((number, t_s))
    }
}
