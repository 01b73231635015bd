//! The path of the probe in as few straight pieces as stay within a tolerance, drawn as it grows.
//!
//! Identifiability is judged on this path: in 15-micrometre stairs, or with noise on the depth, a
//! single ramp looks as if it had many speeds.

/// Tolerance as a share of the depth the fit is scaled by.
const TOLERANCE_SHARE: f64 = 0.002;
/// Tolerance in mean steps between samples: stairs deviate by one, noise of the depth by up to
/// four standard deviations where its mean step is 1.13 of them.
const TOLERANCE_STEPS: f64 = 4.0;
/// Pieces kept. What the first ones identify, the later ones cannot undo.
const PIECES_MAX: usize = 256;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Path {
    /// Ends of the finished pieces as (s, scaled depth).
    corners: Vec<(f64, f64)>,
    /// Slopes from the last corner that stay within the tolerance of everything since.
    cone: (f64, f64),
    last: (f64, f64),
    step_sum: f64,
    steps: f64,
}

const OPEN: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

impl Path {
    /// Goes on to scaled depth `x` at `t` seconds, later than before.
    pub fn push(&mut self, t: f64, x: f64) {
        let Some(&corner) = self.corners.last() else {
            self.corners.push((t, x));
            self.cone = OPEN;
            self.last = (t, x);
            return;
        };
        if self.corners.len() > PIECES_MAX {
            return;
        }
        let step = (x - self.last.1).abs();
        if step > 0.0 {
            self.step_sum += step;
            self.steps += 1.0;
        }
        let tolerance = TOLERANCE_SHARE.max(TOLERANCE_STEPS * self.step_sum / self.steps.max(1.0));
        let cone_from = |(t0, x0): (f64, f64)| {
            let over_run = 1.0 / (t - t0);
            ((x - x0 - tolerance) * over_run, (x - x0 + tolerance) * over_run)
        };
        let here = cone_from(corner);
        let narrowed = (self.cone.0.max(here.0), self.cone.1.min(here.1));
        if narrowed.0 <= narrowed.1 {
            self.cone = narrowed;
        } else {
            let end = self.end(corner);
            self.corners.push(end);
            self.cone = cone_from(end);
        }
        self.last = (t, x);
    }

    /// All corners, with the newest point as the last.
    pub fn corners(&self) -> Vec<(f64, f64)> {
        let mut corners = self.corners.clone();
        if let Some(&corner) = corners.last().filter(|corner| self.last.0 > corner.0) {
            corners.push(self.end(corner));
        }
        corners
    }

    fn end(&self, (t, x): (f64, f64)) -> (f64, f64) {
        let slope = 0.5 * (self.cone.0 + self.cone.1);
        (self.last.0, x + slope * (self.last.0 - t))
    }
}

/// The path up to a time within it.
pub(super) fn until(mut corners: Vec<(f64, f64)>, end: f64) -> Vec<(f64, f64)> {
    while let [.., before, last] = corners[..]
        && last.0 > end
    {
        corners.pop();
        if before.0 < end {
            let share = (end - before.0) / (last.0 - before.0);
            corners.push((end, before.1 + share * (last.1 - before.1)));
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(depth: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let mut path = Path::default();
        for i in 0..=6000 {
            let t = f64::from(i) * 1e-2;
            path.push(t, depth(t));
        }
        path.corners()
    }

    #[test]
    fn stairs_become_a_ramp_and_corners_stay() {
        // 0.75 mm/s to 30 mm in steps of 15 micrometres, on a scale of 30 mm.
        let corners = drawn(|t| ((0.75 * t).min(30.0) / 0.015).floor() * 0.015 / 30.0);
        assert!((3..=5).contains(&corners.len()), "{corners:?}");
        assert!(corners.iter().any(|(t, _)| (t - 40.0).abs() < 0.5), "{corners:?}");
        let straight = drawn(|t| (0.75 * t / 0.015).floor() * 0.015 / 45.0);
        assert_eq!(straight.len(), 2, "{straight:?}");
    }

    #[test]
    fn a_path_ends_where_it_is_cut() {
        let corners = vec![(0.0, 0.0), (2.0, 1.0), (4.0, 1.0)];
        assert_eq!(until(corners.clone(), 1.0), [(0.0, 0.0), (1.0, 0.5)]);
        assert_eq!(until(corners.clone(), 2.0), [(0.0, 0.0), (2.0, 1.0)]);
        assert_eq!(until(corners.clone(), 4.0), corners);
    }

    #[test]
    fn endless_cycles_keep_their_first_pieces() {
        let corners = drawn(|t| 0.5 - 0.5 * (20.0 * t).cos());
        // The corners of so many pieces and the first point after them.
        assert_eq!(corners.len(), PIECES_MAX + 2);
        assert!(corners.iter().any(|(_, x)| *x > 0.98));
    }
}
