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

/// Why depths stay corrected by the measured force.
const NOT_DESCRIBED: &str = "depths are corrected for machine compliance by the measured force, because the model does not describe the record";
const NOT_SETTLED: &str = "depths are corrected for machine compliance by the measured force, because the rig gives way about as much as the tissue; measure on a stiffer rig";

/// One record of a fit, whose depths move where they were corrected.
pub(super) struct CorrectedRecord<'a> {
    pub samples: &'a mut Vec<FitSample>,
    pub raw: Option<&'a RawDepths>,
}

/// Corrects depths by the forces of the reports that `fit` gives, one for each record. They stay corrected by the measured
/// force where the model does not describe a record, where there is no fit, and where the depths do not settle: then it
/// tells why.
pub(super) fn settle(
    records: &mut [CorrectedRecord<'_>],
    fit: impl Fn(&[&[FitSample]]) -> Result<Vec<FitReport>, FitError>,
) -> Option<&'static str> {
    if records.iter().all(|one| one.raw.is_none()) {
        return None;
    }
    let measured: Vec<Vec<FitSample>> = records.iter().map(|one| one.samples.clone()).collect();
    let reason = settle_or_tell(records, fit).err();
    if reason.is_some() {
        for (record, measured) in records.iter_mut().zip(measured) {
            *record.samples = measured;
        }
    }
    reason
}

fn settle_or_tell(
    records: &mut [CorrectedRecord<'_>],
    fit: impl Fn(&[&[FitSample]]) -> Result<Vec<FitReport>, FitError>,
) -> Result<(), &'static str> {
    let mut before = f64::INFINITY;
    for _ in 0..ROUNDS {
        let samples: Vec<&[FitSample]> = records.iter().map(|one| one.samples.as_slice()).collect();
        let reports = fit(&samples).map_err(|_| NOT_DESCRIBED)?;
        if reports.iter().any(|report| report.lack_of_fit().is_some()) {
            return Err(NOT_DESCRIBED);
        }
        let pairs = records.iter().zip(&reports);
        let forces: Vec<_> = pairs.map(|(one, report)| report.predict(one.samples)).collect();
        if forces.iter().flatten().any(|force| !force.0.is_finite()) {
            return Err(NOT_SETTLED);
        }
        let changes = records.iter_mut().zip(&forces).filter_map(|(record, forces)| {
            record.raw.map(|raw| raw.correct_by(forces, record.samples))
        });
        let change = changes.fold(0.0, f64::max);
        if change < SETTLED_MM {
            return Ok(());
        }
        if change >= before {
            break;
        }
        before = change;
    }
    Err(NOT_SETTLED)
}
