//! Thinning for drawing: of all points that share a column of pixels the lowest and the highest
//! stay, so no peak is lost. What is saved, fitted or exported is never thinned.

use std::collections::HashSet;

/// At most `2 * columns` of `points`, which come in order of x; points that are not finite are
/// left out.
#[must_use]
pub fn thin(points: impl Iterator<Item = [f64; 2]> + Clone, columns: usize) -> Vec<[f64; 2]> {
    let finite = points.filter(|point| point.iter().all(|number| number.is_finite()));
    let count = finite.clone().count();
    let ends = finite.clone().fold(None, |ends, [x, _]| {
        let (low, high) = ends.unwrap_or((x, x));
        Some((low.min(x), high.max(x)))
    });
    let Some((low, high)) = ends.filter(|_| count > 2 * columns && columns > 0) else {
        return finite.collect();
    };
    let width = ((high - low) / columns as f64).max(f64::MIN_POSITIVE);
    let mut thinned = Vec::with_capacity(2 * columns);
    let mut open: Option<Column> = None;
    for (order, point) in finite.enumerate() {
        let index = (((point[0] - low) / width) as usize).min(columns - 1);
        match &mut open {
            Some(column) if column.index == index => column.take(order, point),
            _ => {
                let next = Column {
                    index,
                    least: (order, point),
                    most: (order, point),
                };
                if let Some(column) = open.replace(next) {
                    column.close(&mut thinned);
                }
            }
        }
    }
    if let Some(column) = open {
        column.close(&mut thinned);
    }
    thinned
}

/// Half a pixel: nobody sees less.
const CELL: f64 = 0.5;

/// Lines that look like the one through all of these points of a picture, in px, which may come in any order: a step
/// from one half pixel to another is drawn once, however often it is made. Points that are not finite break the line.
#[must_use]
pub fn steps(points: impl Iterator<Item = [f64; 2]>) -> Vec<Vec<[f64; 2]>> {
    let cell = |point: [f64; 2]| point.map(|number| (number / CELL).round() as i64);
    let mut drawn = HashSet::new();
    let mut lines: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut line: Vec<[f64; 2]> = Vec::new();
    let mut last: Option<([i64; 2], [f64; 2])> = None;
    let mut end = |line: &mut Vec<[f64; 2]>| {
        if line.len() > 1 {
            lines.push(std::mem::take(line));
        }
        line.clear();
    };
    for point in points {
        if !point.iter().all(|number| number.is_finite()) {
            end(&mut line);
            last = None;
            continue;
        }
        let here = cell(point);
        let Some((before, from)) = last else {
            last = Some((here, point));
            continue;
        };
        if here == before {
            continue;
        }
        if drawn.insert((before, here)) {
            if line.is_empty() {
                line.push(from);
            }
            line.push(point);
        } else {
            end(&mut line);
        }
        last = Some((here, point));
    }
    end(&mut line);
    lines
}

/// The lowest and the highest point of a column, each with its place in the order of points.
struct Column {
    index: usize,
    least: (usize, [f64; 2]),
    most: (usize, [f64; 2]),
}

impl Column {
    fn take(&mut self, order: usize, point: [f64; 2]) {
        if point[1] < self.least.1[1] {
            self.least = (order, point);
        }
        if point[1] > self.most.1[1] {
            self.most = (order, point);
        }
    }

    /// Gives both points in the order in which they came, once if they are the same.
    fn close(self, thinned: &mut Vec<[f64; 2]>) {
        let mut pair = [self.least, self.most];
        pair.sort_by_key(|(order, _)| *order);
        thinned.push(pair[0].1);
        if pair[0].0 != pair[1].0 {
            thinned.push(pair[1].1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_points_stay_as_they_are() {
        let points = [[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0]];
        let thinned = thin(points.into_iter(), 100);
        assert_eq!(thinned, [[0.0, 1.0], [2.0, 3.0]]);
        assert!(thin(std::iter::empty(), 10).is_empty());
        // All at one time: nothing to divide by.
        let heap = (0..100).map(|i| [5.0, f64::from(i)]);
        assert_eq!(thin(heap, 10), [[5.0, 0.0], [5.0, 99.0]]);
    }

    #[test]
    fn a_loop_gone_round_many_times_is_drawn_once() {
        let round = |i: u32| {
            let angle = f64::from(i) * std::f64::consts::TAU / 1000.0;
            [100.0 + 50.0 * angle.cos(), 100.0 + 50.0 * angle.sin()]
        };
        let once = steps((0..=1000).map(round));
        let often = steps((0..=50_000).map(round));
        let count = |lines: &[Vec<[f64; 2]>]| lines.iter().map(Vec::len).sum::<usize>();
        // The circle is 314 px long, and a new cell begins every half pixel or later.
        assert!(
            count(&once) <= 1001 && count(&once) > 300,
            "{}",
            count(&once)
        );
        assert!(count(&often) <= count(&once) + 2, "{}", count(&often));
        // No point is further from what is drawn than a cell.
        for point in (0..1000).map(round) {
            let is_near =
                |other: &[f64; 2]| (point[0] - other[0]).hypot(point[1] - other[1]) <= 2.0 * CELL;
            assert!(once.iter().flatten().any(is_near), "{point:?}");
        }
        let broken = [
            [0.0, 0.0],
            [9.0, 0.0],
            [f64::NAN, 0.0],
            [0.0, 9.0],
            [9.0, 9.0],
        ];
        assert_eq!(steps(broken.into_iter()).len(), 2);
    }

    #[test]
    fn every_peak_survives() {
        let wave = |i: i32| [f64::from(i), f64::from(i % 7)];
        let spiked = (0..100_000).map(|i| {
            if i == 54_321 {
                [f64::from(i), 40.0]
            } else {
                wave(i)
            }
        });
        let thinned = thin(spiked, 500);
        assert!(thinned.len() <= 1000, "{}", thinned.len());
        assert!(thinned.contains(&[54_321.0, 40.0]));
        assert!(thinned.windows(2).all(|pair| pair[0][0] < pair[1][0]));
        let lows = thinned.iter().filter(|point| point[1] < 0.5).count();
        assert!(lows >= 499, "{lows}");
    }
}
