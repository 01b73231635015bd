//! The monotone curve V(F) through the weight steps, and its inverse. Straight segments and polynomials
//! are pieces of the same kind.
//!
//! Cubic Hermite pieces with the slopes of Fritsch & Carlson, "Monotone piecewise cubic
//! interpolation", SIAM J. Numer. Anal. 17 (1980) 238-246, in the weighted harmonic form of
//! Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300-304: the curve passes through every
//! step, has a continuous slope and never turns back between steps.

use crate::linalg::Triangle;
use crate::units::{Newtons, Volts};

/// An end slope is never less than this share of its end secant, so that the straight lines
/// beyond the ends can be inverted.
const END_SLOPE_SHARE_MIN: f64 = 0.25;

/// Highest power of a polynomial curve.
pub const DEGREE_MAX: usize = 5;
/// Places at which a polynomial is looked at; its slope turns four times at most.
const SLOPE_PLACES: u32 = 2000;

/// One polynomial piece, in the local coordinate `s = (F - newtons) / width`, 0 at its left end:
/// `V = volts + s*(c[0] + s*(c[1] + s*(c[2] + ...)))`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    newtons: f64,
    width: f64,
    volts: f64,
    rise: f64,
    c: [f64; DEGREE_MAX],
}

impl Piece {
    /// From a cubic's three coefficients.
    fn cubic(newtons: f64, width: f64, volts: f64, rise: f64, [c1, c2, c3]: [f64; 3]) -> Self {
        Self { newtons, width, volts, rise, c: [c1, c2, c3, 0.0, 0.0] }
    }

    fn rise_at(&self, s: f64) -> f64 {
        self.c.iter().rev().fold(0.0, |sum, c| s * (c + sum))
    }

    fn slope_at(&self, s: f64) -> f64 {
        let [c1, c2, c3, c4, c5] = self.c;
        // A cubic rounds as it always did: recorded forces are computed again from it.
        c1 + s * (2.0 * c2 + s * 3.0 * c3 + s * s * (4.0 * c4 + s * 5.0 * c5))
    }

    /// The `s` in 0..1 at which the piece has risen by `rise`: Newton's method, kept inside a
    /// bracket that shrinks with every evaluation, so it ends whatever the shape.
    fn inverse(&self, rise: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        let mut s = (rise / self.rise).clamp(0.0, 1.0);
        for _ in 0..80 {
            let miss = self.rise_at(s) - rise;
            if miss == 0.0 {
                break;
            }
            if miss > 0.0 {
                high = s;
            } else {
                low = s;
            }
            let newton = s - miss / self.slope_at(s);
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let is_settled = (next - s).abs() <= f64::EPSILON * s;
            s = next;
            if is_settled {
                break;
            }
        }
        s
    }
}

/// Volts as a strictly increasing function of newtons, with its exact inverse.
///
/// Beyond the first and the last weight step the curve continues straight with its end slope;
/// [`CalibrationCurve::is_extrapolated`] says when a force lies there.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationCurve {
    pieces: Vec<Piece>,
    slope_first: f64,
    slope_last: f64,
    newtons_last: f64,
    volts_last: f64,
}

impl CalibrationCurve {
    /// The curve through points (N, V); the caller has checked that there are two or more, all
    /// finite and strictly increasing in both coordinates.
    pub(super) fn through(points: &[(f64, f64)]) -> Self {
        let secants: Vec<(f64, f64)> = points
            .windows(2)
            .map(|pair| {
                let width = pair[1].0 - pair[0].0;
                (width, (pair[1].1 - pair[0].1) / width)
            })
            .collect();
        let slopes = slopes(&secants);
        let pieces = secants
            .iter()
            .zip(points)
            .zip(slopes.windows(2))
            .map(|((&(width, secant), &(newtons, volts)), ends)| {
                let (left, right) = (ends[0] * width, ends[1] * width);
                let rise = secant * width;
                let second = 3.0 * rise - 2.0 * left - right;
                let third = left + right - 2.0 * rise;
                Piece::cubic(newtons, width, volts, rise, [left, second, third])
            })
            .collect();
        let ends = [slopes[0], slopes[slopes.len() - 1]];
        Self::of_pieces(pieces, ends, points[points.len() - 1])
    }

