//! Between the relaxation times of the bank: polynomials in log tau through neighbouring nodes.
//!
//! Everything a node knows is smooth in log tau, so a polynomial through nodes on both sides, used
//! in the middle, is far more exact than the nodes are close (Trefethen, "Approximation Theory and
//! Approximation Practice", chapter 13, says why only there). The least residual is found as the
//! zero of its derivative: comparing values would lose half the digits.

/// Nodes a polynomial passes through at most.
pub(super) const STENCIL_MAX: usize = 16;
/// Fewer than this have no usable third derivative; there is no answer yet.
const STENCIL_MIN: usize = 5;

/// A run of neighbouring nodes, evenly placed around the best one as far as nodes go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stencil {
    pub first: usize,
    pub count: usize,
}

/// Weights of the values at the nodes of a stencil that give value, slope and curvature
/// of their polynomial at one place; per node spacing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jet {
    weights: [[f64; STENCIL_MAX]; 3],
}

impl Jet {
    fn sum(&self, order: usize, of: impl Fn(usize) -> f64, count: usize) -> f64 {
        let weights = &self.weights[order][..count];
        weights.iter().enumerate().map(|(i, w)| w * of(i)).sum()
    }
}

impl Stencil {
    /// Around node `best`, within the nodes `low..=high` that have a solution.
    pub fn around(best: usize, (low, high): (usize, usize)) -> Option<Self> {
        // At an end of the solvable nodes the polynomial would be used where it is worst, so it
        // leans by a node at most.
        let reach = (best - low).min(high - best) + 1;
        let first = best.saturating_sub(reach.min(STENCIL_MAX / 2 - 1)).max(low);
        let last = (best + reach.min(STENCIL_MAX / 2)).min(high);
        let count = last - first + 1;
        (count >= STENCIL_MIN && first < best && best < last).then_some(Self { first, count })
    }

    /// Lagrange's polynomials with their derivatives, at `place` counted in nodes of the bank.
    pub fn jet(&self, place: f64) -> Jet {
        let x = place - self.first as f64;
        let mut weights = [[0.0; STENCIL_MAX]; 3];
        let [values, slopes, curvatures] = &mut weights;
        let orders = values.iter_mut().zip(slopes).zip(curvatures);
        for (i, ((first, second), third)) in orders.enumerate().take(self.count) {
            let (mut value, mut slope, mut curvature) = (1.0, 0.0, 0.0);
            for j in (0..self.count).filter(|&j| j != i) {
                let share = 1.0 / (i as f64 - j as f64);
                let factor = (x - j as f64) * share;
                curvature = curvature * factor + 2.0 * slope * share;
                slope = slope * factor + value * share;
                value *= factor;
            }
            (*first, *second, *third) = (value, slope, curvature);
        }
        Jet { weights }
    }

    /// Value of the polynomial through `of(node)`.
    pub fn value(&self, jet: &Jet, of: impl Fn(usize) -> f64) -> f64 {
        jet.sum(0, |i| of(self.first + i), self.count)
    }

    /// Slope of the polynomial through `of(node)`.
    pub fn slope(&self, jet: &Jet, of: impl Fn(usize) -> f64) -> f64 {
        jet.sum(1, |i| of(self.first + i), self.count)
    }

    /// Curvature of the polynomial through `of(node)`.
    pub fn curvature(&self, jet: &Jet, of: impl Fn(usize) -> f64) -> f64 {
        jet.sum(2, |i| of(self.first + i), self.count)
    }

    /// Where `of` is least near node `best`, as a place counted in nodes: the zero of its slope, by
    /// Newton's steps kept inside a bracket that halves if they leave it.
    pub fn minimum(&self, best: usize, of: impl Fn(usize) -> f64 + Copy) -> Option<f64> {
        let slope_at = |place: f64| {
            let jet = self.jet(place);
            (self.slope(&jet, of), self.curvature(&jet, of))
        };
        let (mut low, mut high) = (best as f64 - 1.0, best as f64 + 1.0);
        if !(slope_at(low).0 < 0.0 && slope_at(high).0 > 0.0) {
            return None;
        }
        let mut place = best as f64;
        for _ in 0..60 {
            let (slope, curvature) = slope_at(place);
            if slope < 0.0 {
                low = place;
            } else {
                high = place;
            }
            let newton = place - slope / curvature;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let step = (next - place).abs();
            place = next;
            if step < 1e-13 * PLACES {
                break;
            }
        }
        (slope_at(place).1 > 0.0).then_some(place)
    }
}

/// Places are counted up to about this; their last digit ends the search.
const PLACES: f64 = super::bank::NODES as f64;
