//! The closed form of a chain with one MaxShear `s` for all: every node at
//! `min(z, z_c + s d)`, `d` being its steps along the axes from a contact at height `z_c`.
//!
//! Why a chain gives the same. Let the field be valid, no link beyond `s`, and let a node `q` be above
//! `z_c + s d(q)`. The node `p` before it on any shortest way is at `z(p) >= z(q) - s`, so it is above
//! `z_c + s d(p)`: it moves too, and so does every node of the way. First moved first processed reaches
//! `q` first over a shortest way, and puts it at `z_c + s d(q)`. With a movement threshold the same
//! holds of the nodes that are more than the threshold above.
//!
//! A minimum needs no order, no marks and no queue: rows are worked through from one end to the other,
//! recovery and all contacts in one go over memory, no further than a contact can reach.

use super::chain::{excess, extend_bounds};
use super::contact::{ContactSide, Cut, MoveCounts, Poke};
use super::grid::{Grid, GridNode, GridRect};
use super::mesh::HeightField;
use super::recover::{SurfaceRecovery, trim_span};
use palpate_rheology::vectors::run_wide;

/// Contacts that are worked through together.
pub(super) const TOGETHER: usize = 8;

/// Nodes that the widest vectors take at once: rows are worked through in multiples of it where nodes
/// around a reach allow, since single ones at the end take as long as a vector.
const LANES: usize = 8;

/// A contact and how far it reaches.
#[derive(Clone, Copy, Debug)]
struct Cone {
    poke: Poke,
    /// Steps; every node further away is allowed where it is.
    reach: usize,
}

const NO_CONE: Cone = Cone { poke: Poke::NOWHERE, reach: 0 };

/// Tables that are made once.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    shear: f64,
    /// Steps along a row from a column: those from column `c` to the first are at `columns - 1 - c`, and
    /// so on. Looking them up takes no arithmetic, of which a node needs enough.
    steps: Box<[f64]>,
}

impl Envelope {
    pub(super) fn new(grid: &Grid, shear: f64) -> Self {
        let last = grid.columns() - 1;
        let steps = (0..=2 * last).map(|index| index.abs_diff(last) as f64);
        Self { shear, steps: steps.collect() }
    }
}

/// One tick: recovery, then up to [`TOGETHER`] contacts.
pub(super) fn tick(
    field: &mut HeightField,
    shape: &Envelope,
    recovery: SurfaceRecovery,
    cut: Cut,
    pokes: &[Poke],
) -> MoveCounts {
    let mut counts = MoveCounts::default();
    let mut cones = [NO_CONE; TOGETHER];
    let mut count = 0;
    let mut touched = GridRect::EMPTY;
    for &poke in pokes {
        if let Some(cone) = cone(field, shape, recovery, cut, poke, &cones[..count]) {
            cones[count] = cone;
            count += 1;
            touched = touched.union(cone.rect(&field.grid));
            match poke.side {
                ContactSide::Push => extend_bounds::<false>(field, poke.z),
                ContactSide::Pull => extend_bounds::<true>(field, poke.z),
            }
        }
    }
    let cones = &cones[..count];
    if cones.is_empty() {
        recovery.step_field(field);
        return counts;
    }
    field.displaced.widen(touched);
    let columns = field.grid.columns();
    let touched = field.displaced.active_rows();
    run_wide(
        #[inline(always)]
        || {
            for row in touched {
                let first = row * columns;
                let now = &mut field.now[first..first + columns];
                let rest = &field.rest[row * field.rest_stride..][..columns];
                let mut work = Row { now, rest, row, span: field.displaced.row(row) };
                work.press_all(cones, shape, recovery, cut, &mut counts);
                let span = work.span;
                field.displaced.set(row, trim_span(now, rest, span));
            }
        },
    );
    field.displaced.tighten();
    field.forget_bounds();
    counts
}

/// The cone of a contact, if it moves anything.
fn cone(
    field: &HeightField,
    shape: &Envelope,
    recovery: SurfaceRecovery,
    cut: Cut,
    poke: Poke,
    before: &[Cone],
) -> Option<Cone> {
    let index = field.grid.index(poke.node);
    // The touched node as it will be when this contact's turn comes.
    let mut z = recovery.step(field.now[index], field.rest[index]);
    for other in before {
        let steps = other.poke.node.steps_to(poke.node);
        z = match other.poke.side {
            _ if steps as usize > other.reach => z,
            ContactSide::Push => other.one::<false>(z, steps, shape.shear, cut).0,
            ContactSide::Pull => other.one::<true>(z, steps, shape.shear, cut).0,
        };
    }
    let (above, furthest) = match poke.side {
        ContactSide::Push => (excess::<false>(z, poke.z), field.bounds[1] - poke.z),
        ContactSide::Pull => (excess::<true>(z, poke.z), poke.z - field.bounds[0]),
    };
    if above <= 0.0 {
        return None;
    }
    // Steps beyond which even the furthest height is allowed; one more for the rounding of the
    // quotient. Nothing over nothing is nothing.
    let steps = (furthest - cut.threshold()).max(0.0) / shape.shear + 1.0;
    let most = (field.grid.columns() + field.grid.rows()) as f64;
    let steps = if steps.is_nan() { 0.0 } else { steps.min(most) };
    Some(Cone { poke, reach: (steps as usize).min(cut.range() as usize) })
}

