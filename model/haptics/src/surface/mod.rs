//! A deformable surface: heights over a grid, moved by what touches them.
//!
//! Nodes move along z alone. A contact takes the node nearest to it along; neighbours further apart in
//! height than MaxShear follow. Between contacts everything displaced returns to rest with a time
//! constant. [`Surface::tick`] does both; it allocates nothing, locks nothing, and gives the same bits
//! for the same contacts.
//!
//! Two methods give the same shape: [`SurfaceMethod::Chain`] is ChainMail as published, [`SurfaceMethod::Envelope`] its
//! closed form, many times faster.

mod chain;
mod contact;
mod envelope;
mod grid;
mod heights;
mod mesh;
mod mesh_error;
mod plan;
mod proxy;
mod recover;
mod scene_curves;
mod shape_error;

pub use contact::{ContactSide, Cut, MoveCounts, SurfaceContact};
pub use grid::{Grid, GridNode, GridRect, MOST_NODES};
pub use heights::Heights;
pub use mesh::{HIGHEST_MM, HeightField, INERT};
pub use mesh_error::MeshError;
pub use plan::{
    OmittedPart, ScenePlan, ScenePlanError, SceneRequirements, plan, updated_cost_factor,
};
pub use proxy::{Proxy, ProxyTouch, TouchState};
pub use recover::{SETTLED_MM, SurfaceRecovery};
pub use scene_curves::{CutPoint, FamilyPoint, MeshPoint, SceneCurves, StepPoint};
pub use shape_error::{HandPoke, PokeScene, REFERENCE_NODES, ShapeError};

use chain::Chain;
use contact::Poke;
use envelope::Envelope;
pub(crate) use proxy::{FRICTION_MOST, dot};

palpate_model::named! {
    /// Algorithm that computes the shape.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SurfaceMethod {
        /// The closed form: the fast one.
        Envelope = "closed form",
        /// First moved first processed.
        Chain = "first moved first",
    }
}

/// A method with its storage.
#[derive(Clone, Debug)]
enum Solver {
    Envelope(Envelope),
    Chain(Chain),
}

/// A height field, how it is moved and how it returns.
#[derive(Clone, Debug)]
pub struct Surface {
    field: HeightField,
    solver: Solver,
    recovery: SurfaceRecovery,
    cut: Cut,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceTick {
    /// Work and effect of the contacts.
    pub moved: MoveCounts,
    /// Every node that may be at another height than before.
    pub dirty: GridRect,
    /// Contacts outside the mesh or with a number that is none: they had no effect.
    pub ignored: usize,
    /// Contacts beyond [`HIGHEST_MM`], which were taken to be there.
    pub clamped: usize,
}

impl Surface {
    /// With everything a tick needs allocated.
    #[must_use]
    pub fn new(
        field: HeightField,
        method: SurfaceMethod,
        recovery: SurfaceRecovery,
        cut: Cut,
    ) -> Self {
        let solver = match method {
            SurfaceMethod::Envelope => Solver::Envelope(Envelope::new(field.grid(), field.shear())),
            SurfaceMethod::Chain => Solver::Chain(Chain::new(field.grid())),
        };
        Self { field, solver, recovery, cut }
    }

    pub fn field(&self) -> &HeightField {
        &self.field
    }

    /// Heights now in mm, row by row.
    pub fn heights(&self) -> &[f64] {
        self.field.heights()
    }

    /// One tick of recovery, then the contacts one after the other.
    pub fn tick(&mut self, contacts: &[SurfaceContact]) -> SurfaceTick {
        let mut report =
            SurfaceTick { dirty: self.field.displaced.bounds(), ..SurfaceTick::default() };
        let mut recovery = self.recovery;
        let mut rest = contacts;
        loop {
            let (some, others) = rest.split_at(rest.len().min(envelope::TOGETHER));
            let mut pokes = [Poke::NOWHERE; envelope::TOGETHER];
            let mut count = 0;
            for contact in some {
                match contact.poke(self.field.grid()) {
                    Some((poke, clamped)) => {
                        pokes[count] = poke;
                        count += 1;
                        report.clamped += usize::from(clamped);
                    }
                    None => report.ignored += 1,
                }
            }
            report.moved.add(self.solve(recovery, &pokes[..count]));
            report.dirty = report.dirty.union(self.field.displaced.bounds());
            recovery = SurfaceRecovery::NONE;
            rest = others;
            if rest.is_empty() {
                return report;
            }
        }
    }

    fn solve(&mut self, recovery: SurfaceRecovery, pokes: &[Poke]) -> MoveCounts {
        let Self { field, solver, cut, .. } = self;
        match solver {
            Solver::Envelope(shape) => envelope::tick(field, shape, recovery, *cut, pokes),
            Solver::Chain(chain) => {
                recovery.step_field(field);
                let mut moved = MoveCounts::default();
                for &poke in pokes {
                    moved.add(chain.poke(field, field.shear(), *cut, poke));
                }
                moved
            }
        }
    }
}

#[cfg(test)]
mod tests;
