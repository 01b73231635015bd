//! Depths at which a fitted body does what no passive tissue does.
//!
//! A fit describes a record; it need not describe a material. With `g(x) = mu1 x + mu2 x^2 + mu3
//! x^3` three things can go wrong, each in its own band of depth:
//!
//! * `g'(x) < 0`: softer the deeper, so that a probe held by force runs away;
//! * `tau_sig x < tau_eps g'(x)`: around such a depth the drive acts as a negative damper, since a
//!   small slow cycle of amplitude `a` and angular frequency `w` absorbs
//!   `pi w a^2 (tau_sig x - tau_eps g'(x)) + O(w^2)`, and there returns energy;
//! * `tau_sig X^2 / 2 < tau_eps g(X)`: a step from zero to `X` starts below where it settles, so it
//!   creeps instead of relaxing, and a slow poke to `X` and back, absorbing
//!   `2 v (tau_sig X^2 / 2 - tau_eps g(X)) + O(v^2)` at speed `v`, returns energy.

use super::ModifiedKelvin;

/// A band of depth in mm; the end is infinite where the band never ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InadmissibleBand {
    pub from: f64,
    pub to: f64,
}

/// Bands that end before this are of no consequence, in mm.
const SHALLOW_MM: f64 = 5e-4;

/// Depths at which the elastic force falls with depth.
#[must_use]
pub fn unstable_bands(body: &ModifiedKelvin) -> Vec<InadmissibleBand> {
    let [mu1, mu2, mu3] = body.mu;
    negative([mu1, 2.0 * mu2, 3.0 * mu3])
}

/// Depths around which a small slow cycle returns energy.
#[must_use]
pub fn active_cycles(body: &ModifiedKelvin) -> Vec<InadmissibleBand> {
    let ([mu1, mu2, mu3], tau) = (body.mu, body.tau_eps);
    negative([-tau * mu1, body.tau_sig - 2.0 * tau * mu2, -3.0 * tau * mu3])
}

/// Depths to which a step from the surface does not relax and a slow poke returns energy.
#[must_use]
pub fn active_pokes(body: &ModifiedKelvin) -> Vec<InadmissibleBand> {
    let ([mu1, mu2, mu3], tau) = (body.mu, body.tau_eps);
    negative([-tau * mu1, 0.5 * body.tau_sig - tau * mu2, -tau * mu3])
}

/// The bands as sentences, for a specimen indented to `deepest` mm.
#[must_use]
pub fn sentences(body: &ModifiedKelvin, deepest: f64) -> Vec<String> {
    let cases = [
        (
            unstable_bands(body),
            "at depths {bands} the elastic force of the model falls with depth, so the model is unstable there under force control",
        ),
        (
            active_cycles(body),
            "in a small slow cycle at depths {bands}, the model returns more energy than it receives",
        ),
        (
            active_pokes(body),
            "the model is not physical at depths {bands}: its force does not relax after a step from the surface, and it returns more energy than it receives in a slow press and retraction",
        ),
    ];
    cases
        .into_iter()
        .filter_map(|(bands, text)| {
            let inside: Vec<String> =
                bands.iter().filter_map(|band| words(band, deepest)).collect();
            (!inside.is_empty()).then(|| text.replace("{bands}", &inside.join(" and ")))
        })
        .collect()
}

fn words(band: &InadmissibleBand, deepest: f64) -> Option<String> {
    if band.from >= deepest || band.to < SHALLOW_MM {
        return None;
    }
    Some(match (band.from > 0.0, band.to < deepest) {
        (true, true) => format!("between {:.3} and {:.3} mm", band.from, band.to),
        (true, false) => format!("beyond {:.3} mm", band.from),
        (false, true) => format!("below {:.3} mm", band.to),
        (false, false) => format!("down to {deepest:.3} mm"),
    })
}

/// Where `c0 + c1 x + c2 x^2` is negative for `x > 0`.
fn negative([c0, c1, c2]: [f64; 3]) -> Vec<InadmissibleBand> {
    let mut ends = vec![0.0];
    ends.extend(roots([c0, c1, c2]).into_iter().filter(|&root| root > 0.0));
    ends.push(f64::INFINITY);
    let value = |x: f64| c0 + x * (c1 + x * c2);
    ends.windows(2)
        .filter(|pair| {
            let middle =
                if pair[1].is_finite() { 0.5 * (pair[0] + pair[1]) } else { 2.0 * pair[0] + 1.0 };
            value(middle) < 0.0
        })
        .map(|pair| InadmissibleBand { from: pair[0], to: pair[1] })
        .collect()
}

/// Real roots in rising order, without cancellation.
fn roots([c0, c1, c2]: [f64; 3]) -> Vec<f64> {
    if c2 == 0.0 {
        return if c1 == 0.0 { Vec::new() } else { vec![-c0 / c1] };
    }
    let discriminant = c1 * c1 - 4.0 * c2 * c0;
    if discriminant <= 0.0 {
        return Vec::new();
    }
    let q = -0.5 * (c1 + c1.signum() * discriminant.sqrt());
    let mut roots = vec![q / c2];
    if q != 0.0 {
        roots.push(c0 / q);
    }
    roots.sort_by(f64::total_cmp);
    roots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{Depth, Seconds};
    use crate::viscoelastic::KelvinState;

    const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;

    #[test]
    fn bands_of_the_thesis_body() {
        let close = |value: f64, wanted: f64, digits: f64| {
            assert!((value - wanted).abs() < digits, "{value} {wanted}");
        };
        let bands = unstable_bands(&THESIS);
        assert_eq!(bands.len(), 1);
        close(bands[0].from, 4.98, 0.005);
        close(bands[0].to, 8.21, 0.005);
        let bands = active_cycles(&THESIS);
        assert_eq!(bands.len(), 2);
        close(bands[0].to, 0.712, 5e-4);
        close(bands[1].from, 57.5, 0.05);
        let bands = active_pokes(&THESIS);
        close(bands[0].to, 1.430, 5e-4);
        let said = sentences(&THESIS, 30.0).join("; ");
        assert!(said.contains("between 4.98") && said.contains("below 0.71"), "{said}");
        assert!(!said.contains("57.5"), "deeper than recorded: {said}");
    }

    /// Work absorbed by a triangular poke to `depth` and back at `speed`, by the exact force.
    fn poke(depth: f64, speed: f64) -> f64 {
        let mut state = KelvinState::at_rest();
        let steps = 20_000;
        let dt = Seconds(depth / speed / f64::from(steps));
        let (mut work, mut force, mut x) = (0.0, 0.0, 0.0);
        for i in 1..=2 * steps {
            let to =
                depth * f64::from(if i <= steps { i } else { 2 * steps - i }) / f64::from(steps);
            let next = state.step(&THESIS, Depth(to), dt).0;
            work += 0.5 * (force + next) * (to - x);
            (force, x) = (next, to);
        }
        work
    }

    #[test]
    fn slow_pokes_return_energy_exactly_in_their_band() {
        let [band] = active_pokes(&THESIS)[..1] else {
            return;
        };
        // v tau << X, so that the first order in v decides.
        for (depth, returns) in [(0.7 * band.to, true), (1.5 * band.to, false)] {
            let work = poke(depth, 1e-3);
            assert_eq!(work < 0.0, returns, "{depth} mm absorbs {work} mJ");
        }
    }

    #[test]
    fn a_body_without_faults_says_nothing() {
        let body = ModifiedKelvin { tau_eps: 0.1, mu: [0.0, 0.01, 0.0], tau_sig: 0.06 };
        assert_eq!(sentences(&body, 30.0), Vec::<String>::new());
    }
}
