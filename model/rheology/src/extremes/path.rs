//! Speeds, depths and where they change.

use super::judge::{ExtremesRow, PathCase};
use super::members::make_member;
use super::subjects::FamilyBody;
use super::{ExtremesExtent, rows_of};
use crate::families::Family;
use std::sync::Arc;

pub(super) const GROUP: &str = "speed and depth";
const STEPS: u32 = 12;

pub(super) fn rows(
    extent: ExtremesExtent,
    family: &Arc<dyn Family>,
    progress: &mut dyn FnMut(f64),
) -> Vec<ExtremesRow> {
    let subject = FamilyBody(make_member(&**family, 1.0, 20.0, 2.0));
    rows_of(cases(extent), progress, |case| case.run_on(&subject))
}

/// Every path of this group; the body relaxes in 1 s.
pub(super) fn cases(extent: ExtremesExtent) -> Vec<PathCase> {
    let mut cases = Vec::new();
    let speeds: &[i32] = match extent {
        ExtremesExtent::Quick => &[-6, 0, 3],
        ExtremesExtent::Whole | ExtremesExtent::Soak => &[-6, -5, -4, -3, -2, -1, 0, 1, 2, 3],
    };
    for &speed in speeds {
        cases.push(ramp(
            format!("1e{speed} mm/s to 10 mm and 1 s of hold"),
            10f64.powi(speed),
            10.0,
        ));
    }
    cases.push(stationary("speed 0 at 10 mm", 10.0));
    let depths: &[i32] = match extent {
        ExtremesExtent::Quick => &[-6, 2],
        ExtremesExtent::Whole | ExtremesExtent::Soak => &[-9, -6, -3, -2, -1, 0, 1, 2, 3],
    };
    for &depth in depths {
        let depth_mm = 10f64.powi(depth);
        cases.push(ramp(format!("1 mm/s to 1e{depth} mm and 1 s of hold"), 1.0, depth_mm));
    }
    cases.push(stationary("depth 0", 0.0));
    cases.push(stationary("-1e3 mm, far out of contact", -1e3));
    cases.extend(special_paths());
    cases
}

/// Down in [`STEPS`] steps, then a hold of 1 s in as many, then back out in one.
fn ramp(case: String, speed: f64, depth: f64) -> PathCase {
    let dt = depth / speed / f64::from(STEPS);
    let down = (1..=STEPS).map(|i| (dt, depth * f64::from(i) / f64::from(STEPS)));
    let hold = (0..STEPS).map(|_| (1.0 / f64::from(STEPS), depth));
    let out = [(2.0 * depth / speed, -depth), (0.5, -depth)];
    PathCase::new(GROUP, case, 0.0, down.chain(hold).chain(out).collect())
}

fn stationary(case: &str, depth: f64) -> PathCase {
    PathCase::new(GROUP, case, depth, vec![(0.1, depth); STEPS as usize])
}

/// Paths that touch the surface awkwardly, jump or crawl.
fn special_paths() -> Vec<PathCase> {
    let path = |case: &str, start: f64, steps: &[(f64, f64)]| {
        PathCase::new(GROUP, case, start, steps.to_vec())
    };
    let mut crossings = Vec::new();
    for _ in 0..8 {
        crossings.extend([(0.01, 1e-3), (0.01, -1e-3)]);
    }
    vec![
        path(
            "the probe touches the surface at the very end of a step, in the last 1e-12 of its duration",
            -1.0,
            &[(1.0, 1e-12), (1.0, 2e-12)],
        ),
        path(
            "the probe leaves the surface at the very end of a step, in the last 1e-12 of its duration",
            5.0,
            &[(1.0, 5.0), (1e3, -1e-12), (1e-3, -1e-12), (1.0, 4.0)],
        ),
        path(
            "ends exactly at the surface",
            -3.0,
            &[(1.0, 0.0), (1.0, 4.0), (1.0, 0.0), (1.0, -4.0)],
        ),
        path("crosses the surface sixteen times", -1e-3, &crossings),
        path("1e3 mm in one step and back", -1e3, &[(1.0, 1e3), (1.0, -1e3), (1.0, 1e3)]),
        path(
            "a move of 1e-12 mm at 10 mm",
            10.0,
            &[(1e-3, 10.000_000_000_001), (1e-3, 10.0), (1.0, 10.0)],
        ),
        path(
            "a jump of 1e-9 mm at 1e3 mm and a jump back",
            1e3,
            &[(0.0, 1_000.000_000_001), (1.0, 1_000.000_000_001), (0.0, 1e3)],
        ),
        path(
            "a jump to 10 mm, a hold of 1 s and a jump out",
            -1.0,
            &[(0.0, 10.0), (0.5, 10.0), (0.5, 10.0), (0.0, -1.0), (1.0, -1.0)],
        ),
        path(
            "alternating steps of 1e-9 s and 1e3 s",
            0.0,
            &[
                (1e-9, 1.0),
                (1e3, 2.0),
                (1e-9, 3.0),
                (1e3, 3.0),
                (1e-9, 2.0),
                (1e3, 10.0),
                (1e-9, 10.0),
            ],
        ),
    ]
}
