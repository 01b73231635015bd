//! A rectangle of a picture with a range of numbers each way, and the marks of its axes.

use crate::drawing::{Anchor, FONT, Svg, TextStyle};
use crate::figure::AxisScale;
use crate::uncertain::shortest;
use ecolor::Color32;

/// Room for a number on an axis, in px.
const HEIGHT_OF_MARK: f64 = 45.0;
const WIDTH_OF_DECADE: f64 = 60.0;
/// Numbers along an axis, at most.
const MARKS_MAX: f64 = 10.0;

/// A rectangle of the picture with a range of numbers each way.
pub struct PlotPanel {
    /// Left, top, right and bottom in px.
    pub place: [f64; 4],
    /// Lowest and highest x and y drawn.
    pub x: [f64; 2],
    pub y: [f64; 2],
}

impl PlotPanel {
    /// A panel for a range of x in which all of these points are seen.
    pub fn around(place: [f64; 4], x: [f64; 2], series: &[&[[f64; 2]]]) -> Self {
        const MARGIN: f64 = 0.05;
        let values = series.iter().flat_map(|points| points.iter().map(|point| point[1]));
        let y = match range(values) {
            None => [0.0, 1.0],
            Some([low, high]) => {
                // A flat line still needs some height to be drawn in, and one that its numbers can show.
                let height = match high - low {
                    spread if spread > (1e-6 * high.abs()).max(1e-12) => spread,
                    _ if high.abs() > 1e-12 => 0.1 * high.abs(),
                    _ => 1.0,
                };
                [low - MARGIN * height, high + MARGIN * height]
            }
        };
        Self { place, x, y }
    }

    /// A panel for decimal logarithms in which all of these points are seen.
    pub fn around_logarithms(place: [f64; 4], points: &[[f64; 2]]) -> Self {
        // A little room for dots at the edge.
        let axis = |axis: usize| {
            let ends = range(points.iter().map(|point| point[axis]));
            ends.map_or([0.0, 1.0], |[low, high]| [low - 0.25, high + 0.25])
        };
        Self { place, x: axis(0), y: axis(1) }
    }

    /// Position of a point in the picture, in px.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [left, top, right, bottom] = self.place;
        let share = |value: f64, [low, high]: [f64; 2]| (value - low) / (high - low);
        [left + share(x, self.x) * (right - left), bottom - share(y, self.y) * (bottom - top)]
    }

    /// Everything between two x, from top to bottom.
    pub fn shade(&self, svg: &mut Svg, [from, to]: [f64; 2], color: Color32) {
        let [_, top, _, bottom] = self.place;
        let [left, right] = [from, to].map(|x| self.at([x, 0.0])[0]);
        svg.rectangle([left, top], [right, bottom], color);
    }

    /// Grid, numbers and name of the time alone.
    pub fn time_axis(&self, svg: &mut Svg, name: &str, look: AxisColours) {
        self.frame(svg, [name, ""], look, &[marks(self.x, MARKS_MAX), Vec::new()]);
    }

    /// Grid, numbers and names of axes of these scales; of a logarithmic one the places are decimal logarithms.
    pub fn scaled_axes(
        &self,
        svg: &mut Svg,
        names: [&str; 2],
        scales: [AxisScale; 2],
        look: AxisColours,
    ) {
        let [left, top, right, bottom] = self.place;
        let room = [(right - left) / WIDTH_OF_DECADE, (bottom - top) / HEIGHT_OF_MARK];
        let marked = |range: [f64; 2], scale: AxisScale, room: f64, most: f64| match scale {
            AxisScale::Logarithmic => decades(range, room),
            AxisScale::Linear => marks(range, most),
            AxisScale::Rows => Vec::new(),
        };
        let x_marks = marked(self.x, scales[0], room[0], MARKS_MAX.min(room[0]));
        let y_marks = marked(self.y, scales[1], room[1], room[1]);
        self.frame(svg, names, look, &[x_marks, y_marks]);
    }

    fn frame(
        &self,
        svg: &mut Svg,
        [x_name, y_name]: [&str; 2],
        look: AxisColours,
        [x_marks, y_marks]: &[Vec<(f64, String)>; 2],
    ) {
        let [left, top, right, bottom] = self.place;
        let ink = TextStyle::plain(look.text);
        for (mark, text) in x_marks {
            let [x, _] = self.at([*mark, 0.0]);
            svg.line(&[[x, top], [x, bottom]], look.grid, 0.6);
            let below = [x, bottom + FONT + 4.0];
            svg.text(below, ink.anchored(Anchor::Middle), text);
        }
        for (mark, text) in y_marks {
            let [_, y] = self.at([0.0, *mark]);
            svg.line(&[[left, y], [right, y]], look.grid, 0.6);
            let at = [left - 6.0, y + 0.35 * FONT];
            svg.text(at, ink.anchored(Anchor::End), text);
        }
        svg.line(&[[left, top], [left, bottom], [right, bottom]], look.text, 1.0);
        let middle = ink.anchored(Anchor::Middle);
        let x_place = [0.5 * (left + right), bottom + 2.0 * FONT + 10.0];
        svg.text(x_place, middle, x_name);
        svg.upright_text([left - 52.0, 0.5 * (top + bottom)], middle, y_name);
    }
}

