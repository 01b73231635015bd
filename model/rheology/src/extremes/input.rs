//! Inputs that are not numbers, and times that do not increase.

use super::fits::{DEFAULT_FIT, fit_answer};
use super::judge::{ExpectedAnswer, ExtremesRow, PathCase, judge};
use super::members::make_member;
use super::records::ramp_hold;
use super::subjects::FamilyBody;
use super::{ExtremesExtent, ExtremesPart};
use crate::families::{Family, PowerSeries};
use crate::fit::FitSample;
use palpate_model::units::{Depth, Newtons, Seconds};
use std::sync::Arc;

pub(super) const GROUP: &str = "input";

pub(super) fn rows(
    _: ExtremesExtent,
    family: &Arc<dyn Family>,
    _: &mut dyn FnMut(f64),
) -> Vec<ExtremesRow> {
    let usual = || make_member(&**family, 1.0, 20.0, 2.0);
    let mut rows = Vec::new();
    for (case, start, step) in [
        ("NaN depth at the start", f64::NAN, (0.1, 1.0)),
        ("infinite depth at the start", f64::INFINITY, (0.1, 1.0)),
        ("NaN depth in a step", 0.0, (0.1, f64::NAN)),
        ("infinite depth in a step", 0.0, (0.1, f64::INFINITY)),
        ("minus infinite depth in a step", 0.0, (0.1, f64::NEG_INFINITY)),
        ("NaN duration of a step", 0.0, (f64::NAN, 1.0)),
        ("infinite duration of a step", 0.0, (f64::INFINITY, 1.0)),
        ("negative duration of a step", 0.0, (-0.1, 1.0)),
    ] {
        let path = PathCase::new(GROUP, case, start, vec![(0.1, 0.5), step, (0.1, 1.0)]);
        rows.push(path.run_on(&FamilyBody(usual())));
    }
    rows.push(after_bad_steps(&**family));
    let plain = |case: &str| PathCase::new(GROUP, case, 0.0, vec![(0.1, 1.0), (0.1, 1.0)]);
    for (name, value) in
        [("NaN", f64::NAN), ("infinite", f64::INFINITY), ("negative infinite", f64::NEG_INFINITY)]
    {
        let mut model = usual();
        model.linear[0] = value;
        rows.push(plain(&format!("{name} coefficient")).run_on(&FamilyBody(model)));
        for index in 0..usual().outer.len() {
            let mut model = usual();
            model.outer[index] = value;
            let name = format!("{name} relaxation time or other non-linear parameter");
            rows.push(plain(&name).run_on(&FamilyBody(model)));
        }
    }
    for index in 0..usual().outer.len() {
        for value in [0.0, -1.0] {
            let mut model = usual();
            model.outer[index] = value;
            let name = format!("relaxation time or other non-linear parameter of {value}");
            rows.push(plain(&name).run_on(&FamilyBody(model)));
        }
    }
    rows.extend(record_rows(family, &format!("fit of {}", family.key())));
    rows
}

/// Refused steps leave a body as it was.
fn after_bad_steps(family: &dyn Family) -> ExtremesRow {
    struct BodyAfterRefusals(FamilyBody);
    impl super::judge::ExtremesSubject for BodyAfterRefusals {
        fn name(&self) -> String {
            self.0.name()
        }

        fn terms(&self) -> Result<Vec<crate::families::RelaxationTerm>, String> {
            self.0.terms()
        }

        fn forces(&self, path: &PathCase) -> Result<Vec<f64>, String> {
            let mut body =
                (self.0.0).at_rest_from(Depth(path.start)).map_err(|err| err.to_string())?;
            let mut forces = Vec::new();
            for &(dt, depth) in &path.steps {
                for (bad_dt, bad_depth) in [(0.1, f64::NAN), (-1.0, 3.0), (1e-300, 1e300)] {
                    if let Ok(force) = body.step(Depth(bad_depth), Seconds(bad_dt)) {
                        return Ok(vec![force.0]);
                    }
                }
                let force = body.step(Depth(depth), Seconds(dt));
                forces.push(force.map_err(|err| err.to_string())?.0);
            }
            Ok(forces)
        }
    }
    let steps = vec![(0.1, 1.0), (0.5, 9.0), (0.2, 9.0), (0.1, 4.0)];
    let path = PathCase::new(GROUP, "refused steps between valid steps", 0.0, steps);
    path.run_on(&BodyAfterRefusals(FamilyBody(make_member(family, 1.0, 20.0, 2.0))))
}

/// A good record with one sample spoilt, put to a fit that must refuse it.
fn record_rows(family: &Arc<dyn Family>, subject: &str) -> Vec<ExtremesRow> {
    type Spoil = fn(&mut Vec<FitSample>);
    let spoilt: [(&str, Spoil); 14] = [
        ("a NaN time", |all| all[7].t = Seconds(f64::NAN)),
        ("an infinite time at the end", |all| {
            if let Some(last) = all.last_mut() {
                last.t = Seconds(f64::INFINITY);
            }
        }),
        ("a NaN depth", |all| all[7].depth = Depth(f64::NAN)),
        ("an infinite depth", |all| all[7].depth = Depth(f64::INFINITY)),
        ("a NaN force", |all| all[7].force = Newtons(f64::NAN)),
        ("an infinite force", |all| all[7].force = Newtons(f64::NEG_INFINITY)),
        ("a NaN uncertainty", |all| all[7].sigma = Newtons(f64::NAN)),
        ("an uncertainty of zero", |all| all[7].sigma = Newtons(0.0)),
        ("a negative uncertainty", |all| all[7].sigma = Newtons(-0.02)),
        ("a duplicate time", |all| all[7].t = all[6].t),
        ("a backward time", |all| all.swap(6, 7)),
        ("every force censored", |all| {
            all.iter_mut().for_each(|one| one.sigma = Newtons(f64::INFINITY));
        }),
        ("constant force", |all| {
            all.iter_mut().for_each(|one| one.force = Newtons(1.5));
        }),
        ("never in contact", |all| {
            all.iter_mut().for_each(|one| one.depth.0 -= 100.0);
        }),
    ];
    let rows = spoilt.into_iter().map(|(case, spoil)| {
        let mut samples = ramp_hold(60);
        spoil(&mut samples);
        let answer = fit_answer(Arc::clone(family), &samples, None);
        judge(GROUP, case, subject, ExpectedAnswer::Refusal, 0.0, answer)
    });
    rows.collect()
}

/// The same records for the fit of the thesis body.
pub(super) fn thesis_part() -> ExtremesPart {
    ExtremesPart::new(GROUP, DEFAULT_FIT.to_owned(), |_| {
        let family: Arc<dyn Family> = Arc::new(PowerSeries::THESIS);
        record_rows(&family, DEFAULT_FIT)
    })
}
