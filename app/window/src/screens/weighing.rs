//! Calibration weights one by one: the next weight, whether the signal is steady, and each reading next to the value that
//! the calibration in use expects.

use super::calibration::calibration_session;
use super::form::RunSetup;
use crate::plots::figure::{PlotLook, legend_ui, plot_ui};
use crate::theme::reading_style;
use crate::widgets::{
    Column, Emphasis, TableRow, heading_ui, share_ui, table_ui, tokens_of, width_of,
};
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_analysis::report::live::weighing_plot;
use palpate_model::calibration::{CalibrationCurve, SettleProgress, newtons_of};
use palpate_model::units::Volts;
use palpate_protocols::engine::PauseView;
use palpate_protocols::weight_readings::WeightReading;
use palpate_runner::{PlannedWeight, RunView};

/// Height of the table in points.
const TABLE_HEIGHT: f32 = 250.0;

/// Heading and width of a column, whether it has numbers, and whether it stays where there is little room.
const COLUMNS: [(&str, f32, bool, bool); 8] = [
    ("pass", 34.0, true, true),
    ("masses go", 66.0, false, true),
    ("mass (g)", 60.0, true, true),
    ("expected (V)", 82.0, true, false),
    ("measured (V)", 82.0, true, true),
    ("deviation (mV)", 92.0, true, false),
    ("deviation (N)", 84.0, true, true),
    ("", 44.0, false, true),
];

/// Draws the readings of a run that weighs.
pub fn weighing_ui(ui: &mut Ui, run: &RunView, signal: Option<Volts>, bench: &RunSetup) {
    let next = next_of(run);
    now_ui(ui, run, next, signal, &bench.curve);
    ui.add_space(4.0);
    let columns = COLUMNS.map(|(head, width, is_number, _)| match is_number {
        true => Column::numbers(head, width),
        false => Column::words(head, width),
    });
    let mut rows: Vec<TableRow> =
        run.planned_weights.iter().map(|planned| row(planned, run, next, &bench.curve)).collect();
    ui.allocate_ui(vec2(ui.available_width(), TABLE_HEIGHT), |ui| {
        if width_of(&columns) <= ui.available_width() {
            table_ui(ui, "readings", &columns, &rows);
            return;
        }
        // What follows from the other columns is left out where there is no room.
        let kept = |place: &usize| COLUMNS[*place].3;
        let places: Vec<usize> = (0..COLUMNS.len()).filter(kept).collect();
        for row in &mut rows {
            row.cells = places.iter().map(|place| row.cells[*place].clone()).collect();
        }
        let kept: Vec<Column> = places.iter().map(|place| columns[*place].clone()).collect();
        table_ui(ui, "readings", &kept, &rows);
    });
    residuals_ui(ui, run, bench);
}

/// The reading that comes next or is under way.
fn next_of(run: &RunView) -> Option<&PlannedWeight> {
    let is_over = run.outcome.is_some();
    let mut ahead = run.planned_weights.iter();
    ahead.find(|one| !is_over && one.step_index >= run.step_index)
}

fn now_ui(
    ui: &mut Ui,
    run: &RunView,
    next: Option<&PlannedWeight>,
    signal: Option<Volts>,
    curve: &CalibrationCurve,
) {
    let tokens = tokens_of(ui);
    let place = match next {
        Some(next) => {
            let done = run.weight_readings.len();
            let expected = curve.volts_from_newtons(newtons_of(next.mass_g));
            format!(
                "Reading {} of {}: {} g in all, {:.4} expected",
                done + 1,
                run.planned_weights.len(),
                next.mass_g,
                expected
            )
        }
        None => {
            format!("{} of {} readings taken", run.weight_readings.len(), run.planned_weights.len())
        }
    };
    heading_ui(ui, place);
    ui.horizontal(|ui| {
        let signal = signal.map_or_else(|| "--".to_owned(), |volts| format!("{volts:.4}"));
        ui.label(RichText::new(signal).text_style(reading_style()));
        ui.add_space(12.0);
        if let Some(settling) = &run.settling {
            steady_ui(ui, settling);
        }
        let words = RichText::new(deed_words(run)).color(tokens.text_quiet);
        ui.add(Label::new(words).wrap());
    });
}

/// What the operator is to do now.
fn deed_words(run: &RunView) -> String {
    if run.outcome.is_some() || run.holding.is_some() {
        return match calibration_session(Some(run)) {
            Ok(_) => "All weights are read; the calibration can be saved.".to_owned(),
            Err(_) => String::new(),
        };
    }
    match (&run.prompt, &run.settling, &run.pause) {
        (Some(prompt), _, _) => {
            let deed = prompt.message.trim_end_matches('.');
            format!("{deed}, then press Done F2; the signal is then checked.")
        }
        (None, _, PauseView::Paused { .. }) => {
            "The run is paused: leave the load cell as it is.".to_owned()
        }
        (None, Some(_), _) => "Wait and touch nothing.".to_owned(),
        (None, None, _) => "Wait: nothing is to be done at the load cell.".to_owned(),
    }
}

