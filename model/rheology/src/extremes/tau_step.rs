//! Relaxation times 1e-9..1e9 s against steps 1e-9..1e3 s.

use super::ExtremesExtent;
use super::judge::{ExtremesRow, PathCase};
use super::members::make_member;
use super::subjects::FamilyBody;
use crate::families::Family;
use std::sync::Arc;

pub(super) const GROUP: &str = "relaxation time and step";

/// Depths in mm of the path: in from outside, down, hold, partly back and down again, out and in.
const DEPTHS: [f64; 20] = [
    0.5, 2.0, 4.0, 6.0, 8.0, 10.0, 10.0, 10.0, 10.0, 7.0, 4.0, 6.0, 8.0, 3.0, -2.0, -2.0, -2.0,
    1.0, 10.0, 10.0,
];

/// Families of more terms than this take every third power of ten outside a soak: their reference takes
/// half a minute for all.
const MANY: usize = 12;

/// Powers of ten of relaxation times and of steps.
pub(super) fn decades(extent: ExtremesExtent) -> [Vec<i32>; 2] {
    match extent {
        ExtremesExtent::Quick => [vec![-9, 0, 9], vec![-9, -3, 3]],
        ExtremesExtent::Whole | ExtremesExtent::Soak => [(-9..=9).collect(), (-9..=3).collect()],
    }
}

pub(super) fn rows(
    extent: ExtremesExtent,
    family: &Arc<dyn Family>,
    progress: &mut dyn FnMut(f64),
) -> Vec<ExtremesRow> {
    let [mut taus, steps] = decades(extent);
    let probe = make_member(&**family, 1.0, 20.0, 2.0);
    if extent == ExtremesExtent::Whole && probe.terms().is_ok_and(|terms| terms.len() > MANY) {
        taus.retain(|tau| tau % 3 == 0);
    }
    let mut rows = Vec::new();
    for (index, tau) in taus.iter().enumerate() {
        let subject = FamilyBody(make_member(&**family, 10f64.powi(*tau), 20.0, 2.0));
        for step in &steps {
            let dt = 10f64.powi(*step);
            let case = format!("tau 1e{tau} s, step 1e{step} s");
            let steps = DEPTHS.iter().map(|&depth| (dt, depth)).collect();
            rows.push(PathCase::new(GROUP, case, -1.0, steps).run_on(&subject));
        }
        progress((index + 1) as f64 / taus.len() as f64);
    }
    rows
}