    /// Straight lines from point to point; the same conditions.
    pub(super) fn straight(points: &[(f64, f64)]) -> Self {
        let pieces: Vec<Piece> = points
            .windows(2)
            .map(|pair| {
                let (width, rise) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
                Piece::cubic(pair[0].0, width, pair[0].1, rise, [rise, 0.0, 0.0])
            })
            .collect();
        let slope = |piece: &Piece| piece.rise / piece.width;
        let ends = [slope(&pieces[0]), slope(&pieces[pieces.len() - 1])];
        Self::of_pieces(pieces, ends, points[points.len() - 1])
    }

    /// The polynomial nearest to the points by least squares; `None` where the points do not determine it
    /// or it does not rise everywhere between the first and the last. Points are in order of N.
    pub(super) fn polynomial(points: &[(f64, f64)], degree: usize) -> Option<Self> {
        const COLUMNS: usize = DEGREE_MAX + 2;
        let (first, last) = (points.first()?.0, points.last()?.0);
        let width = last - first;
        let mut triangle = Triangle::<COLUMNS>::default();
        for &(newtons, volts) in points {
            let s = (newtons - first) / width;
            let mut row = [0.0; COLUMNS];
            row[0] = 1.0;
            for k in 1..=DEGREE_MAX {
                row[k] = row[k - 1] * s;
            }
            row[COLUMNS - 1] = volts;
            triangle.push(row);
        }
        if points.len() <= degree || degree > DEGREE_MAX {
            return None;
        }
        let found = triangle.solve(degree + 1)?;
        let mut piece = Piece::cubic(first, width, found[0], 0.0, [0.0; 3]);
        piece.c[..degree].copy_from_slice(&found[1..=degree]);
        piece.rise = piece.rise_at(1.0);
        // A slope far below the mean one is a turn that rounding hides.
        let slope_min = 1e-6 * piece.rise;
        let mut places = (0..=SLOPE_PLACES).map(|i| f64::from(i) / f64::from(SLOPE_PLACES));
        let is_rising = places.all(|s| piece.slope_at(s) > slope_min) && piece.rise > 0.0;
        let ends = [0.0, 1.0].map(|s| piece.slope_at(s) / width);
        let end = (last, piece.volts + piece.rise);
        is_rising.then(|| Self::of_pieces(vec![piece], ends, end))
    }

    fn of_pieces(pieces: Vec<Piece>, ends: [f64; 2], last: (f64, f64)) -> Self {
        Self {
            pieces,
            slope_first: ends[0],
            slope_last: ends[1],
            newtons_last: last.0,
            volts_last: last.1,
        }
    }

    /// The signal in V at a force in N.
    pub fn volts_from_newtons(&self, force: Newtons) -> Volts {
        let first = &self.pieces[0];
        let newtons = force.0;
        Volts(if newtons <= first.newtons {
            first.volts + (newtons - first.newtons) * self.slope_first
        } else if newtons >= self.newtons_last {
            self.volts_last + (newtons - self.newtons_last) * self.slope_last
        } else {
            let piece = self.piece_at(newtons);
            piece.volts + piece.rise_at((newtons - piece.newtons) / piece.width)
        })
    }

    /// The force in N at a signal in V: the exact inverse of [`CalibrationCurve::volts_from_newtons`].
    pub fn newtons_from_volts(&self, signal: Volts) -> Newtons {
        let first = &self.pieces[0];
        let volts = signal.0;
        Newtons(if volts <= first.volts {
            first.newtons + (volts - first.volts) / self.slope_first
        } else if volts >= self.volts_last {
            self.newtons_last + (volts - self.volts_last) / self.slope_last
        } else {
            let after = self.pieces.partition_point(|piece| piece.volts <= volts);
            let piece = &self.pieces[after.max(1) - 1];
            piece.newtons + piece.width * piece.inverse(volts - piece.volts)
        })
    }

