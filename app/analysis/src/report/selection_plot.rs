//! A selection as a figure: error over cost, both by their logarithm, the tolerance and the front.

use super::picture::wrap;
use super::scatter::{ScatterPlot, ScatterPoint};
use super::selection::is_chosen;
use palpate_figures::drawing::{Svg, TextStyle};
use palpate_figures::figure::{AxisNames, Plot};
use palpate_figures::tokens::LIGHT;
use palpate_rheology::select::{ModelCandidate, ModelSelection};

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 560.0;
/// Left, top, right and bottom edge of what is drawn; labels need the room on the right.
const PLACE: [f64; 4] = [80.0, 64.0, 740.0, 490.0];
/// Letters in a line of the verdict, of which two are shown.
const LETTERS: usize = 118;

/// Every family over its cost.
#[must_use]
pub fn plot(selection: &ModelSelection) -> Plot {
    let error = |one: &ModelCandidate| match selection.is_predicted {
        true => one.prediction.as_ref().map(|known| known.rms_n),
        false => Some(one.rms_n),
    };
    let drawn: Vec<(&ModelCandidate, f64)> =
        selection.candidates.iter().filter_map(|one| Some((one, 1e3 * error(one)?))).collect();
    let marks: Vec<ScatterPoint> = drawn
        .iter()
        .map(|(one, error)| ScatterPoint {
            at: [one.cost.operations as f64, *error],
            label: [
                one.family.clone(),
                format!("{}\n{error:.3} mN\n{} operations", one.family, one.cost.operations),
            ],
        })
        .collect();
    let name = match selection.is_predicted {
        true => "error of prediction, rms (mN)",
        false => "error of the fit, rms (mN)",
    };
    let scatter = ScatterPlot {
        axes: ["operations per evaluation", name],
        marks: &marks,
        has_front: true,
        chosen: drawn.iter().position(|(one, _)| is_chosen(selection, &one.family)),
        level: selection.tolerance_n.map(|tolerance| 1e3 * tolerance),
    };
    let title = match selection.is_predicted {
        true => "Prediction error over cost",
        false => "Error of the fit over cost",
    };
    Plot { title: title.to_owned(), ..scatter.plot() }
}

/// The plot as SVG, under the verdict.
#[must_use]
pub fn of_selection(selection: &ModelSelection) -> String {
    let mut svg = Svg::new(WIDTH);
    let title = selection.verdict.sentences.first().map_or("", String::as_str);
    for (index, line) in wrap(title, LETTERS).iter().take(2).enumerate() {
        let at = [20.0, 24.0 + 18.0 * index as f64];
        svg.text(at, TextStyle::plain(LIGHT.text), line);
    }
    plot(selection).draw(&mut svg, PLACE, AxisNames::Both);
    svg.finish(HEIGHT, LIGHT.canvas, "Error of model families over their cost")
}
