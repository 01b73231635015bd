//! Forcing of the columns over a block of even steps.

use super::rows::{LANES, Lane};
use palpate_model::viscoelastic::PSI_COUNT;

/// Steps and forcing of 64 samples whose intervals are alike.
pub(super) struct Forcing {
    pub psi_0: Lane,
    /// Of the filtered powers and the viscous drive.
    pub weighted: [Lane; 4],
    /// The same by `r`, times `r`.
    pub sloped: [Lane; 4],
}

impl Forcing {
    /// Straight moves from `from` to `x` in about `nominal` s each, for psi and its slopes there.
    #[inline(always)]
    pub fn new<const SLOPES: bool>(
        from: &Lane,
        x: &Lane,
        dt: &Lane,
        (nominal, r, tau): (f64, f64, f64),
        psi: &[f64; PSI_COUNT],
        slope: &[f64; 4],
    ) -> Self {
        let mut forcing =
            Self { psi_0: [0.0; LANES], weighted: [[0.0; LANES]; 4], sloped: [[0.0; LANES]; 4] };
        let [w1, w2, w3, w4] = &mut forcing.weighted;
        let [s1, s2, s3, s4] = &mut forcing.sloped;
        for i in 0..LANES {
            let (x0, d) = (from[i], x[i] - from[i]);
            let speed = d / dt[i];
            let delta = (dt[i] - nominal) / tau;
            let p0 = psi[0] + delta * slope[0];
            let p1 = psi[1] + delta * slope[1];
            let p2 = psi[2] + delta * slope[2];
            let p3 = psi[3] + delta * slope[3];
            let (x2, d2) = (x0 * x0, d * d);
            let (xd2, d2x3, x2d3) = (2.0 * x0 * d, 3.0 * d2 * x0, 3.0 * x2 * d);
            let (x3, d3) = (x2 * x0, d2 * d);
            let first = x0 * p0 + d * p1;
            forcing.psi_0[i] = p0;
            w1[i] = first;
            w2[i] = x2 * p0 + (xd2 * p1 + d2 * p2);
            w3[i] = (x3 * p0 + x2d3 * p1) + (d2x3 * p2 + d3 * p3);
            w4[i] = speed * first;
            if SLOPES {
                let [r0, r1, r2, r3] = slope.map(|slope| r * slope);
                let first = x0 * r0 + d * r1;
                s1[i] = first;
                s2[i] = x2 * r0 + (xd2 * r1 + d2 * r2);
                s3[i] = (x3 * r0 + x2d3 * r1) + (d2x3 * r2 + d3 * r3);
                s4[i] = speed * first;
            }
        }
        forcing
    }
}
