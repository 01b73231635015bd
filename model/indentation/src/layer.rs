//! An indenter on an elastic layer on a rigid base: the dual integral equations of the contact, solved as a Fredholm equation.
//!
//! A pressure whose Hankel transform is `p(k)` moves the surface of a layer of thickness `h` by
//! `w(r) = (1 - nu) / G * integral of L(k h) p(k) J0(k r) dk`. `L` is one for a half-space, and for a layer it follows from the
//! base (Burmister 1945; Lebedev and Ufliand 1958; Hayes et al., J. Biomech. 5 (1972) 541-551). With
//! `p(k) = integral from 0 to a of phi(t) cos(k t) dt` the pressure is zero outside of the contact radius `a`, and Abel's
//! transform of `w` gives
//!
//! ```text
//! pi / 2 * phi(x) - integral from 0 to a of K(x, t) phi(t) dt = G / (1 - nu) * g(x)
//! K(x, t) = integral from 0 to infinity of (1 - L(k h)) cos(k x) cos(k t) dk
//! ```
//!
//! with `g` the depth less what the shape takes from it. The force is `2 pi` times the integral of `phi`. Where the contact
//! radius is free, `phi(a) = 0` finds it: the pressure ends without a step.

use crate::invalid_value::{InvalidValue, check_poisson, positive};
use crate::load_curve::LoadKnot;
use crate::quadrature::gauss_legendre;
use crate::shape::{Contact, IndenterShape};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};
use thiserror::Error;

/// Whether the layer sticks to its base.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Base {
    Bonded,
    Frictionless,
}

/// A layer on a rigid base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    pub thickness_mm: f64,
    pub poisson: f64,
    pub base: Base,
}

/// A contact outside of what the equation describes.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LayerError {
    #[error(transparent)]
    Value(#[from] InvalidValue),
    #[error(
        "the contact radius would be more than {RADIUS_OVER_THICKNESS_MAX} times the thickness of the layer; use a smaller depth or a thicker specimen"
    )]
    TooThin,
    #[error(
        "the indenter would touch beyond the equator of its sphere or the end of its chamfer; use a smaller depth"
    )]
    BeyondEnd,
}

/// Contact radii over thicknesses that are solved to 1e-8: beyond, the linear theory of a layer says little of tissue.
pub(crate) const RADIUS_OVER_THICKNESS_MAX: f64 = 8.0;
/// Nodes across the contact.
const NODES: usize = 48;
/// Nodes on each side of a corner of the shape.
const NODES_BESIDE_CORNER: usize = 32;
/// Nodes of the integral over `k h`, and more for each thickness in the contact radius, over which its cosines turn.
const KERNEL_NODES: [f64; 2] = [100.0, 90.0];
/// `1 - L` falls as `exp(-2 k h)`: here it is below 1e-19.
const KERNEL_END: f64 = 25.0;

impl Base {
    /// `1 - L` at a product of wave number and thickness.
    fn softness(self, y: f64, poisson: f64) -> f64 {
        let (nu, decay, square) = (poisson, (-2.0 * y).exp(), (-4.0 * y).exp());
        // Numerator and denominator of L over half of exp(2 y), so that nothing overflows.
        let (above, below) = match self {
            Self::Bonded => {
                let stiff = 3.0 - 4.0 * nu;
                let rest = 1.0 + 4.0 * (1.0 - nu) * (1.0 - 2.0 * nu) + 2.0 * y * y;
                (
                    stiff * (1.0 - square) - 4.0 * y * decay,
                    stiff * (1.0 + square) + 2.0 * rest * decay,
                )
            }
            Self::Frictionless => (1.0 + square - 2.0 * decay, 1.0 - square + 4.0 * y * decay),
        };
        if below > 0.0 { 1.0 - above / below } else { 1.0 }
    }
}

/// Pressure functions over the contact, for a contact radius of one: of a depth of one, and of what the shape takes.
pub(crate) struct Solved {
    /// The integral, and the value at the edge.
    pub depth: [f64; 2],
    pub shape: [f64; 2],
}

impl Layer {
    pub(crate) fn check(&self) -> Result<(), LayerError> {
        positive("the thickness", self.thickness_mm, "a length above 0 mm")?;
        Ok(check_poisson(self.poisson)?)
    }

