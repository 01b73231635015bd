//! A selection as a picture: error over cost, both by their logarithm, the tolerance and the front.

use super::selection::{digits, is_chosen};
use super::svg::{Anchor, FONT, Ink, Svg};
use crate::theme::tokens::LIGHT;
use palpate_model::select::{Candidate, Selection};

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 560.0;
/// Left, top, right and bottom edge of what is drawn; labels need the room on the right.
const PLACE: [f64; 4] = [80.0, 64.0, 740.0, 490.0];
/// Of a mark.
const SIZE: f64 = 5.0;

/// A logarithmic axis from px to px.
struct Axis {
    from: f64,
    to: f64,
    px: [f64; 2],
}

impl Axis {
    /// An axis on which all values are seen, with some room.
    fn around(values: impl Iterator<Item = f64>, px: [f64; 2]) -> Self {
        let (low, high) = values
            .filter(|value| *value > 0.0)
            .fold((f64::INFINITY, 0.0f64), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        let (low, high) = if high > 0.0 { (low, high) } else { (1.0, 1.0) };
        Self {
            from: low / 1.4,
            to: high * 1.4,
            px,
        }
    }

    fn at(&self, value: f64) -> f64 {
        let share = (value.max(self.from) / self.from).ln() / (self.to / self.from).ln();
        self.px[0] + share * (self.px[1] - self.px[0])
    }

    /// 1, 2 and 5 of every decade.
    fn marks(&self) -> Vec<f64> {
        let decades = self.from.log10().floor() as i32..=self.to.log10().ceil() as i32;
        decades
            .flat_map(|decade| [1.0, 2.0, 5.0].map(|step| step * 10f64.powi(decade)))
            .filter(|mark| (self.from..=self.to).contains(mark))
            .collect()
    }
}

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
    let mut points: Vec<(&Candidate, [f64; 2])> = selection
        .candidates
        .iter()
        .filter_map(|one| Some((one, [one.cost.operations as f64, 1e3 * error(one)?])))
        .collect();
    points.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]).then(a.1[1].total_cmp(&b.1[1])));
    let [left, top, right, bottom] = PLACE;
    let tolerance = selection.tolerance_n.map(|newtons| 1e3 * newtons);
    let x = Axis::around(points.iter().map(|point| point.1[0]), [left, right]);
    let y = Axis::around(
        points.iter().map(|point| point.1[1]).chain(tolerance),
        [bottom, top],
    );
    let mut svg = Svg::new(WIDTH);
    let ink = Ink::plain(LIGHT.text);
    let title = selection.verdict.sentences.first();
    title_lines(&mut svg, title.map_or("", String::as_str));
    axes(&mut svg, &x, &y, selection.is_predicted);
    if let Some(tolerance) = tolerance {
        let at = y.at(tolerance);
        svg.line(&[[left, at], [right, at]], LIGHT.limit, 1.6);
        svg.text([left + 6.0, at - 5.0], Ink::plain(LIGHT.limit), "tolerance");
    }
    // Nothing costs less and errs less than what is on the front.
    let mut front: Vec<[f64; 2]> = Vec::new();
    for (_, [cost, error]) in &points {
        let lowest = front.last().map_or(f64::INFINITY, |last| last[1]);
        if *error < lowest {
            if front.last().is_some() {
                front.push([*cost, lowest]);
            }
            front.push([*cost, *error]);
        }
    }
    let placed: Vec<[f64; 2]> = front.iter().map(|[a, b]| [x.at(*a), y.at(*b)]).collect();
    svg.line(&placed, LIGHT.text_quiet, 1.0);
    let mut labels: Vec<[f64; 2]> = Vec::new();
    for (one, [cost, error]) in &points {
        let [px, py] = [x.at(*cost), y.at(*error)];
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
        // Labels that would cover another go below it.
        let mut at = [px + 12.0, py + 0.35 * FONT];
        while labels
            .iter()
            .any(|label| (label[0] - at[0]).abs() < 84.0 && (label[1] - at[1]).abs() < FONT)
        {
            at[1] += FONT;
        }
        labels.push(at);
        svg.text(at, ink, &one.family);
    }
    svg.finish(
        HEIGHT,
        LIGHT.canvas,
        "Error of model families over their cost",
    )
}

/// The verdict over the picture, in at most two lines.
fn title_lines(svg: &mut Svg, sentence: &str) {
    const LETTERS: usize = 118;
    let mut lines = vec![String::new()];
    for word in sentence.split(' ') {
        let is_full = lines
            .last()
            .is_some_and(|line| line.chars().count() + word.chars().count() > LETTERS);
        if is_full {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            line.push_str(word);
            line.push(' ');
        }
    }
    for (index, line) in lines.iter().take(2).enumerate() {
        let at = [20.0, 24.0 + 18.0 * index as f64];
        svg.text(at, Ink::plain(LIGHT.text), line.trim_end());
    }
}

fn axes(svg: &mut Svg, x: &Axis, y: &Axis, is_predicted: bool) {
    let [left, top, right, bottom] = PLACE;
    let ink = Ink::plain(LIGHT.text);
    for mark in x.marks() {
        let at = x.at(mark);
        svg.line(&[[at, top], [at, bottom]], LIGHT.line, 0.6);
        svg.text(
            [at, bottom + FONT + 4.0],
            ink.anchored(Anchor::Middle),
            &format!("{mark}"),
        );
    }
    for mark in y.marks() {
        let at = y.at(mark);
        svg.line(&[[left, at], [right, at]], LIGHT.line, 0.6);
        svg.text(
            [left - 6.0, at + 0.35 * FONT],
            ink.anchored(Anchor::End),
            &short(mark),
        );
    }
    svg.line(
        &[[left, top], [left, bottom], [right, bottom]],
        LIGHT.text,
        1.0,
    );
    let middle = ink.anchored(Anchor::Middle);
    let below = [0.5 * (left + right), bottom + 2.0 * FONT + 10.0];
    svg.text(below, middle, "operations an evaluation");
    let name = if is_predicted {
        "error of prediction, rms (mN)"
    } else {
        "error of the fit, rms (mN)"
    };
    svg.upright_text([left - 52.0, 0.5 * (top + bottom)], middle, name);
}

/// A round number without zeros at its end.
fn short(mark: f64) -> String {
    let text = digits(mark);
    match text.split_once('.') {
        Some(_) => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_lie_evenly_and_marks_inside() {
        let axis = Axis::around([1.0, 100.0].into_iter(), [0.0, 100.0]);
        let step = axis.at(10.0) - axis.at(1.0);
        assert!((axis.at(100.0) - axis.at(10.0) - step).abs() < 1e-9);
        assert_eq!(axis.marks(), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        // Nothing to draw is no reason to fail.
        let empty = Axis::around(std::iter::empty(), [0.0, 1.0]);
        assert!(empty.at(0.0).is_finite());
        assert_eq!([0.5, 10.0, 200.0].map(short), ["0.5", "10", "200"]);
    }
}