/// The lowest and the highest of some numbers; `None` without any.
pub(crate) fn range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    });
    (ends[0] <= ends[1]).then_some(ends)
}

/// The two inks of axes.
#[derive(Clone, Copy)]
pub struct AxisColours {
    pub text: Color32,
    pub grid: Color32,
}

/// Round numbers within a range, with the decimals their step needs.
fn marks([low, high]: [f64; 2], steps_max: f64) -> Vec<(f64, String)> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return Vec::new();
    }
    let step = round_up(span / steps_max.max(2.0));
    let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    // The step is at least a part of the span, so these are few.
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last)
        .map(|i| {
            let value = i as f64 * step;
            (value, format!("{value:.decimals$}"))
        })
        .collect()
}

/// The smallest of 1, 2 and 5 times a power of ten that is not below `least`.
pub fn round_up(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    // 1e-9 forgives the rounding of the logarithm.
    let round = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= least * (1.0 - 1e-9));
    round.unwrap_or(10.0) * power
}

/// Powers of ten within a range of decimal logarithms, every so many of them.
fn decades([low, high]: [f64; 2], count_max: f64) -> Vec<(f64, String)> {
    if !(low.is_finite() && high.is_finite() && low < high) {
        return Vec::new();
    }
    let (first, last) = (low.ceil() as i64, high.floor() as i64);
    if last - first < 1 {
        return between_decades(low, high);
    }
    let every = ((last - first + 1) as f64 / count_max.max(1.0)).ceil().max(1.0) as i64;
    (first..=last)
        .filter(|power| power.rem_euclid(every) == 0)
        .map(|power| {
            let text = match power {
                -2..=3 => format!("{}", 10f64.powi(power as i32)),
                _ => format!("1e{power}"),
            };
            (power as f64, text)
        })
        .collect()
}

/// 1, 2 and 5 times powers of ten within a range of decimal logarithms that holds hardly any power.
fn between_decades(low: f64, high: f64) -> Vec<(f64, String)> {
    let powers = low.floor() as i32..=high.ceil() as i32;
    powers
        .flat_map(|power| [1.0, 2.0, 5.0].map(|factor| factor * 10f64.powi(power)))
        .map(|value| (value.log10(), shortest(value)))
        .filter(|(place, _)| (low..=high).contains(place))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_inside() {
        let texts = |range| -> Vec<String> {
            marks(range, 5.0).into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(texts([-0.2, 9.7]), ["0", "2", "4", "6", "8"]);
        assert_eq!(texts([-0.012, 0.011]), ["-0.010", "-0.005", "0.000", "0.005", "0.010"]);
        assert!(texts([1.0, 1.0]).is_empty());
    }

    #[test]
    fn a_flat_line_has_numbers_that_can_be_read() {
        for value in [0.0, -0.0, 1e-14, 2.5, -1e6, 3e-4] {
            let panel = PlotPanel::around([0.0; 4], [0.0, 1.0], &[&[[0.0, value], [1.0, value]]]);
            let texts = marks(panel.y, 5.0);
            assert!(texts.len() >= 2, "{value}: {texts:?}");
            for (_, text) in texts {
                assert!(text.len() <= 9, "{value}: {text}");
            }
        }
    }

    #[test]
    fn decades_are_named() {
        let texts = |range, count| -> Vec<String> {
            decades(range, count).into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(texts([-2.2, 1.1], 9.0), ["0.01", "0.1", "1", "10"]);
        assert_eq!(texts([-8.5, 4.5], 5.0), ["1e-6", "1e-3", "1", "1000"]);
        assert!(texts([f64::INFINITY, 0.0], 5.0).is_empty());
        let panel = PlotPanel::around_logarithms([0.0, 0.0, 100.0, 100.0], &[]);
        assert_eq!((panel.x, panel.y), ([0.0, 1.0], [0.0, 1.0]));
    }

    #[test]
    fn points_lie_where_the_axes_say() {
        let panel =
            PlotPanel { place: [100.0, 10.0, 300.0, 110.0], x: [0.0, 10.0], y: [-1.0, 1.0] };
        assert_eq!(panel.at([5.0, 0.0]), [200.0, 60.0]);
        assert_eq!(panel.at([10.0, 1.0]), [300.0, 10.0]);
        let nothing = PlotPanel::around(panel.place, [0.0, 1.0], &[&[]]);
        assert_eq!(nothing.y, [0.0, 1.0]);
        let flat = PlotPanel::around(panel.place, [0.0, 1.0], &[&[[0.0, 3.0], [1.0, 3.0]]]);
        assert!(flat.at([0.5, 3.0]).iter().all(|number| number.is_finite()));
    }
}