    /// The force in N above the unloaded cell, whose signal the tare found: the curve is moved along the
    /// signal so that it passes through zero there. Without a tare, above the calibration's own zero.
    pub fn newtons_above_tare(&self, signal: Volts, tare: Option<Volts>) -> Newtons {
        let zero = self.volts_from_newtons(Newtons(0.0));
        let shift = tare.map_or(0.0, |tare| tare.0 - zero.0);
        self.newtons_from_volts(Volts(signal.0 - shift))
    }

    /// The slope of the curve in V/N at a force; always positive.
    pub fn sensitivity_at(&self, force: Newtons) -> f64 {
        if force.0 <= self.pieces[0].newtons {
            self.slope_first
        } else if force.0 >= self.newtons_last {
            self.slope_last
        } else {
            let piece = self.piece_at(force.0);
            piece.slope_at((force.0 - piece.newtons) / piece.width) / piece.width
        }
    }

    /// The forces in N of the first and the last weight step.
    pub fn force_range(&self) -> (Newtons, Newtons) {
        (Newtons(self.pieces[0].newtons), Newtons(self.newtons_last))
    }

    /// Whether a force lies beyond the weight steps, where the curve is only a straight guess.
    pub fn is_extrapolated(&self, force: Newtons) -> bool {
        !(self.pieces[0].newtons..=self.newtons_last).contains(&force.0)
    }

    /// The standard deviation in N of a force at `at` read from a signal with standard deviation
    /// `noise` in V: noise over sensitivity, to first order.
    pub fn force_sigma(&self, at: Newtons, noise: Volts) -> Newtons {
        Newtons(noise.0 / self.sensitivity_at(at))
    }

    fn piece_at(&self, newtons: f64) -> &Piece {
        let after = self.pieces.partition_point(|piece| piece.newtons <= newtons);
        &self.pieces[after.max(1) - 1]
    }
}

/// Slopes at the points from (width, secant slope) of each interval, all secants positive.
fn slopes(secants: &[(f64, f64)]) -> Vec<f64> {
    let end = |(w0, s0): (f64, f64), (w1, s1): (f64, f64)| {
        // One-sided three-point formula; at most twice the end secant, so monotone.
        (((2.0 * w0 + w1) * s0 - w0 * s1) / (w0 + w1)).max(END_SLOPE_SHARE_MIN * s0)
    };
    let last = secants.len() - 1;
    if last == 0 {
        return vec![secants[0].1; 2];
    }
    let mut slopes = vec![end(secants[0], secants[1])];
    slopes.extend(secants.windows(2).map(|pair| {
        let ((w0, s0), (w1, s1)) = (pair[0], pair[1]);
        let (a, b) = (2.0 * w1 + w0, w1 + 2.0 * w0);
        (a + b) / (a / s0 + b / s1)
    }));
    slopes.push(end(secants[last], secants[last - 1]));
    slopes
}

#[cfg(test)]
mod tests {
    use super::super::Calibration;
    use super::*;

    fn thesis() -> CalibrationCurve {
        Calibration::thesis().curve().unwrap()
    }

    #[test]
    fn passes_through_all_eleven_points() {
        let curve = thesis();
        let steps = Calibration::thesis().steps;
        assert_eq!(steps.len(), 11);
        for step in steps {
            let volts = curve.volts_from_newtons(step.newtons()).0;
            assert!((volts - step.volts.0).abs() < 1e-14, "{step:?} {volts}");
            let newtons = curve.newtons_from_volts(step.volts).0;
            assert!((newtons - step.newtons().0).abs() < 1e-12, "{step:?} {newtons}");
        }
    }

    #[test]
    fn rises_everywhere_and_inverts_exactly() {
        let curve = thesis();
        let mut before = f64::NEG_INFINITY;
        for i in -20_000..=150_000 {
            let newtons = f64::from(i) * 1e-4;
            let volts = curve.volts_from_newtons(Newtons(newtons));
            assert!(volts.0 > before, "falls at {newtons} N");
            before = volts.0;
            let back = curve.newtons_from_volts(volts).0;
            assert!(
                (back - newtons).abs() <= 1e-12 * newtons.abs().max(0.1),
                "{newtons} came back as {back}"
            );
        }
    }

