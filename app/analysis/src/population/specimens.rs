//! The curves of a study, and between which curves those of most specimens of its population lie.

use super::curves::Curve;
use super::design::Design;
use crate::study_table::StudyRow;
use palpate_figures::thin::thin;
use palpate_model::random::SplitMix;
use palpate_population::{PopulationFit, Study};
use palpate_rheology::families::find_family;
use palpate_rheology::fit::{FitReport, FitSample};

/// Specimens that a band is drawn from: its edges are their fifth from either end.
const SPECIMENS: usize = 200;
const OUTSIDE: usize = 5;
/// Most specimens that are tried for these: of fewer than half the model says nothing, and a band would say too much.
const TRIES_MAX: usize = 2 * SPECIMENS;
/// Columns in which samples that lie above each other are drawn as two.
const COLUMNS: usize = 300;
const CONTACT: &str = "x_contact";
const OFFSET: &str = "f_offset";
/// Most curves that are drawn.
const CURVES_MAX: usize = 200;

/// The curves of the sessions that have one value of an entry, and those that the population expects.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveKind {
    /// The value, or that all sessions are meant.
    pub name: String,
    /// Force in N over time from contact in s.
    pub curves: Vec<Vec<[f64; 2]>>,
    /// That of the median specimen, and between which 95 % of specimens lie.
    pub median: Vec<[f64; 2]>,
    pub band: [Vec<[f64; 2]>; 2],
}

/// Curves of all kinds, those of the population along the motion of one session; none where the model does not describe more than half
/// of the specimens.
#[derive(Clone, Debug, PartialEq)]
pub struct PopulationCurves {
    pub kinds: Vec<CurveKind>,
    /// The session whose motion it is.
    pub motion_of: String,
}

pub(super) fn curves(
    design: &Design,
    rows: &[StudyRow],
    records: &[&Curve],
    reports: &[FitReport],
    population: (&Study, &PopulationFit),
) -> Option<PopulationCurves> {
    let (first, motion) = (reports.first()?, records.first()?);
    let mut random = SplitMix::seeded(1);
    let mut kinds: Vec<CurveKind> = Vec::new();
    for (name, columns) in design.kinds("sessions") {
        let [low, median, high] =
            expected(first, &motion.samples, &columns, population, &mut random)?;
        kinds.push(CurveKind { name, curves: Vec::new(), median, band: [low, high] });
    }
    for ((row, record), report) in rows.iter().zip(records).zip(reports).take(CURVES_MAX) {
        let force = record.samples.iter().map(|sample| sample.force.0);
        let curve = from_contact(report, &record.samples, force);
        kinds[design.kind_of(row)].curves.push(thin(curve.iter().copied(), COLUMNS));
    }
    Some(PopulationCurves { kinds, motion_of: rows.first()?.session.clone() })
}

/// Forces without the offset of the session, from contact.
fn from_contact(
    report: &FitReport,
    samples: &[FitSample],
    forces: impl Iterator<Item = f64>,
) -> Vec<[f64; 2]> {
    let value = |name: &str| {
        report.parameters.iter().find(|one| one.name == name).map_or(0.0, |one| one.value)
    };
    let (contact, offset) = (value(CONTACT), value(OFFSET));
    let inside = samples.iter().position(|sample| sample.depth.0 > contact).unwrap_or(0);
    let start = samples.get(inside).map_or(0.0, |sample| sample.t.0);
    let points = samples.iter().zip(forces).skip(inside);
    let points = points.filter(|(_, force)| force.is_finite());
    points.map(|(sample, force)| [sample.t.0 - start, force - offset]).collect()
}

/// The lower edge, the median specimen and the upper edge.
fn expected(
    report: &FitReport,
    samples: &[FitSample],
    columns: &[f64],
    (study, fit): (&Study, &PopulationFit),
    random: &mut SplitMix,
) -> Option<[Vec<[f64; 2]>; 3]> {
    let outer = find_family(&report.body.family).ok()?.outer();
    let count = study.parameters.len();
    let mean = |k: usize| -> f64 {
        let own = fit.effects.iter().skip(k).step_by(count);
        own.zip(columns).map(|(effect, column)| column * effect.value).sum()
    };
    let deviation = |k: usize| -> f64 {
        let own = fit.standard_deviations.iter().skip(k).step_by(count);
        own.map(|one| one.value.powi(2)).sum::<f64>().sqrt()
    };
    // None of a specimen that the family does not describe, such as one with an exponent beyond its range.
    let forces = |shifts: &[f64]| {
        let values = (0..count).map(|k| (mean(k) + deviation(k) * shifts[k]).exp());
        let values: Vec<(&str, f64)> =
            study.parameters.iter().map(String::as_str).zip(values).collect();
        let is_allowed = |name: &str, value: f64| {
            outer.iter().all(|one| one.name != name || one.range.allows(value).is_ok())
        };
        if !values.iter().all(|(name, value)| is_allowed(name, *value)) {
            return None;
        }
        let report = report.clone().with_values(values.into_iter().chain([(OFFSET, 0.0)]));
        let forces = report.predict(samples).into_iter().map(|force| force.0);
        let forces: Vec<f64> = forces.collect();
        forces.iter().all(|force| force.is_finite()).then_some(forces)
    };
    let median = forces(&vec![0.0; count])?;
    let specimens = (0..TRIES_MAX).filter_map(|_| {
        let shifts: Vec<f64> = (0..count).map(|_| random.normal()).collect();
        forces(&shifts)
    });
    let specimens: Vec<Vec<f64>> = specimens.take(SPECIMENS).collect();
    if specimens.len() < SPECIMENS {
        return None;
    }
    let mut edges = [Vec::new(), Vec::new()];
    for sample in 0..samples.len() {
        let mut all: Vec<f64> = specimens.iter().map(|one| one[sample]).collect();
        all.sort_by(f64::total_cmp);
        edges[0].push(all[OUTSIDE]);
        edges[1].push(all[SPECIMENS - 1 - OUTSIDE]);
    }
    let base = report.clone().with_values([(OFFSET, 0.0)]);
    // The same samples of each, which an edge and its opposite must have.
    let stride = (samples.len() / COLUMNS).max(1);
    let line = |forces: Vec<f64>| {
        let whole = from_contact(&base, samples, forces.into_iter());
        whole.into_iter().step_by(stride).collect()
    };
    let [low, high] = edges.map(line);
    Some([low, line(median), high])
}
