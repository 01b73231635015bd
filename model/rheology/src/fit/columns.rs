//! The columns of a record's linear problem, and their derivatives by the parameters in which it is not linear.
//!
//! Every family has them as exact responses of its relaxation terms. The modified Kelvin body of third order has a kernel of
//! its own ([`super::design`]), made for records of many samples.

use super::design::{self, LANES, LINEAR_COUNT, Lane, Rows, Scale, blocks as design_blocks, six};
use super::options::Layout;
use super::sample::FitSample;
use super::thin::Block;
use super::triangle::{Factor, Triangle};
use crate::families::{Family, Kernel, OuterRange, RelaxationTerm, Response, joined};
use palpate_model::units::{Depth, Seconds};
use std::sync::Arc;

/// Half the step in search coordinates over which columns are differenced: the error of central differences and that
/// of rounding are both near 1e-10 there, and Gauss-Newton needs no more than a direction.
const DIFFERENCE: f64 = 1e-5;

/// The parameters in which the model is not linear.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OuterPoint {
    /// Those of the family in their units. Steps of a relaxation time are taken in its logarithm, but that is never
    /// stored: rounding `ln 80` costs another parameter up to the tenth digit.
    pub values: Vec<f64>,
    /// Contact position over the depth scale.
    pub contact: f64,
}

/// All parameters of one record: outer ones, and coefficients of its columns.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ParameterPoint {
    pub outer: OuterPoint,
    pub at: Vec<f64>,
}

/// A parameter by which the modelled force is derived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slope {
    /// An outer parameter of the family, in its search coordinate.
    Outer(usize),
    /// The scaled contact position.
    Contact,
}

/// Search coordinate of an outer parameter.
pub(super) fn coordinate(range: OuterRange, value: f64) -> f64 {
    match range {
        OuterRange::Share(..) => value,
        _ => value.ln(),
    }
}

/// The value a step of the search coordinate away.
pub(super) fn step_value(range: OuterRange, value: f64, step: f64) -> f64 {
    match range {
        OuterRange::Share(..) => value + step,
        _ => value + value * step.exp_m1(),
    }
}

/// Derivative of an outer parameter by its search coordinate.
pub(super) fn coordinate_slope(range: OuterRange, value: f64) -> f64 {
    match range {
        OuterRange::Share(..) => 1.0,
        _ => value,
    }
}

/// Where a family's columns come from.
#[derive(Clone, Debug)]
pub(super) struct ColumnSource {
    pub family: Arc<dyn Family>,
    pub layout: Layout,
    kernel: Kernel,
    kinds: Vec<OuterRange>,
}

/// Columns at up to 64 samples, and slopes where they were asked for.
pub(super) enum ColumnBlock<'r> {
    Kernel(&'r Rows),
    Terms(&'r [Lane]),
}

impl ColumnBlock<'_> {
    #[inline(always)]
    pub fn write(&self, columns: &mut [Lane], point: &ParameterPoint, slopes: &[Slope]) {
        match self {
            Self::Kernel(rows) => {
                rows.values(columns);
                let slots = columns[LINEAR_COUNT..].iter_mut();
                for (slot, slope) in slots.zip(slopes) {
                    *slot = match slope {
                        Slope::Outer(_) => rows.tau_slope(&six(&point.at), point.outer.values[0]),
                        Slope::Contact => rows.contact_slope(&six(&point.at)),
                    };
                }
            }
            Self::Terms(lanes) => columns[..lanes.len()].copy_from_slice(lanes),
        }
    }
}

impl ColumnSource {
    /// A body `at_rest` at its first depth has no kernel: that one starts from zero force.
    pub fn new(family: Arc<dyn Family>, at_rest: bool) -> Self {
        Self {
            layout: Layout::of(&*family),
            kernel: match at_rest {
                true => Kernel::Terms,
                false => family.kernel(),
            },
            kinds: family.outer().iter().map(|one| one.range).collect(),
            family,
        }
    }

    /// Whether a pass over all samples costs so little that thinned records are for searching only.
    pub fn is_fast(&self) -> bool {
        self.kernel == Kernel::ThirdOrder
    }

    /// Whether the family searches for nothing but one relaxation time.
    pub fn has_one_time(&self) -> bool {
        self.kinds == [OuterRange::Time]
    }

    pub fn range_kind(&self, outer: usize) -> OuterRange {
        self.kinds[outer]
    }

    /// Divisors that turn coefficients of bare columns into their units.
    pub fn units(&self, depth_mm: f64) -> Vec<f64> {
        match self.kernel {
            Kernel::ThirdOrder => design::linear_units(depth_mm).to_vec(),
            Kernel::Terms => vec![1.0; self.layout.linear_count()],
        }
    }

    /// Coefficients of bare columns, of which each is one parameter.
    pub fn to_bare(&self, at: &[f64]) -> Vec<f64> {
        let mut bare = at.to_vec();
        if self.is_fast() {
            bare[..3].copy_from_slice(&design::powers_from_legendre(&six(at)));
        }
        bare
    }