    /// The contact at a depth in mm, less than that at which a sphere or a chamfer touches beyond its end.
    pub fn contact(&self, shape: IndenterShape, depth_mm: f64) -> Result<Contact, LayerError> {
        self.check()?;
        positive("the depth", depth_mm, "a length above 0 mm")?;
        match shape {
            IndenterShape::FlatPunch { radius_mm } => {
                self.check_radius(radius_mm)?;
                let force_over_modulus = self.load_knot(shape, radius_mm).slope * depth_mm;
                Ok(Contact { radius_mm, force_over_modulus })
            }
            _ => self.free_contact(shape, depth_mm),
        }
    }

    pub(crate) fn check_radius(&self, radius_mm: f64) -> Result<(), LayerError> {
        positive("the radius", radius_mm, "a length above 0 mm")?;
        match radius_mm <= RADIUS_OVER_THICKNESS_MAX * self.thickness_mm {
            true => Ok(()),
            false => Err(LayerError::TooThin),
        }
    }

    /// Depth, force and its slope where the contact has a radius that grows with the depth. The slope is the
    /// stiffness of a flat punch of that radius, because a contact that grows adds no force at its edge.
    pub(crate) fn load_knot(&self, shape: IndenterShape, radius_mm: f64) -> LoadKnot {
        let a = radius_mm;
        let corner = shape.corner().map_or(0.0, |corner| (corner / a).min(1.0));
        let solved = self.solve(1, a / self.thickness_mm, corner, |x| shape.taken(a * x));
        // The edge without pressure fixes the depth of this radius.
        let depth = solved.shape[1] / solved.depth[1];
        // Force over modulus is force over shear modulus over 2 (1 + nu).
        let scale = 2.0 * PI * a / ((1.0 - self.poisson) * 2.0 * (1.0 + self.poisson));
        LoadKnot {
            depth,
            force: scale * (depth * solved.depth[0] - solved.shape[0]),
            slope: scale * solved.depth[0],
        }
    }

    /// A contact whose radius is free.
    fn free_contact(&self, shape: IndenterShape, depth_mm: f64) -> Result<Contact, LayerError> {
        let widest = RADIUS_OVER_THICKNESS_MAX * self.thickness_mm;
        let [begin, end] = shape.contact_radii();
        self.check_radius(begin.max(f64::MIN_POSITIVE))?;
        let end = end * (1.0 - 1e-9);
        let (mut low, mut high) = (begin, widest.min(end));
        if self.load_knot(shape, high).depth < depth_mm {
            return Err(match end < widest {
                true => LayerError::BeyondEnd,
                false => LayerError::TooThin,
            });
        }
        // The depth grows with the radius.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.load_knot(shape, middle).depth < depth_mm {
                low = middle
            } else {
                high = middle
            }
        }
        let radius_mm = 0.5 * (low + high);
        let force_over_modulus = self.load_knot(shape, radius_mm).force;
        Ok(Contact { radius_mm, force_over_modulus })
    }

    /// Solves the equation for a radius of one, `ratio` times the thickness, and a shape with a corner at a radius, at zero
    /// without one; with `finer` times the usual nodes of both integrals.
    pub(crate) fn solve(
        &self,
        finer: usize,
        ratio: f64,
        corner: f64,
        taken: impl Fn(f64) -> f64,
    ) -> Solved {
        let nodes = nodes(finer, corner);
        let node_count = nodes.len();
        // Wave numbers of a radius of one are those of the thickness times the ratio.
        let [fixed, turning] = KERNEL_NODES;
        let count = finer * (fixed + turning * ratio) as usize;
        let waves: Vec<(f64, f64)> = gauss_legendre(count, KERNEL_END)
            .into_iter()
            .map(|(y, weight)| (ratio * y, ratio * weight * self.base.softness(y, self.poisson)))
            .collect();
        let cosines = |x: f64| waves.iter().map(|(k, _)| (k * x).cos()).collect::<Vec<f64>>();
        let rows: Vec<Vec<f64>> = nodes.iter().map(|(x, _)| cosines(*x)).collect();
        let kernel = |a: &[f64], b: &[f64]| -> f64 {
            let pairs = a.iter().zip(b).zip(&waves);
            pairs.map(|((a, b), (_, weight))| weight * a * b).sum()
        };
        let mut system: Vec<Vec<f64>> = (0..node_count)
            .map(|i| {
                let entry = |j: usize| {
                    let own = if i == j { FRAC_PI_2 } else { 0.0 };
                    own - kernel(&rows[i], &rows[j]) * nodes[j].1
                };
                let right = [1.0, taken(nodes[i].0)];
                (0..node_count).map(entry).chain(right).collect()
            })
            .collect();
        let solutions = eliminate(&mut system);
        let edge = cosines(1.0);
        let summed = |number: usize, right: f64| {
            let phi = |i: usize| nodes[i].1 * solutions[i][number];
            let integral: f64 = (0..node_count).map(phi).sum();
            let over: f64 = (0..node_count).map(|i| kernel(&edge, &rows[i]) * phi(i)).sum();
            [integral, (right + over) / FRAC_PI_2]
        };
        Solved { depth: summed(0, 1.0), shape: summed(1, taken(1.0)) }
    }
}

