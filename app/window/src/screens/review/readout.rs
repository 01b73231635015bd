//! Values at the two cursors and the differences between them, as labels that can be read aloud and copied.

use super::ReviewScreen;
use super::subject::ReviewSubject;
use crate::widgets::{quiet_ui, tokens_of};
use crate::workers::review::Quantity;
use eframe::egui::{Grid, RichText, Role, Ui, WidgetInfo, vec2};

/// Decimals of a quantity: a tenth of a millinewton, a tenth of a micrometre, a microvolt.
const fn decimals(quantity: Quantity) -> usize {
    match quantity {
        Quantity::Force | Quantity::Depth | Quantity::Position => 4,
        Quantity::Volts => 6,
    }
}

/// Values of one session at the cursors A and B.
#[derive(Clone, Debug, Default, PartialEq)]
struct CursorReadout {
    /// Time on the axis, of the nearest sample.
    t: [Option<f64>; 2],
    values: [[Option<f64>; 2]; 4],
}

impl CursorReadout {
    /// `shift`: time of the session in s at the axis' zero; `column`: samples of whose mean a value is, as the line is.
    fn of(subject: &ReviewSubject, cursors: [Option<f64>; 2], shift: f64, column: usize) -> Self {
        let track = &subject.recording.track;
        let places = cursors.map(|cursor| track.place(cursor? + shift));
        Self {
            t: places.map(|place| Some(place?.t - shift)),
            values: Quantity::ALL
                .map(|quantity| places.map(|p| track.column_mean(quantity as usize, p?, column))),
        }
    }

    /// What is known of each quantity; those of which nothing is known are left out.
    fn columns(&self) -> Vec<ReadoutColumn> {
        let column = |name: &'static str, unit, digits: usize, ends: [Option<f64>; 2]| {
            let at = |cursor: &str, value: f64| {
                let number = format!("{value:.digits$}");
                let words = format!("{name} at {cursor} {number} {unit}");
                (number, words)
            };
            let [a, b] = ends;
            let difference = a.zip(b).map(|(a, b)| {
                let number = format!("{:+.digits$}", b - a);
                let gap = if name.len() == 1 { "" } else { " " };
                let words = format!("d{gap}{name} {number} {unit}");
                (number, words)
            });
            let cells = [a.map(|a| at("A", a)), b.map(|b| at("B", b)), difference];
            ReadoutColumn { name, unit, cells }
        };
        let mut columns = vec![column("t", "s", 4, self.t)];
        for quantity in Quantity::ALL {
            let name = match quantity {
                Quantity::Force => "F",
                Quantity::Depth => "depth",
                Quantity::Volts => "signal",
                Quantity::Position => "position",
            };
            let values = self.values[quantity as usize];
            columns.push(column(name, quantity.unit(), decimals(quantity), values));
        }
        columns.retain(|column| column.cells.iter().any(Option::is_some));
        columns
    }

    /// One text for each value, to be copied.
    fn words(&self) -> Vec<String> {
        let columns = self.columns().into_iter();
        columns.flat_map(|column| column.cells).flatten().map(|(_, words)| words).collect()
    }
}

/// A quantity at cursor A, at B, and its difference: each as a number and in words.
struct ReadoutColumn {
    name: &'static str,
    unit: &'static str,
    cells: [Option<(String, String)>; 3],
}

/// Width of a column in points.
const COLUMN: f32 = 88.0;

impl ReviewScreen {
    /// Draws a line for each cursor and one for their difference, a column for each quantity.
    /// Values are means of so many samples, as the lines are.
    pub(super) fn readout_ui(&self, ui: &mut Ui, column: usize) {
        let Some(front) = self.front() else { return };
        if self.cursors == [None; 2] {
            quiet_ui(ui, "set cursors A and B to read values and differences");
            return;
        }
        let readout = CursorReadout::of(front, self.cursors, front.shift(self.time_origin), column);
        let columns = readout.columns();
        let is_wide = columns.len() as f32 * COLUMN + 200.0 < ui.available_width();
        let ink = tokens_of(ui).text_quiet;
        let quiet = |words: &str| RichText::new(words).small().color(ink);
        Grid::new("readout").spacing(vec2(16.0, 0.0)).min_row_height(19.0).show(ui, |ui| {
            let means = format!("mean of {column}");
            ui.label(if column > 1 { quiet(&means) } else { RichText::default() });
            for column in &columns {
                ui.label(quiet(&format!("{} ({})", column.name, column.unit)));
            }
            if is_wide {
                self.copy_ui(ui, &front.name, &readout);
            }
            ui.end_row();
            for (line, name) in ["A", "B", "B \u{2212} A"].into_iter().enumerate() {
                if columns.iter().all(|column| column.cells[line].is_none()) {
                    continue;
                }
                ui.label(quiet(name));
                for column in &columns {
                    let (number, words) = column.cells[line].clone().unwrap_or_default();
                    let number = ui.label(RichText::new(number).monospace());
                    number.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
                }
                ui.end_row();
            }
        });
        if !is_wide {
            self.copy_ui(ui, &front.name, &readout);
        }
    }

    fn copy_ui(&self, ui: &mut Ui, session: &str, readout: &CursorReadout) {
        if ui.button("Copy readout").clicked() {
            ui.ctx().copy_text(format!("{session}\n{}\n", readout.words().join("\n")));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readout_has_differences_where_both_cursors_have_values() {
        let reading = CursorReadout {
            t: [Some(1.0), Some(3.5)],
            values: [[Some(0.25), Some(1.0)], [Some(0.1), None], [None, None], [None, None]],
        };
        assert_eq!(
            reading.words(),
            [
                "t at A 1.0000 s",
                "t at B 3.5000 s",
                "dt +2.5000 s",
                "F at A 0.2500 N",
                "F at B 1.0000 N",
                "dF +0.7500 N",
                "depth at A 0.1000 mm",
            ]
        );
        assert!(CursorReadout::default().words().is_empty());
    }
}