    /// Coefficients of the columns, from those of bare ones.
    pub fn to_basis(&self, bare: &[f64]) -> Vec<f64> {
        match self.kernel {
            Kernel::ThirdOrder => design::legendre_from_powers(&six(bare)).to_vec(),
            Kernel::Terms => bare.to_vec(),
        }
    }

    /// How many of the first columns are nearly orthogonal combinations of the bare ones up to them.
    pub fn combined_count(&self) -> usize {
        if self.is_fast() { 3 } else { 0 }
    }

    /// Visits all samples in blocks of up to 64 with their columns; those of censored samples mean nothing. `None`
    /// where there is no finite force.
    #[inline(always)]
    pub fn walk(
        &self,
        samples: &[FitSample],
        scale: Scale,
        point: &ParameterPoint,
        slopes: &[Slope],
        mut visit: impl FnMut(&[FitSample], &ColumnBlock<'_>),
    ) -> Option<()> {
        match (self.kernel, slopes) {
            (Kernel::ThirdOrder, []) => {
                design::walk::<false>(samples, scale, point.outer.values[0], |block, rows| {
                    visit(block, &ColumnBlock::Kernel(rows));
                });
            }
            (Kernel::ThirdOrder, _) => {
                design::walk::<true>(samples, scale, point.outer.values[0], |block, rows| {
                    visit(block, &ColumnBlock::Kernel(rows));
                });
            }
            (Kernel::Terms, _) => {
                let mut lanes = vec![[0.0; LANES]; self.layout.linear_count() + slopes.len()];
                let mut walk = self.start_walk(samples[0].depth.0, scale, point, slopes);
                let mut before = samples[0].t.0;
                for block in samples.chunks(LANES) {
                    for (i, sample) in block.iter().enumerate() {
                        walk.advance(sample.depth.0, sample.t.0 - before)?;
                        before = sample.t.0;
                        if sample.is_measured() {
                            let row = walk.row(self.layout);
                            for (lane, value) in lanes.iter_mut().zip(row) {
                                lane[i] = *value;
                            }
                        }
                    }
                    visit(block, &ColumnBlock::Terms(&lanes));
                }
            }
        }
        Some(())
    }

    /// The modelled force at every sample; `None` where there is no finite one.
    pub fn forces(
        &self,
        samples: &[FitSample],
        scale: Scale,
        point: &ParameterPoint,
    ) -> Option<Vec<f64>> {
        let mut forces = Vec::with_capacity(samples.len());
        if self.is_fast() {
            let bare = six(&self.to_bare(&point.at));
            design::walk::<false>(samples, scale, point.outer.values[0], |block, rows| {
                forces.extend_from_slice(&rows.force(&bare)[..block.len()]);
            });
            return Some(forces);
        }
        let mut walk = self.start_walk(samples.first()?.depth.0, scale, point, &[]);
        let mut before = samples[0].t.0;
        for sample in samples {
            walk.advance(sample.depth.0, sample.t.0 - before)?;
            before = sample.t.0;
            let row = walk.row(self.layout);
            forces.push(row.iter().zip(&point.at).map(|(a, b)| a * b).sum());
        }
        Some(forces)
    }

    /// Columns, slopes and the mean force of a thinned record, weighted, as one triangle.
    pub fn thin_factor(
        &self,
        blocks: &[Block],
        scale: Scale,
        point: &ParameterPoint,
        slopes: &[Slope],
    ) -> Option<Factor> {
        if self.is_fast() && slopes.is_empty() {
            return Some(design_blocks::thin_factor(blocks, scale, point.outer.values[0]));
        }
        let width = self.layout.linear_count() + slopes.len() + 1;
        let mut triangle = Triangle::new(width);
        let mut columns = vec![0.0; width];
        let mut walk = self.start_walk(blocks.first()?.depth, scale, point, slopes);
        for block in blocks {
            walk.advance_mean(block)?;
            if block.weight > 0.0 {
                columns[..width - 1].copy_from_slice(walk.row(self.layout));
                columns[width - 1] = block.force;
                triangle.push(&columns, block.weight);
            }
        }
        let factor = triangle.finish();
        factor.is_finite().then_some(factor)
    }

    /// Visits the ends of a thinned record's blocks on its redrawn path, with bare columns and slopes there.
    pub fn visit_redrawn(
        &self,
        blocks: &[Block],
        scale: Scale,
        point: &ParameterPoint,
        slopes: &[Slope],
        mut visit: impl FnMut(&Block, &[f64]),
    ) -> Option<()> {
        if self.is_fast() {
            let tau = point.outer.values[0];
            design_blocks::visit_redrawn(blocks, scale, tau, &six(&point.at), &mut visit);
            return Some(());
        }
        let mut walk = self.start_walk(blocks.first()?.redrawn, scale, point, slopes);
        for block in blocks {
            walk.advance(block.redrawn, block.dt)?;
            visit(block, walk.row(self.layout));
        }
        Some(())
    }

    fn start_walk(
        &self,
        start: f64,
        scale: Scale,
        point: &ParameterPoint,
        slopes: &[Slope],
    ) -> ColumnWalk {
        let OuterPoint { values, contact } = &point.outer;
        let contact = contact * scale.depth_mm;
        let body = |columns: &[Vec<RelaxationTerm>], contact: f64| ContactResponse {
            response: Response::new(columns, Depth(start - contact)),
            contact,
            values: vec![0.0; columns.len()],
        };
        let columns = self.family.columns(values);
        let coefficients = || point.at[..self.layout.coefficients].iter().copied();
        let initial = self.layout.initial().map_or(0.0, |k| point.at[k - self.layout.outers]);
        let mut bodies = vec![body(&columns, contact)];
        let mut fading = vec![self.family.fading(values)];
        for slope in slopes {
            match *slope {
                // The body shifted both ways, without the terms that a shift leaves as they are: they cancel.
                Slope::Outer(index) => {
                    let [up, down] = [DIFFERENCE, -DIFFERENCE].map(|step| {
                        let mut shifted = values.clone();
                        shifted[index] = step_value(self.kinds[index], values[index], step);
                        fading.push(self.family.fading(&shifted));
                        joined(&self.family.columns(&shifted), coefficients())
                    });
                    let only = |one: &[RelaxationTerm], other: &[RelaxationTerm]| {
                        let terms = one.iter().filter(|term| !other.contains(term));
                        vec![terms.copied().collect::<Vec<_>>()]
                    };
                    bodies.push(body(&only(&up, &down), contact));
                    bodies.push(body(&only(&down, &up), contact));
                }
                Slope::Contact => {
                    let whole = [joined(&columns, coefficients())];
                    let step = DIFFERENCE * scale.depth_mm;
                    bodies.push(body(&whole, contact + step));
                    bodies.push(body(&whole, contact - step));
                    fading.extend([None; 2]);
                }
            }
        }
        ColumnWalk {
            bodies,
            fading,
            initial,
            elapsed: 0.0,
            fade_time: 0.0,
            row: vec![0.0; self.layout.linear_count() + slopes.len()],
        }
    }
}

/// A response to depth over its own contact position.
struct ContactResponse {
    response: Response,
    contact: f64,
    /// Of its columns, now or as means over a block.
    values: Vec<f64>,
}

/// The columns of a family, then for each slope the body shifted up and down, on their way along a record.
struct ColumnWalk {
    bodies: Vec<ContactResponse>,
    /// Time in which the initial force fades, for each body.
    fading: Vec<Option<f64>>,
    initial: f64,
    elapsed: f64,
    /// Time at which the fading terms are evaluated.
    fade_time: f64,
    row: Vec<f64>,
}

impl ColumnWalk {
    fn advance(&mut self, depth: f64, dt: f64) -> Option<()> {
        for body in &mut self.bodies {
            if dt > 0.0 {
                let depth = Depth(depth - body.contact);
                body.response.step(depth, Seconds(dt)).ok()?;
            }
            body.values.fill(0.0);
            body.response.add_to(&mut body.values);
        }
        self.elapsed += dt;
        self.fade_time = self.elapsed;
        Some(())
    }