    #[test]
    fn sensitivity_is_the_derivative() {
        let curve = thesis();
        for i in -10..=130 {
            let newtons = 0.1003 * f64::from(i);
            let step = 1e-5;
            let numerical = (curve.volts_from_newtons(Newtons(newtons + step)).0
                - curve.volts_from_newtons(Newtons(newtons - step)).0)
                / (2.0 * step);
            let exact = curve.sensitivity_at(Newtons(newtons));
            assert!((numerical - exact).abs() < 1e-6, "{newtons}: {numerical} {exact}");
        }
    }

    #[test]
    fn flat_stretch_reads_an_order_of_magnitude_worse() {
        // One count of a 16-bit converter over +-10 V.
        let count = Volts(20.0 / 65536.0);
        let curve = thesis();
        for newtons in [3.4, 4.0, 4.8, 5.2] {
            let sigma = curve.force_sigma(Newtons(newtons), count).0;
            assert!((0.015..0.04).contains(&sigma), "{newtons} N: {sigma}");
        }
        for newtons in [0.5, 8.0, 9.5] {
            let sigma = curve.force_sigma(Newtons(newtons), count).0;
            assert!(sigma < 0.0025, "{newtons} N: {sigma}");
        }
    }

    #[test]
    fn ends_are_straight_and_marked() {
        let curve = thesis();
        let (low, high) = curve.force_range();
        assert_eq!(low, Newtons(0.0));
        assert!((high.0 - 10.198_916).abs() < 1e-9);
        assert!(curve.is_extrapolated(Newtons(10.2)) && curve.is_extrapolated(Newtons(-0.001)));
        assert!(!curve.is_extrapolated(low) && !curve.is_extrapolated(high));
        assert!(curve.is_extrapolated(Newtons(f64::NAN)));
        let slope = curve.sensitivity_at(Newtons(20.0));
        let span =
            curve.volts_from_newtons(Newtons(20.0)).0 - curve.volts_from_newtons(Newtons(15.0)).0;
        assert!((span - 5.0 * slope).abs() < 1e-12);
    }

    #[test]
    fn segments_are_straight_and_a_polynomial_finds_itself_or_is_refused() {
        let points = [(0.0, 1.0), (1.0, 1.5), (3.0, 1.6), (4.0, 3.0)];
        let curve = CalibrationCurve::straight(&points);
        assert!((curve.volts_from_newtons(Newtons(2.0)).0 - 1.55).abs() < 1e-15);
        assert!((curve.newtons_from_volts(Volts(2.3)).0 - 3.5).abs() < 1e-14);
        assert!((curve.sensitivity_at(Newtons(5.0)) - 1.4).abs() < 1e-15);
        let quintic = |f: f64| 1.0 + 0.3 * f + 0.02 * f * f + 1e-4 * f.powi(5);
        let points: Vec<(f64, f64)> =
            (0..9).map(|i| (f64::from(i), quintic(f64::from(i)))).collect();
        let curve = CalibrationCurve::polynomial(&points, 5).unwrap();
        for newtons in [0.0, 0.7, 3.3, 7.9] {
            let volts = curve.volts_from_newtons(Newtons(newtons));
            assert!((volts.0 - quintic(newtons)).abs() < 1e-12, "{newtons}");
            assert!((curve.newtons_from_volts(volts).0 - newtons).abs() < 1e-12);
        }
        // A hump between the ends, and fewer points than coefficients.
        let hump = [(0.0, 0.0), (1.0, 1.0), (2.0, 0.5), (3.0, 1.5)];
        assert_eq!(CalibrationCurve::polynomial(&hump, 3), None);
        assert_eq!(CalibrationCurve::polynomial(&hump, 4), None);
        assert!(CalibrationCurve::polynomial(&hump, 1).is_some());
    }

    #[test]
    fn a_kinked_end_still_inverts() {
        // A steep second interval would ask for a falling end slope.
        let curve = CalibrationCurve::through(&[(0.0, 0.0), (1.0, 0.01), (2.0, 5.0)]);
        let volts = curve.volts_from_newtons(Newtons(-2.0));
        assert!((curve.newtons_from_volts(volts).0 + 2.0).abs() < 1e-12);
    }
}
