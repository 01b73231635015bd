//! Which of several points nothing beats in both directions.

/// Whether one `(error, cost)` is at least as good as another in both and better in one.
pub(super) fn beats(one: (f64, f64), other: (f64, f64)) -> bool {
    one.0 <= other.0 && one.1 <= other.1 && one != other
}

/// For points of `(error, cost)`, whether no other is both at least as exact and at least as cheap.
/// A point without an error is never on the front.
#[must_use]
pub fn mark_pareto_optimal(points: &[(Option<f64>, f64)]) -> Vec<bool> {
    let is_beaten = |error: f64, cost: f64| {
        points.iter().any(|&(other, other_cost)| {
            other.is_some_and(|other| beats((other, other_cost), (error, cost)))
        })
    };
    points.iter().map(|&(error, cost)| error.is_some_and(|error| !is_beaten(error, cost))).collect()
}

/// The front of points of `[cost, error]`: indices of those that nothing beats, the cheapest first.
#[must_use]
pub fn find_pareto_front(points: &[[f64; 2]]) -> Vec<usize> {
    let pairs: Vec<(Option<f64>, f64)> =
        points.iter().map(|&[cost, error]| (Some(error), cost)).collect();
    let on_front = mark_pareto_optimal(&pairs);
    let mut front: Vec<usize> = (0..points.len()).filter(|&index| on_front[index]).collect();
    front.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]));
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_begins_with_the_cheapest() {
        let points = [[4.0, 1.0], [1.0, 9.0], [2.0, 9.5], [3.0, 2.0], [4.0, 0.5]];
        assert_eq!(find_pareto_front(&points), [1, 3, 4]);
        assert!(find_pareto_front(&[]).is_empty());
    }
}