/// Places and weights across the contact. Behind a corner the pressure function grows with the root of the distance, which the
/// square of a variable makes smooth.
fn nodes(finer: usize, corner: f64) -> Vec<(f64, f64)> {
    if corner <= 0.0 || corner >= 1.0 {
        return gauss_legendre(finer * NODES, 1.0);
    }
    let beyond = 1.0 - corner;
    let behind = gauss_legendre(finer * NODES_BESIDE_CORNER, 1.0).into_iter();
    let behind = behind.map(|(u, weight)| (corner + beyond * u * u, 2.0 * beyond * u * weight));
    gauss_legendre(finer * NODES_BESIDE_CORNER, corner).into_iter().chain(behind).collect()
}

/// Solves a square system with two right-hand sides by elimination with pivots.
fn eliminate(system: &mut [Vec<f64>]) -> Vec<[f64; 2]> {
    let count = system.len();
    for column in 0..count {
        let largest = (column..count)
            .max_by(|a, b| system[*a][column].abs().total_cmp(&system[*b][column].abs()));
        system.swap(column, largest.unwrap_or(column));
        let (above, below) = system.split_at_mut(column + 1);
        let pivot = &above[column];
        for row in below {
            let factor = row[column] / pivot[column];
            for (value, own) in row.iter_mut().zip(pivot).skip(column) {
                *value -= factor * own;
            }
        }
    }
    let mut found = vec![[0.0; 2]; count];
    for row in (0..count).rev() {
        for number in 0..2 {
            let known: f64 = (row + 1..count).map(|j| system[row][j] * found[j][number]).sum();
            found[row][number] = (system[row][count + number] - known) / system[row][row];
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const PUNCH: IndenterShape = IndenterShape::FlatPunch { radius_mm: 1.0 };
    const SPHERE: IndenterShape = IndenterShape::Parabola { radius_mm: 100.0 };

    fn layer(thickness_mm: f64, poisson: f64, base: Base) -> Layer {
        Layer { thickness_mm, poisson, base }
    }

    /// Force on the layer over that on a half-space.
    fn factor(layer: Layer, shape: IndenterShape, depth: f64) -> f64 {
        let force = layer.contact(shape, depth).unwrap().force_over_modulus;
        force / shape.on_half_space(depth, layer.poisson).unwrap().force_over_modulus
    }

    #[test]
    fn a_thick_layer_is_a_half_space() {
        for base in [Base::Bonded, Base::Frictionless] {
            for shape in [PUNCH, SPHERE, IndenterShape::Cone { half_angle_rad: 1.3 }] {
                let found = factor(layer(1e6, 0.4, base), shape, 0.01);
                // The first order is about 1.1 times radius over thickness.
                assert!((found - 1.0).abs() < 3e-6, "{base:?} {shape:?}: {found}");
            }
        }
    }

    /// The first order in radius over thickness is `2 / pi` times the integral of `1 - L`: the kernel is a constant then.
    #[test]
    fn a_rather_thick_layer_adds_the_first_order() {
        for (poisson, base) in [(0.0, Base::Bonded), (0.3, Base::Bonded), (0.5, Base::Frictionless)]
        {
            let nodes = gauss_legendre(2000, 40.0);
            let area: f64 = nodes.iter().map(|(y, w)| w * base.softness(*y, poisson)).sum();
            let (near, far) = (layer(1e3, poisson, base), layer(2e3, poisson, base));
            let slope = |layer: Layer| (factor(layer, PUNCH, 1.0) - 1.0) * layer.thickness_mm;
            // Without the second order, which halves with the radius over the thickness.
            let limit = 2.0 * slope(far) - slope(near);
            // The kernel that is cut at 25 and rounding of the difference of 1e-3 from one.
            assert!((limit / (2.0 / PI * area) - 1.0).abs() < 1e-5, "{limit} {area}");
        }
    }

    /// The series of Garcia and Garcia (Biophys. J. 114 (2018) 2923-2932) for bonded incompressible layers, which corrects
    /// that of Dimitriadis et al. (Biophys. J. 82 (2002) 2798-2810) from the second order on.
    #[test]
    fn a_sphere_on_an_incompressible_layer_is_that_of_the_series() {
        for chi in [0.05f64, 0.1, 0.2, 0.4] {
            let powers = [1.133, 1.497, 1.469, 0.755].iter().zip(1..);
            let series = 1.0 + powers.map(|(share, n)| share * chi.powi(n)).sum::<f64>();
            // chi is the root of radius times depth over the thickness.
            let thickness = (SPHERE_RADIUS * DEPTH).sqrt() / chi;
            let found = factor(layer(thickness, 0.5, Base::Bonded), SPHERE, DEPTH);
            // The digits that are printed, and the orders that are left out.
            assert!((found / series - 1.0).abs() < 1e-3 + chi.powi(5), "{chi}: {found} {series}");
        }
    }

    const SPHERE_RADIUS: f64 = 100.0;
    const DEPTH: f64 = 0.01;

    /// A wide punch on a thin compressible layer compresses it without room aside: the confined modulus over the thickness.
    #[test]
    fn a_wide_punch_finds_the_confined_modulus() {
        let poisson = 0.2;
        let confined = (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
        let force = |ratio: f64| {
            let layer = layer(1.0 / ratio, poisson, Base::Bonded);
            layer.contact(PUNCH, 1.0).unwrap().force_over_modulus / (PI * confined * ratio)
        };
        // The edge adds a share that falls as the thickness over the radius.
        let (four, eight) = (force(4.0) - 1.0, force(8.0) - 1.0);
        assert!(eight > 0.0 && eight < 0.2 && (four / eight - 2.0).abs() < 0.2, "{four} {eight}");
    }

    #[test]
    fn more_nodes_change_nothing_and_every_step_is_in_order() {
        let mut last = 1.0;
        for ratio in [0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 4.0, 8.0] {
            let kappa = factor(layer(1.0 / ratio, 0.5, Base::Bonded), PUNCH, 1.0);
            let free = factor(layer(1.0 / ratio, 0.5, Base::Frictionless), PUNCH, 1.0);
            assert!(kappa > last && free > 1.0 && free < kappa, "{ratio}: {kappa} {free}");
            last = kappa;
        }
        // From 80 nodes across the contact and 1200 of the kernel, in another language.
        assert!((last / 146.320_433_637 - 1.0).abs() < 1e-8, "{last}");
    }

    #[test]
    fn what_is_outside_is_refused_in_words() {
        let thin = layer(0.1, 0.5, Base::Bonded).contact(PUNCH, 1.0).unwrap_err();
        assert!(thin.to_string().contains("8 times the thickness"), "{thin}");
        let poisson = layer(1.0, 0.6, Base::Bonded).contact(PUNCH, 1.0).unwrap_err();
        assert_eq!(poisson.to_string(), "Poisson's ratio is 0.6; give a number from 0 to 0.5");
        for depth in [0.0, f64::NAN, f64::INFINITY] {
            assert!(layer(1.0, 0.3, Base::Bonded).contact(PUNCH, depth).is_err());
        }
    }
}
