//! Thinning for drawing: of all points that share a column of pixels the lowest and the highest
//! stay, so no peak is lost. What is saved, fitted or exported is never thinned.

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
                let next = Column { index, least: (order, point), most: (order, point) };
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
