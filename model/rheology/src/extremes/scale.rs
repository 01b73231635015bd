//! Small and large numbers: forces 1e-6..1e6 N, the ends of the doubles, subnormal numbers.

use super::judge::{ExtremesRow, PathCase};
use super::members::make_member;
use super::subjects::FamilyBody;
use super::{ExtremesExtent, rows_of};
use crate::families::{Family, Model};
use std::sync::Arc;

pub(super) const GROUP: &str = "scale";
/// A subnormal number: below 2.2e-308 doubles lack digits.
const SUBNORMAL: f64 = 1e-310;

/// Families of more terms than this leave out the ends of the doubles when it has to be quick.
const MANY: usize = 12;

pub(super) fn rows(
    extent: ExtremesExtent,
    family: &Arc<dyn Family>,
    progress: &mut dyn FnMut(f64),
) -> Vec<ExtremesRow> {
    let cases = cases(extent, &**family);
    rows_of(cases, progress, |(path, model)| path.run_on(&FamilyBody(model)))
}

/// Down to `depth` and back in steps of `dt`.
fn poke(case: String, depth: f64, dt: f64) -> PathCase {
    let shares = [0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 0.5, -0.5, -0.5, 1.0];
    let steps = shares.map(|share| (dt, share * depth)).to_vec();
    PathCase::new(GROUP, case, -0.5 * depth, steps)
}

fn cases(extent: ExtremesExtent, family: &dyn Family) -> Vec<(PathCase, Model)> {
    let mut cases = Vec::new();
    let forces: &[i32] = match extent {
        ExtremesExtent::Quick => &[-6, 6, 290, 307],
        ExtremesExtent::Whole | ExtremesExtent::Soak => &[
            -300, -250, -190, -100, -6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6, 100, 290, 299, 307,
        ],
    };
    for force in forces {
        let model = make_member(family, 1.0, 20.0, 10f64.powi(*force));
        cases.push((poke(format!("forces of 1e{force} N"), 20.0, 0.1), model));
    }
    let usual = || make_member(family, 1.0, 20.0, 2.0);
    let has_many = usual().terms().is_ok_and(|terms| terms.len() > MANY);
    let lengths: &[i32] = match extent {
        ExtremesExtent::Quick if has_many => &[],
        ExtremesExtent::Quick => &[-100, 100],
        ExtremesExtent::Whole | ExtremesExtent::Soak => &[-300, -100, -30, 30, 100, 300],
    };
    for length in lengths {
        cases.push((poke(format!("depths of 1e{length} mm"), 10f64.powi(*length), 0.1), usual()));
        let time = 10f64.powi(*length);
        cases.push((
            poke(format!("time steps and relaxation times of 1e{length} s"), 20.0, 0.1 * time),
            make_member(family, time, 20.0, 2.0),
        ));
        let long_steps = format!("time steps of 1e{length} s, relaxation times of 1 s");
        cases.push((poke(long_steps, 20.0, time), usual()));
        cases.push((
            poke(format!("time steps of 0.1 s, relaxation times of 1e{length} s"), 20.0, 0.1),
            make_member(family, time, 20.0, 2.0),
        ));
    }
    cases.push((poke("subnormal depths".to_owned(), SUBNORMAL, 0.1), usual()));
    cases.push((poke("subnormal steps".to_owned(), 20.0, SUBNORMAL), usual()));
    let gentle = poke("subnormal steps and depths".to_owned(), 20.0 * SUBNORMAL, SUBNORMAL);
    cases.push((gentle, usual()));
    cases.push((
        poke("subnormal relaxation times".to_owned(), 20.0, 0.1),
        make_member(family, SUBNORMAL, 20.0, 2.0),
    ));
    let mut weak = usual();
    weak.linear.fill(SUBNORMAL);
    cases.push((poke("subnormal coefficients".to_owned(), 20.0, 0.1), weak));
    let mut none = usual();
    none.linear.fill(0.0);
    cases.push((poke("coefficients of zero".to_owned(), 20.0, 0.1), none));
    cases
}