    /// Over a block, with means in the place of values.
    fn advance_mean(&mut self, block: &Block) -> Option<()> {
        if block.dt <= 0.0 {
            return self.advance(block.depth, 0.0);
        }
        for body in &mut self.bodies {
            let (depth, dt) = (Depth(block.depth - body.contact), Seconds(block.dt));
            body.values.fill(0.0);
            let step = body.response.step_mean(depth, dt, block.count, &mut body.values);
            step.ok()?;
        }
        self.elapsed += block.dt;
        // The fading terms at the middle of the block: their mean to second order.
        self.fade_time = self.elapsed - 0.5 * block.dt * (1.0 - 1.0 / block.count as f64);
        Some(())
    }

    /// Columns and slopes where it is.
    fn row(&mut self, layout: Layout) -> &[f64] {
        let Layout { coefficients, .. } = layout;
        let linear = layout.linear_count();
        let faded = |tau: Option<f64>| tau.map_or(0.0, |tau| (-self.fade_time / tau).exp());
        self.row[..coefficients].copy_from_slice(&self.bodies[0].values);
        if layout.fades {
            self.row[coefficients] = faded(self.fading[0]);
        }
        self.row[linear - 1] = 1.0;
        let pairs = self.bodies[1..].chunks(2).zip(self.fading[1..].chunks(2));
        for (slot, (bodies, fading)) in self.row[linear..].iter_mut().zip(pairs) {
            let [up, down] = [0, 1].map(|k| bodies[k].values[0] + self.initial * faded(fading[k]));
            *slot = (up - down) / (2.0 * DIFFERENCE);
        }
        &self.row
    }
}