impl Cone {
    fn rect(&self, grid: &Grid) -> GridRect {
        let side = |at: u16, count: usize| {
            let (at, reach) = (usize::from(at), self.reach);
            [at.saturating_sub(reach), (at + reach + 1).min(count)].map(|end| end as u32)
        };
        let GridNode { column, row } = self.poke.node;
        GridRect { columns: side(column, grid.columns()), rows: side(row, grid.rows()) }
    }

    /// A height after this contact, and whether that moved it.
    #[inline(always)]
    fn one<const PULL: bool>(&self, z: f64, steps: u32, shear: f64, cut: Cut) -> (f64, bool) {
        let (allowed, threshold) = if steps == 0 {
            (self.poke.z, 0.0)
        } else {
            (height::<PULL>(self.poke.z, f64::from(steps), shear), cut.threshold())
        };
        let moves = excess::<PULL>(z, allowed) > threshold;
        (if moves { allowed } else { z }, moves)
    }

    /// Steps from the contact to a row, if it reaches that far.
    #[inline(always)]
    fn away(&self, row: usize) -> Option<usize> {
        let away = usize::from(self.poke.node.row).abs_diff(row);
        (away <= self.reach).then_some(away)
    }
}

/// A row at work.
struct Row<'a> {
    now: &'a mut [f64],
    rest: &'a [f64],
    row: usize,
    /// Columns that may be displaced.
    span: [usize; 2],
}

impl Row<'_> {
    /// Recovery and all contacts, the first of them in the same go as the recovery.
    #[inline(always)]
    fn press_all(
        &mut self,
        cones: &[Cone],
        shape: &Envelope,
        recovery: SurfaceRecovery,
        cut: Cut,
        counts: &mut MoveCounts,
    ) {
        let mut recovery = Some(recovery);
        for cone in cones {
            let Some(away) = cone.away(self.row) else {
                continue;
            };
            let column = usize::from(cone.poke.node.column);
            let reach = cone.reach - away;
            let end = self.now.len();
            let mut reached = [column.saturating_sub(reach), (column + reach + 1).min(end)];
            // Nodes beyond the reach are where a cone allows them, so that it may be laid over them as
            // well; but not beyond a range.
            let is_free = cone.reach < cut.range() as usize;
            if is_free {
                reached = join(self.span, reached);
                let over = (reached[1] - reached[0]).next_multiple_of(LANES);
                reached[1] = (reached[0] + over).min(end);
                reached[0] = reached[1].saturating_sub(over);
            }
            let step = match recovery.take() {
                Some(recovery) if is_free => recovery,
                other => {
                    self.recover(other);
                    SurfaceRecovery::NONE
                }
            };
            let moved = match cone.poke.side {
                ContactSide::Push => self.press::<false>(cone, away, reached, shape, step, cut),
                ContactSide::Pull => self.press::<true>(cone, away, reached, shape, step, cut),
            };
            self.span = join(self.span, reached);
            counts.moved += moved;
            counts.visited += reached[1] - reached[0];
        }
        self.recover(recovery);
    }

    #[inline(always)]
    fn recover(&mut self, recovery: Option<SurfaceRecovery>) {
        let [from, to] = self.span;
        if let Some(recovery) = recovery {
            recovery.step_row(&mut self.now[from..to], &self.rest[from..to]);
        }
    }

    /// Recovers and moves the nodes from column `from` to before `to`; how many a contact moved.
    #[inline(always)]
    fn press<const PULL: bool>(
        &mut self,
        cone: &Cone,
        away: usize,
        [from, to]: [usize; 2],
        shape: &Envelope,
        recovery: SurfaceRecovery,
        cut: Cut,
    ) -> usize {
        let column = usize::from(cone.poke.node.column);
        let (z, threshold, shear) = (cone.poke.z, cut.threshold(), shape.shear);
        let touched = recovery.step(self.now[column], self.rest[column]);
        let first = self.now.len() - 1 - column;
        let steps = &shape.steps[first + from..first + to];
        let (now, rest) = (&mut self.now[from..to], &self.rest[from..to]);
        let mut moved = 0;
        let far = away as f64;
        for ((now, &rest), steps) in now.iter_mut().zip(rest).zip(steps) {
            let free = recovery.step(*now, rest);
            let allowed = height::<PULL>(z, far + steps, shear);
            let moves = excess::<PULL>(free, allowed) > threshold;
            *now = if moves { allowed } else { free };
            moved += usize::from(moves);
        }
        if away == 0 {
            // The touched node itself: no threshold, and no product of nothing and an infinite limit.
            let counted = excess::<PULL>(touched, height::<PULL>(z, 0.0, shear)) > threshold;
            let moves = excess::<PULL>(touched, z) > 0.0;
            self.now[column] = if moves { z } else { touched };
            moved = moved + usize::from(moves) - usize::from(counted);
        }
        moved
    }
}

/// The furthest that a node so many steps from a contact may be.
#[inline(always)]
pub(super) fn height<const PULL: bool>(z: f64, steps: f64, shear: f64) -> f64 {
    let slope = shear * steps;
    if PULL { z - slope } else { z + slope }
}

#[inline(always)]
fn join(a: [usize; 2], b: [usize; 2]) -> [usize; 2] {
    match (a[0] < a[1], b[0] < b[1]) {
        (false, _) => b,
        (_, false) => a,
        _ => [a[0].min(b[0]), a[1].max(b[1])],
    }
}
