//! Which of several points nothing beats in both directions.

/// Whether one `(error, cost)` is at least as good as another in both and better in one.
pub(super) fn beats(one: (f64, f64), other: (f64, f64)) -> bool {
    one.0 <= other.0 && one.1 <= other.1 && one != other
}

/// For points of `(error, cost)`, whether no other is both at least as exact and at least as cheap.
/// A point without an error is never on the front.
#[must_use]
pub fn pareto(points: &[(Option<f64>, f64)]) -> Vec<bool> {
    let is_beaten = |error: f64, cost: f64| {
        points.iter().any(|&(other, other_cost)| {
            other.is_some_and(|other| beats((other, other_cost), (error, cost)))
        })
    };
    points
        .iter()
        .map(|&(error, cost)| error.is_some_and(|error| !is_beaten(error, cost)))
        .collect()
}
