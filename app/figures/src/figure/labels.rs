//! Positions of names next to points, so that none covers another.

use crate::drawing::FONT;

/// Height of a line of names at the right, in px.
const LINE: f64 = FONT + 2.0;
/// Width of a name next to a point, and half the width of the point, in px.
const LABEL: f64 = 78.0;
const SIZE: f64 = 5.0;

/// Heights for names at the right edge, as near to the ends of their lines as leaves all of them readable.
pub(super) fn spread_heights(target: &[f64], [top, bottom]: [f64; 2]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..target.len()).collect();
    order.sort_by(|a, b| target[*a].total_cmp(&target[*b]));
    let mut places = vec![0.0; target.len()];
    let mut free = top;
    for &index in &order {
        places[index] = target[index].max(free);
        free = places[index] + LINE;
    }
    let mut free = bottom;
    for &index in order.iter().rev() {
        places[index] = places[index].min(free);
        free = places[index] - LINE;
    }
    places
}

/// Position of a point's name: next to it, or else as little above or below as leaves other points and names uncovered.
pub(super) fn label_position(
    [x, y]: [f64; 2],
    [top, bottom]: [f64; 2],
    points: &[[f64; 2]],
    labels: &[[f64; 2]],
) -> [f64; 2] {
    let is_free = |at: &[f64; 2]| {
        let covers = |mark: &[f64; 2], left: f64, right: f64| {
            (left..right).contains(&(mark[0] - at[0])) && (mark[1] - at[1]).abs() < FONT
        };
        (top..bottom).contains(&at[1])
            && !labels.iter().any(|label| covers(label, -LABEL, LABEL))
            && !points.iter().any(|point| covers(&[point[0], point[1] + 0.35 * FONT], -SIZE, LABEL))
    };
    let candidate = |lines: f64| [x + 12.0, y + 0.35 * FONT + lines * FONT];
    // Each line farther is tried above and below; a dozen points never need more.
    let lines = (0..24).map(|i| f64::from(i / 2 + i % 2) * if i % 2 == 0 { 1.0 } else { -1.0 });
    lines.map(candidate).find(is_free).unwrap_or(candidate(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_at_one_height_are_spread_heights_and_stay_within() {
        let places = spread_heights(&[95.0, 95.0, 10.0, 95.0], [0.0, 100.0]);
        assert_eq!(places[2], 10.0);
        let mut close = [places[0], places[1], places[3]];
        close.sort_by(f64::total_cmp);
        assert!(close[2] <= 100.0, "{places:?}");
        for pair in close.windows(2) {
            assert!(pair[1] - pair[0] >= LINE - 1e-9, "{places:?}");
        }
    }

    #[test]
    fn names_keep_clear_of_each_other_and_of_other_points() {
        let mut labels: Vec<[f64; 2]> = Vec::new();
        let marks = [[400.0, 200.0], [400.0, 202.0], [400.0, 204.0]];
        for mark in marks {
            labels.push(label_position(mark, [64.0, 490.0], &marks, &labels));
        }
        for (index, one) in labels.iter().enumerate() {
            for other in &labels[index + 1..] {
                assert!((one[1] - other[1]).abs() >= FONT, "{labels:?}");
            }
        }
        let other = [[420.0, 300.0], [430.0, 300.0]];
        let [_, y] = label_position(other[0], [64.0, 490.0], &other, &[]);
        // To rounding: it is moved by just so much.
        assert!((y - 300.0 - 0.35 * FONT).abs() >= FONT - 1e-9, "{y}");
    }
}