/// The stability indicator: how full the window is that must be steady, and what is not steady yet.
fn steady_ui(ui: &mut Ui, settling: &SettleProgress) {
    ui.vertical(|ui| {
        ui.set_width(240.0);
        share_ui(ui, settling.filled);
        ui.label(steady_words(settling));
    });
}

/// The same in words.
fn steady_words(settling: &SettleProgress) -> String {
    let left = (settling.timeout.0 - settling.waited.0).max(0.0);
    match &settling.last {
        None => format!("watching for {:.1} s; {left:.0} s left", settling.waited.0),
        Some(last) if last.noise.0 > settling.noise_max.0 => format!(
            "noise {:.2} mV, limit {:.2} mV; {left:.0} s left",
            last.noise.0 * 1e3,
            settling.noise_max.0 * 1e3
        ),
        Some(last) => format!(
            "drift {:+.2} mV/s, limit {:.2} mV/s; {left:.0} s left",
            last.slope_v_per_s * 1e3,
            settling.slope_max_v_per_s * 1e3
        ),
    }
}

fn row(
    planned: &PlannedWeight,
    run: &RunView,
    next: Option<&PlannedWeight>,
    curve: &CalibrationCurve,
) -> TableRow {
    let taken = run.weight_readings.iter().find(|one| one.step_index == planned.step_index);
    let is_next = next == Some(planned);
    let expected = curve.volts_from_newtons(newtons_of(planned.mass_g));
    let deviation = taken.map(|one| WeightDeviation::of(one, curve));
    let cells = vec![
        planned.repeat.to_string(),
        if planned.is_loading { "up" } else { "down" }.into(),
        planned.mass_g.to_string(),
        format!("{:.4}", expected.0),
        taken.map_or_else(String::new, |one| format!("{:.4}", one.volts().0)),
        deviation.as_ref().map_or_else(String::new, |deviation| format!("{:+.1}", deviation.mv)),
        deviation
            .as_ref()
            .map_or_else(String::new, |deviation| format!("{:+.3}", deviation.newtons)),
        match (taken, is_next) {
            (Some(_), _) => "read".into(),
            (None, true) => "now".into(),
            (None, false) => String::new(),
        },
    ];
    TableRow {
        cells,
        emphasis: match (taken, is_next) {
            (_, true) => Emphasis::Marked,
            (None, false) => Emphasis::Quiet,
            (Some(_), false) => Emphasis::Plain,
        },
        hint: None,
    }
}

/// A reading against what the calibration in use expects.
struct WeightDeviation {
    mv: f64,
    newtons: f64,
}

impl WeightDeviation {
    fn of(one: &WeightReading, curve: &CalibrationCurve) -> Self {
        let known = newtons_of(one.mass_g());
        Self {
            mv: (one.volts().0 - curve.volts_from_newtons(known).0) * 1e3,
            newtons: curve.newtons_from_volts(one.volts()).0 - known.0,
        }
    }
}

fn residuals_ui(ui: &mut Ui, run: &RunView, bench: &RunSetup) {
    let words =
        format!("Force from the calibration in use ({}) minus the weight", bench.calibration.name);
    ui.label(RichText::new(words).strong());
    let plot = weighing_plot(run, &bench.curve);
    legend_ui(ui, &[&plot]);
    plot_ui(ui, "weighing residuals", &plot, PlotLook::default());
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::calibration::SteadySignal;
    use palpate_model::units::Seconds;

    #[test]
    fn the_indicator_says_what_is_missing() {
        let mut settling = SettleProgress {
            waited: Seconds(1.2),
            timeout: Seconds(30.0),
            filled: 0.5,
            last: None,
            slope_max_v_per_s: 0.0,
            noise_max: Volts(0.005),
        };
        assert_eq!(steady_words(&settling), "watching for 1.2 s; 29 s left");
        let mut steady = SteadySignal {
            mean: Volts(1.3),
            noise: Volts(0.02),
            slope_v_per_s: 0.004,
            samples: 2000,
            waited: Seconds(2.5),
        };
        settling.last = Some(steady);
        assert!(steady_words(&settling).starts_with("noise 20.00 mV, limit 5.00 mV"));
        steady.noise = Volts(0.001);
        settling.last = Some(steady);
        assert!(steady_words(&settling).starts_with("drift +4.00 mV/s"));
    }
}
