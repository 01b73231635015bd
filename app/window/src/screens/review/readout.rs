//! Values at the two cursors and the differences between them, as labels that can be read aloud and copied.

use super::ReviewScreen;
use super::subject::ReviewSubject;
use crate::widgets::quiet_ui;
use crate::workers::review::Quantity;
use eframe::egui::{RichText, Ui};

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
    /// `shift`: time of the session in s at the axis' zero.
    fn of(subject: &ReviewSubject, cursors: [Option<f64>; 2], shift: f64) -> Self {
        let track = &subject.recording.track;
        let places = cursors.map(|cursor| track.place(cursor? + shift));
        Self {
            t: places.map(|place| Some(place?.t - shift)),
            values: Quantity::ALL
                .map(|quantity| places.map(|place| track.value(quantity as usize, place?))),
        }
    }

    /// One text for each label.
    fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut add = |name: &str, unit: &str, digits: usize, ends: [Option<f64>; 2]| {
            for (cursor, value) in ["A", "B"].into_iter().zip(ends) {
                if let Some(value) = value {
                    words.push(format!("{name} at {cursor} {value:.digits$} {unit}"));
                }
            }
            if let [Some(a), Some(b)] = ends {
                let name = if name.len() == 1 { format!("d{name}") } else { format!("d {name}") };
                words.push(format!("{name} {:+.digits$} {unit}", b - a));
            }
        };
        add("t", "s", 4, self.t);
        for quantity in Quantity::ALL {
            let name = match quantity {
                Quantity::Force => "F",
                Quantity::Depth => "depth",
                Quantity::Volts => "signal",
                Quantity::Position => "position",
            };
            add(name, quantity.unit(), decimals(quantity), self.values[quantity as usize]);
        }
        words
    }
}

impl ReviewScreen {
    pub(super) fn readout_ui(&self, ui: &mut Ui) {
        let Some(front) = self.front() else { return };
        if self.cursors == [None; 2] {
            quiet_ui(ui, "set cursors A and B to read values and differences");
            return;
        }
        let words = CursorReadout::of(front, self.cursors, front.shift(self.time_origin)).words();
        ui.horizontal_wrapped(|ui| {
            for word in &words {
                ui.label(RichText::new(word).monospace());
                ui.add_space(4.0);
            }
            if ui.button("Copy readout").clicked() {
                let lines = words.join("\n");
                ui.ctx().copy_text(format!("{}\n{lines}\n", front.name));
            }
        });
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
