//! Interpolation between the sines of a sweep.

/// Nodes of a cubic.
const NODES: usize = 4;

/// Polynomial through the nodes about a place, as weights of their values.
pub(super) struct Stencil {
    first: usize,
    weights: Vec<f64>,
    /// Less those of a polynomial of one node less.
    order_change: Vec<f64>,
}

impl Stencil {
    /// About a place among two or more increasing ones.
    pub fn at(places: &[f64], place: f64) -> Self {
        let count = NODES.min(places.len());
        let after = places.partition_point(|one| *one < place);
        let first = after.saturating_sub(count / 2).min(places.len() - count);
        let nodes = &places[first..first + count];
        let weights = lagrange(nodes, place);
        // The node that is farthest away is left out.
        let is_last_far = nodes[count - 1] - place > place - nodes[0];
        let kept = if is_last_far { 0..count - 1 } else { 1..count };
        let mut order_change = weights.clone();
        let fewer = lagrange(&nodes[kept.clone()], place);
        order_change[kept].iter_mut().zip(fewer).for_each(|(weight, less)| *weight -= less);
        Self { first, weights, order_change }
    }

    pub fn value(&self, of: impl Fn(usize) -> f64) -> f64 {
        self.sum(&self.weights, of)
    }

    /// What the highest order adds: more than what is left out behind it, where values are smooth.
    pub fn error(&self, of: impl Fn(usize) -> f64) -> f64 {
        self.sum(&self.order_change, of)
    }

    fn sum(&self, weights: &[f64], of: impl Fn(usize) -> f64) -> f64 {
        weights.iter().enumerate().map(|(node, weight)| weight * of(self.first + node)).sum()
    }
}

fn lagrange(nodes: &[f64], place: f64) -> Vec<f64> {
    let weight = |own: usize| {
        let others = (0..nodes.len()).filter(|other| *other != own);
        others.map(|other| (place - nodes[other]) / (nodes[own] - nodes[other])).product()
    };
    (0..nodes.len()).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_is_exact_and_a_smooth_curve_is_off_by_less_than_the_stated_error() {
        let places = [0.0, 0.35, 0.8, 1.15, 1.5];
        let cubic = |x: f64| 1.0 - 2.0 * x + 0.5 * x * x - 0.3 * x * x * x;
        for step in 0..31 {
            let place = 0.05 * f64::from(step);
            let stencil = Stencil::at(&places, place);
            assert!((stencil.value(|node| cubic(places[node])) - cubic(place)).abs() < 1e-12);
            let off = stencil.value(|node| places[node].sin()) - place.sin();
            let stated = stencil.error(|node| places[node].sin());
            assert!(off.abs() < stated.abs().max(1e-3), "{place}: {off} {stated}");
        }
    }
}
