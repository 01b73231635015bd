//! What a coarser mesh, a shorter influence or a longer step does to shape and force.
//!
//! Pure: errors alone. Times are measured by whoever has a clock, and [`plan`](super::plan()) takes both.

use super::contact::{ContactSide, Cut, SurfaceContact};
use super::envelope::{self, Envelope};
use super::grid::Grid;
use super::mesh::HeightField;
use super::mesh_error::MeshError;
use super::recover::SurfaceRecovery;
use palpate_rheology::integrators::{IntegratorError, Scheme, SeriesBody};
use serde::{Deserialize, Serialize};

/// Nodes along a side of the mesh that stands for the truth.
pub const REFERENCE_NODES: usize = 1601;

/// How much finer the step of the exact force is: its error, that of taking the path straight, falls
/// with the square, to a 4000th.
const FINER: usize = 64;

/// Pokes of one square piece of tissue, the same on any mesh.
#[derive(Clone, Debug)]
pub struct PokeScene {
    /// Length of a side in mm.
    pub extent: f64,
    /// MaxShear over the distance of nodes: a limit of slope, so that every mesh is of the same tissue.
    pub slope: f64,
    /// Depth of a poke below the surface at rest, in mm.
    pub depth: f64,
    /// Height at rest over x and y, in mm, nowhere steeper along an axis than `slope`.
    pub rest: fn(f64, f64) -> f64,
    /// Where pokes are, in mm; several, since one may happen to lie on a node. Outside it has no effect.
    pub places: Vec<[f64; 2]>,
}

/// Difference of two shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShapeError {
    /// Root of the mean square over the area and all pokes, in mm.
    pub l2_mm: f64,
    /// Largest, in mm.
    pub linf_mm: f64,
}

impl PokeScene {
    /// The shape on a mesh of `nodes` a side against that on a mesh of `reference` nodes, between nodes interpolated.
    pub fn mesh_error_against(
        &self,
        nodes: usize,
        reference: usize,
    ) -> Result<ShapeError, MeshError> {
        self.compare((nodes, Cut::NONE), (reference, Cut::NONE))
    }

    /// The shape with a cut against that without, on a mesh of `nodes` a side.
    pub fn cut_error(&self, nodes: usize, cut: Cut) -> Result<ShapeError, MeshError> {
        self.compare((nodes, cut), (nodes, Cut::NONE))
    }

    /// The scene on a mesh.
    pub fn field(&self, nodes: usize) -> Result<HeightField, MeshError> {
        // A spacing that is none is refused with the grid.
        let grid = Grid::new(nodes, nodes, self.extent / nodes.saturating_sub(1) as f64)?;
        let places = (0..grid.nodes())
            .map(|index| [index % nodes, index / nodes].map(|steps| steps as f64 * grid.spacing()));
        let rest = places.map(|[x, y]| (self.rest)(x, y)).collect();
        HeightField::new(grid, rest, self.slope * grid.spacing())
    }

    fn compare(
        &self,
        (nodes, cut): (usize, Cut),
        (truth_nodes, truth_cut): (usize, Cut),
    ) -> Result<ShapeError, MeshError> {
        let (mut field, mut truth) = (self.field(nodes)?, self.field(truth_nodes)?);
        let spacing = truth.grid.spacing();
        let extent = field.grid.extent();
        let (mut square, mut count, mut linf) = (0.0, 0usize, 0.0f64);
        for &place in &self.places {
            self.poke(&mut field, cut, place);
            self.poke(&mut truth, truth_cut, place);
            let shape = field.current();
            for (index, truth) in truth.now.iter().enumerate() {
                let steps = [index % truth_nodes, index / truth_nodes];
                // The last node of one mesh may be a rounding beyond that of the other.
                let at = [0, 1].map(|axis| (steps[axis] as f64 * spacing).min(extent[axis]));
                if let Some((height, _)) = shape.at(at[0], at[1]) {
                    let error = (height - truth).abs();
                    square += error * error;
                    linf = linf.max(error);
                    count += 1;
                }
            }
        }
        Ok(ShapeError { l2_mm: (square / count.max(1) as f64).sqrt(), linf_mm: linf })
    }

    /// One poke of the surface at rest.
    fn poke(&self, field: &mut HeightField, cut: Cut, [x, y]: [f64; 2]) {
        let contact =
            SurfaceContact { x, y, z: (self.rest)(x, y) - self.depth, side: ContactSide::Push };
        let pokes = contact.poke(&field.grid).map(|(poke, _)| poke);
        let shape = Envelope::new(&field.grid, field.shear());
        envelope::tick(field, &shape, SurfaceRecovery::ELASTIC, cut, pokes.as_slice());
    }
}

/// Depth over the time of a poke and back by a hand: `depth sin^2(pi t / duration)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandPoke {
    /// Greatest depth in mm.
    pub depth: f64,
    /// From contact to contact in s.
    pub duration: f64,
}

impl HandPoke {
    fn depths(&self, step: f64, count: usize) -> Vec<f64> {
        let depth = |index: usize| {
            let share = (index as f64 * step / self.duration).min(1.0);
            self.depth * (std::f64::consts::PI * share).sin().powi(2)
        };
        (0..=count).map(depth).collect()
    }

    /// Largest error of force in N of an integrator at a step (s) along this poke, and the largest
    /// force, against the exact one. A loop knows depth at its ticks alone, so what happens between them
    /// counts as error of the step.
    pub fn force_error<const N: usize>(
        &self,
        body: &SeriesBody<N>,
        scheme: Scheme,
        step: f64,
    ) -> Result<[f64; 2], IntegratorError> {
        scheme.check(body, step)?;
        let count = (self.duration / step).ceil();
        // A hundred million steps: more than that is no poke of this step.
        if !(count >= 1.0 && count <= 1e8 / FINER as f64) {
            return Err(IntegratorError::Time(step));
        }
        let count = count as usize;
        let (mut forces, mut exact) = (Vec::new(), Vec::new());
        scheme.respond(body, step, &self.depths(step, count), &mut forces)?;
        let fine = step / FINER as f64;
        Scheme::Exact.respond(body, fine, &self.depths(fine, count * FINER), &mut exact)?;
        let (mut worst, mut peak) = (0.0f64, 0.0f64);
        for (force, exact) in forces.iter().zip(exact.iter().step_by(FINER)) {
            worst = worst.max((force - exact).abs());
            peak = peak.max(exact.abs());
        }
        Ok([worst, peak])
    }
}
