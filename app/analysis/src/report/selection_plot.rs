//! A selection as a picture: error over cost, both by their logarithm, the tolerance and the front.

use super::picture::{look, wrap};
use super::selection::is_chosen;
use palpate_figures::drawing::{FONT, Ink, Panel, Svg};
use palpate_figures::tokens::LIGHT;
use palpate_rheology::select::{Candidate, Selection};
use palpate_rheology::trade::front;

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 560.0;
/// Left, top, right and bottom edge of what is drawn; labels need the room on the right.
const PLACE: [f64; 4] = [80.0, 64.0, 740.0, 490.0];
/// Letters in a line of the verdict, of which two are shown.
const LETTERS: usize = 118;
/// An error in mN below this is drawn here; no noise is so small.
const LEAST: f64 = 1e-12;
/// Width of a label.
const LABEL: f64 = 78.0;
/// Of a mark.
const SIZE: f64 = 5.0;

/// The picture of a selection.
#[must_use]
pub fn of_selection(selection: &Selection) -> String {
    let error = |one: &Candidate| {
        let predicted = one.prediction.as_ref().map(|known| known.rms_n);
        if selection.is_predicted {
            predicted
        } else {
            Some(one.rms_n)
        }
    };
    let points: Vec<(&Candidate, [f64; 2])> = selection
        .candidates
        .iter()
        .filter_map(|one| {
            let at = [one.cost.operations as f64, 1e3 * error(one)?];
            Some((one, at.map(|value| value.max(LEAST).log10())))
        })
        .collect();
    let places: Vec<[f64; 2]> = points.iter().map(|point| point.1).collect();
    let tolerance = selection.tolerance_n.map(|newtons| (1e3 * newtons).log10());
    let left = places
        .iter()
        .map(|place| place[0])
        .fold(f64::INFINITY, f64::min);
    let seen = tolerance
        .filter(|_| left.is_finite())
        .map(|level| [left, level]);
    let seen: Vec<[f64; 2]> = places.iter().copied().chain(seen).collect();
    let panel = Panel::around_logarithms(PLACE, &seen);
    let mut svg = Svg::new(WIDTH);
    let ink = Ink::plain(LIGHT.text);
    let title = selection
        .verdict
        .sentences
        .first()
        .map_or("", String::as_str);
    for (index, line) in wrap(title, LETTERS).iter().take(2).enumerate() {
        svg.text([20.0, 24.0 + 18.0 * index as f64], ink, line);
    }
    let name = if selection.is_predicted {
        "error of prediction, rms (mN)"
    } else {
        "error of the fit, rms (mN)"
    };
    panel.log_axes(&mut svg, ["operations an evaluation", name], look());
    if let Some(tolerance) = tolerance {
        let [left, _, right, _] = PLACE;
        let [_, at] = panel.at([0.0, tolerance]);
        svg.line(&[[left, at], [right, at]], LIGHT.limit, 1.6);
        svg.text([left + 6.0, at - 5.0], Ink::plain(LIGHT.limit), "tolerance");
    }
    let front: Vec<[f64; 2]> = front(&places)
        .into_iter()
        .map(|index| places[index])
        .collect();
    panel.line(&mut svg, &front, LIGHT.text_quiet, 1.0);
    let marks: Vec<[f64; 2]> = places.iter().map(|place| panel.at(*place)).collect();
    let mut labels: Vec<[f64; 2]> = Vec::new();
    for (one, place) in &points {
        let [px, py] = panel.at(*place);
        let chosen = is_chosen(selection, &one.family);
        let size = if chosen { 1.6 * SIZE } else { SIZE };
        let diamond = [
            [px - size, py],
            [px, py - size],
            [px + size, py],
            [px, py + size],
            [px - size, py],
        ];
        let color = if chosen { LIGHT.limit } else { LIGHT.series };
        svg.line(&diamond, color, if chosen { 3.0 } else { 2.0 });
        let at = free_place([px, py], &marks, &labels);
        labels.push(at);
        svg.text(at, ink, &one.family);
    }
    svg.finish(
        HEIGHT,
        LIGHT.canvas,
        "Error of model families over their cost",
    )
}

/// Where a mark's label stands: beside it, or else as little above or below as leaves other marks and labels
/// uncovered.
fn free_place([x, y]: [f64; 2], marks: &[[f64; 2]], labels: &[[f64; 2]]) -> [f64; 2] {
    let [_, top, _, bottom] = PLACE;
    let is_free = |at: &[f64; 2]| {
        let covers = |mark: &[f64; 2], left: f64, right: f64| {
            (left..right).contains(&(mark[0] - at[0])) && (mark[1] - at[1]).abs() < FONT
        };
        (top..bottom).contains(&at[1])
            && !labels.iter().any(|label| covers(label, -LABEL, LABEL))
            && !marks
                .iter()
                .any(|mark| covers(&[mark[0], mark[1] + 0.35 * FONT], -SIZE, LABEL))
    };
    let beside = |lines: f64| [x + 12.0, y + 0.35 * FONT + lines * FONT];
    // Each line farther is tried above and below; a dozen families never need more.
    let lines = (0..24).map(|i| f64::from(i / 2 + i % 2) * if i % 2 == 0 { 1.0 } else { -1.0 });
    lines.map(beside).find(is_free).unwrap_or(beside(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_cover_neither_marks_nor_each_other() {
        let bottom = PLACE[3] - 10.0;
        // Three marks in a row just over the axis, as of families that predict alike.
        let marks = [[300.0, bottom], [333.0, bottom], [360.0, bottom]];
        let mut labels: Vec<[f64; 2]> = Vec::new();
        for mark in marks {
            labels.push(free_place(mark, &marks, &labels));
        }
        for (i, one) in labels.iter().enumerate() {
            assert!(one[1] < PLACE[3], "{labels:?}");
            let is_apart = |other: &[f64; 2]| (one[1] - other[1]).abs() >= FONT - 1e-9;
            assert!(labels[..i].iter().all(is_apart), "{labels:?}");
        }
        // The last has nothing to its right and stands beside its mark.
        assert!((labels[2][1] - bottom).abs() < FONT, "{labels:?}");
    }
}
