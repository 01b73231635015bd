//! The energy that a probe puts into tissue.

use crate::units::{Depth, Newtons};

/// Energy in N*mm along a path, by the trapezoidal rule: over a loop from the surface and back to it what
/// the tissue has not given back, the area of the hysteresis.
#[must_use]
pub fn work(path: impl IntoIterator<Item = (Depth, Newtons)>) -> f64 {
    let mut path = path.into_iter();
    let Some(mut before) = path.next() else {
        return 0.0;
    };
    let mut sum = 0.0;
    for after in path {
        sum += 0.5 * (before.1.0 + after.1.0) * (after.0.0 - before.0.0);
        before = after;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_gives_back_what_it_took_and_a_loop_keeps_its_area() {
        let at = |x: f64, force: f64| (Depth(x), Newtons(force));
        let inward = (0..=100).map(|i| at(0.1 * f64::from(i), 0.05 * f64::from(i)));
        // 0.5 N/mm to 10 mm.
        assert!((work(inward.clone()) - 25.0).abs() < 1e-12);
        assert!(work(inward.clone().chain(inward.rev())).abs() < 1e-12);
        let triangle = [at(0.0, 0.0), at(10.0, 5.0), at(10.0, 3.0), at(0.0, 0.0)];
        assert!((work(triangle) - 10.0).abs() < 1e-12);
        assert_eq!(work([]), 0.0);
    }
}
