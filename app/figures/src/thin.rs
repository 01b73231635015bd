//! Thinning for drawing: of all points that share a column of pixels the lowest and the highest
//! stay, so no peak is lost. What is saved, fitted or exported is never thinned.

use crate::panel::range;

/// At most `2 * columns` of `points`, which come in order of x; points that are not finite are
/// left out.
#[must_use]
pub fn thin(points: impl Iterator<Item = [f64; 2]> + Clone, columns: usize) -> Vec<[f64; 2]> {
    let finite = points.filter(|point| point.iter().all(|number| number.is_finite()));
    let count = finite.clone().count();
    let ends = range(finite.clone().map(|[x, _]| x));
    let Some([low, high]) = ends.filter(|_| count > 2 * columns && columns > 0) else {
        return finite.collect();
    };
    let width = ((high - low) / columns as f64).max(f64::MIN_POSITIVE);
    let mut thinned = Vec::with_capacity(2 * columns);
    let mut points = finite.enumerate().peekable();
    while let Some(first) = points.next() {
        let column = |point: [f64; 2]| (((point[0] - low) / width) as usize).min(columns - 1);
        let (mut least, mut most) = (first, first);
        while let Some(next) = points.next_if(|(_, point)| column(*point) == column(first.1)) {
            if next.1[1] < least.1[1] {
                least = next;
            }
            if next.1[1] > most.1[1] {
                most = next;
            }
        }
        // Both in the order in which they came, once if they are the same.
        thinned.push(if least.0 < most.0 { least.1 } else { most.1 });
        if least.0 != most.0 {
            thinned.push(if least.0 < most.0 { most.1 } else { least.1 });
        }
    }
    thinned
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
    fn every_peak_survives() {
        let wave = |i: i32| [f64::from(i), f64::from(i % 7)];
        let spiked = (0..100_000).map(|i| if i == 54_321 { [f64::from(i), 40.0] } else { wave(i) });
        let thinned = thin(spiked, 500);
        assert!(thinned.len() <= 1000, "{}", thinned.len());
        assert!(thinned.contains(&[54_321.0, 40.0]));
        assert!(thinned.windows(2).all(|pair| pair[0][0] < pair[1][0]));
        let lows = thinned.iter().filter(|point| point[1] < 0.5).count();
        assert!(lows >= 499, "{lows}");
    }
}
