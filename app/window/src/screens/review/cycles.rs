//! Every cycle: hysteresis loops of the session in front over each other, and the peaks of every session shown, next to
//! the first.

use super::middle::head_ui;
use super::session_list::CommonParts;
use super::subject::ReviewSubject;
use super::{ReviewScreen, View};
use crate::plots::over_depth::{DepthLine, DepthLineKey};
use crate::widgets::{Column, TableRow, quiet_ui, table_ui, tick_box, tokens_of};
use crate::workers::review::Quantity;
use eframe::egui::{Color32, RichText, Ui, vec2};

/// A cycle of a session.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cycle {
    /// From 1.
    pub number: u32,
    pub peak_n: f64,
    /// Depth at the peak.
    pub depth_mm: Option<f64>,
    /// Start and end in s since the first sample.
    pub t: [f64; 2],
    /// Its first sample and the one behind its last.
    pub rows: [usize; 2],
}

/// The cycles of a session, as far as it was read.
pub(super) fn cycles(subject: &ReviewSubject) -> Vec<Cycle> {
    let recording = &subject.recording;
    let track = &recording.track;
    let mut found = Vec::new();
    for (index, stretch) in recording.cycles.iter().enumerate() {
        let next = recording.cycles.get(index + 1);
        let end = next.map_or(track.len(), |next| next.first);
        if stretch.what == 0 {
            continue;
        }
        let force = Quantity::Force as usize;
        let Some([_, peak_n]) = track.extremes(force, stretch.first, end) else {
            continue;
        };
        let place = track.first_with(force, peak_n, [stretch.first, end]);
        found.push(Cycle {
            number: stretch.what,
            peak_n,
            depth_mm: place.and_then(|place| track.value(Quantity::Depth as usize, place)),
            t: [stretch.t, track.time_of(end.saturating_sub(1)).unwrap_or(stretch.t)],
            rows: [stretch.first, end],
        });
    }
    found
}

/// The rows of the table, and the versions of the sessions for which they were made.
#[derive(Debug, Default)]
pub(super) struct CycleRows {
    key: Vec<(u64, u64)>,
    rows: Vec<TableRow>,
}

impl CycleRows {
    fn update(&mut self, subjects: &[ReviewSubject]) {
        let versions = subjects.iter().map(|one| (one.id, one.recording.version));
        if versions.clone().eq(self.key.iter().copied()) {
            return;
        }
        self.key = versions.collect();
        let common = CommonParts::of(subjects.iter());
        let rows = |one: &ReviewSubject| rows_of(one, &common.short_name(one));
        self.rows = subjects.iter().flat_map(rows).collect();
    }
}

fn rows_of(subject: &ReviewSubject, name: &str) -> Vec<TableRow> {
    let own = cycles(subject);
    let first = own.first().map(|cycle| cycle.peak_n);
    let row = |cycle: &Cycle| {
        let share = first.filter(|first| *first != 0.0);
        let share = share.map(|first| 100.0 * cycle.peak_n / first);
        let cells = vec![
            name.to_owned(),
            cycle.number.to_string(),
            format!("{:.2}", cycle.t[0]),
            format!("{:.2}", cycle.t[1] - cycle.t[0]),
            format!("{:.4}", cycle.peak_n),
            cycle.depth_mm.map_or("-".into(), |depth| format!("{depth:.4}")),
            share.map_or("-".into(), |share| format!("{share:.2}")),
        ];
        TableRow { cells, ..TableRow::default() }
    };
    own.iter().map(row).collect()
}

/// Cycles that have each a mark below the plot; of more, the first and the last have.
const MARKS_MAX: usize = 16;

impl ReviewScreen {
    pub(super) fn cycles_ui(&mut self, ui: &mut Ui) {
        self.cycle_rows.update(&self.subjects);
        if self.cycle_rows.rows.is_empty() {
            quiet_ui(ui, "None of the sessions shown has cycles.");
            return;
        }
        self.remarks_ui(ui, View::Cycles);
        let height = (0.55 * ui.available_height()).max(160.0);
        ui.allocate_ui(vec2(ui.available_width(), height), |ui| self.loops_ui(ui));
        let words = "peak force of every cycle; 'palpate analyse' also computes hysteresis, relaxation and the shift of the loops";
        head_ui(ui, "Cycles", words);
        let columns = [
            Column::words("session", 200.0),
            Column::numbers("cycle", 50.0),
            Column::numbers("begins (s)", 84.0),
            Column::numbers("lasts (s)", 84.0),
            Column::numbers("peak force (N)", 112.0),
            Column::numbers("depth there (mm)", 120.0),
            Column::numbers("of the first (%)", 110.0),
        ];
        table_ui(ui, "review_cycles", &columns, &self.cycle_rows.rows);
    }

    /// The loops of the session in front, from the first cycle to the last.
    fn loops_ui(&mut self, ui: &mut Ui) {
        let Some(front) = self.subjects.first() else { return };
        let all = cycles(front);
        if all.is_empty() {
            quiet_ui(ui, format!("{} has no cycles", front.name));
            return;
        }
        let tokens = tokens_of(ui);
        let colors: Vec<Color32> =
            (0..all.len()).map(|index| tokens.in_order(index, all.len())).collect();
        ui.horizontal_wrapped(|ui| {
            ui.label(format!("{}:", front.name));
            for (index, (cycle, color)) in all.iter().zip(&colors).enumerate() {
                if all.len() <= MARKS_MAX || index == 0 || index + 1 == all.len() {
                    let mark = RichText::new(format!("cycle {}", cycle.number));
                    ui.label(mark.color(*color).strong());
                }
            }
            tick_box(ui, &mut self.has_ends_only, "First and last cycle only");
        });
        let is_drawn = |index: usize| !self.has_ends_only || index == 0 || index + 1 == all.len();
        let id = |cycle: &Cycle| (front.id << 32) | u64::from(cycle.number);
        let drawn: Vec<(&Cycle, Color32)> = all
            .iter()
            .zip(colors)
            .enumerate()
            .filter(|(index, _)| is_drawn(*index))
            .map(|(_, one)| one)
            .collect();
        let lines: Vec<DepthLine<'_>> = drawn
            .iter()
            .map(|(cycle, color)| DepthLine {
                name: &front.name,
                track: &front.recording.track,
                key: DepthLineKey {
                    id: id(cycle),
                    version: front.fifths(),
                    rows: cycle.rows,
                    color: *color,
                },
                over: [(&[], *color, 0.0); 2],
                cursors: [None; 2],
            })
            .collect();
        let gesture = self.loop_lines.ui(ui, &lines, [&self.depth, &self.force]);
        self.follow_over_depth(&gesture);
    }
}
