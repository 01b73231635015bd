//! Depths corrected for machine compliance by the force that the fit itself predicts.
//!
//! The measured force bends no rig with its noise, its drift or its averaging; the force of the body does. It is known only
//! with the fit, so fit and correction take turns until the depths stay.

use crate::compliance::RawDepths;
use palpate_rheology::fit::{FitError, FitReport, FitSample};

/// A depth that moves by less, in mm, is settled: a hundredth of what a contact position is uncertain by on a good day.
const SETTLED_MM: f64 = 1e-5;
/// Each round leaves of the change before it the share by which the tissue is softer than the rig: a tenth and less on a rig
/// worth the name. More rounds than these mean a rig that gives way as much as the tissue.
const ROUNDS: usize = 10;

/// One record of a fit, whose depths move where they were corrected.
pub(super) struct CorrectedRecord<'a> {
    pub samples: &'a mut Vec<FitSample>,
    pub raw: Option<&'a RawDepths>,
}

/// Corrects depths by the forces of the reports that `fit` gives, one for each record. They stay corrected by the measured
/// force where the model does not describe a record, where there is no fit, and where the depths do not settle.
pub(super) fn settle(
    records: &mut [CorrectedRecord<'_>],
    fit: impl Fn(&[&[FitSample]]) -> Result<Vec<FitReport>, FitError>,
) {
    if records.iter().all(|one| one.raw.is_none()) {
        return;
    }
    let measured: Vec<Vec<FitSample>> = records.iter().map(|one| one.samples.clone()).collect();
    let mut before = f64::INFINITY;
    for _ in 0..ROUNDS {
        let samples: Vec<&[FitSample]> = records.iter().map(|one| one.samples.as_slice()).collect();
        let Ok(reports) = fit(&samples) else { break };
        let pairs = records.iter().zip(&reports);
        let forces: Vec<_> = pairs.map(|(one, report)| report.predict(one.samples)).collect();
        let is_described = reports.iter().all(|report| report.lack_of_fit().is_none());
        if !is_described || forces.iter().flatten().any(|force| !force.0.is_finite()) {
            break;
        }
        let changes = records.iter_mut().zip(&forces).filter_map(|(record, forces)| {
            record.raw.map(|raw| raw.correct_by(forces, record.samples))
        });
        let change = changes.fold(0.0, f64::max);
        if change < SETTLED_MM {
            return;
        }
        if change >= before {
            break;
        }
        before = change;
    }
    for (record, measured) in records.iter_mut().zip(measured) {
        *record.samples = measured;
    }
}
