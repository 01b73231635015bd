//! The checks that a good operator makes after a run: each a rank, a sentence with its numbers, and the place in the curve.
//!
//! They advise; whether a session is valid, suspect or rejected is said by a person.

mod calibration;
mod force;

use crate::analysed_session;
use crate::catalog_search::session_folders;
use crate::fidelity;
use crate::fit::{FitRecipe, SourceFit};
use crate::progress::NoProgress;
use crate::source::{self, RecordStretch, SourceError, decisions, is_saturated, noise_of, records};
use palpate_model::assessment::{Assessment, QualityCheck, QualityRank, rank_of};
use palpate_model::rig::Phase;
use palpate_model::units::{Newtons, Volts};
use palpate_protocols::engine::{EndingKind, Record};
use palpate_rheology::fit::{FitSample, UnloadedMean};
use palpate_runner::base::FoundBase;
use palpate_sessions::checks::read_checks;
use palpate_sessions::{SampleRow, Session};
use std::path::Path;

use calibration::calibration_checks;
use force::{base, force_drop};

/// The search for contact presses tissue with no more than this, in N; more has preconditioned it.
const SEARCH_FORCE_MAX_N: f64 = 0.5;
/// A contact point is doubtful beyond this standard uncertainty in mm: over 30 mm it changes mu3 by half a percent.
const CONTACT_ERROR_MAX_MM: f64 = 0.05;
/// A zero may move by so much of the peak force: the 1 % that ASTM E4 allows a force. Five times as much is bad.
const DRIFT_SHARE: f64 = 0.01;
/// The zero after a run is the mean of so long, in s.
const ZERO_SECS: f64 = 5.0;
/// Noise may be so many times that of the last daily check, and ten times as much is bad: a loose plug multiplies it.
const NOISE_RATIO: f64 = 2.0;
/// More saturated samples than this share are bad: the fit has lost a part of the curve.
const SATURATED_SHARE: f64 = 0.01;
/// More missing samples than this share are bad.
const MISSING_SHARE: f64 = 0.001;
/// A run that was read, fitted and checked.
#[derive(Debug)]
pub struct AssessedRun {
    pub operator: String,
    pub quality: Assessment,
    pub fitted: Result<SourceFit, SourceError>,
}

/// Reads the session in a folder, fits it by the recipe's model and checks it; `library` knows the daily checks of its rig.
pub fn assess_folder(
    path: &Path,
    library: Option<&Path>,
    recipe: &FitRecipe,
) -> Result<AssessedRun, SourceError> {
    let opened = analysed_session::open(path, None)?;
    let session = opened.edited.session;
    let source = source::of_session(session.clone(), RecordStretch::RampHold, &opened.left_out_s);
    let fitted = source.and_then(|source| recipe.fit_read(source));
    let usual = usual_noise(&session, library);
    let quality = of_session(&session, fitted.as_ref().ok(), usual)?;
    Ok(AssessedRun { operator: session.manifest.operator, quality, fitted })
}

/// The checks of a session and its fit; none of it where it pressed nothing. `usual_noise` is that of the rig's daily check.
pub fn of_session(
    session: &Session,
    fitted: Option<&SourceFit>,
    usual_noise: Option<Volts>,
) -> Result<Assessment, SourceError> {
    let found = fidelity::of_session(session)?;
    let decisions = decisions(session)?;
    let records: Vec<(usize, &Record)> =
        records(&decisions).map(|(after, record)| (after as usize, record)).collect();
    let mut checks = vec![ending(session)];
    checks.push(noise(noise_of(&decisions), usual_noise));
    checks.push(missing(found.samples, found.dropped));
    if let Some(fitted) = fitted {
        let measured: Vec<FitSample> =
            fitted.samples.iter().filter(|one| one.is_measured()).copied().collect();
        let start = fitted.start.0;
        checks.insert(2, contact(session, &records));
        checks.push(saturation(session));
        checks.push(force_drop(&measured, start));
        checks.push(base(&measured, start, FoundBase::of_session(session).thickness_mm));
        checks.push(drift(fitted));
        checks.push(lack_of_fit(fitted));
    }
    checks.extend(calibration_checks(session));
    Ok(Assessment { checks })
}

/// The noise of the empty load cell in the last daily check of a session's rig, where the library has that check's session.
#[must_use]
pub fn usual_noise(session: &Session, library: Option<&Path>) -> Option<Volts> {
    let (library, rig) = (library?, session.manifest.rig.as_ref()?);
    let checks = read_checks(library, &rig.name).ok()?;
    let last = checks.last()?;
    let folder = session_folders(library, &NoProgress).ok()?.get(&last.session_id)?.clone();
    let checked = Session::open(&library.join(folder)).ok()?;
    let checked = decisions(&checked).ok()?;
    records(&checked).find_map(|(_, record)| match record {
        Record::Weighed { mass_g: 0.0, noise, .. } => Some(*noise),
        _ => None,
    })
}

fn ending(session: &Session) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("ending", rank, words);
    match &session.end {
        Some(end) if end.outcome == EndingKind::Finish.name() => {
            of(QualityRank::Good, "the run went to its end".into())
        }
        Some(end) => of(QualityRank::Bad, format!("the run did not finish: {}", end.reason)),
        None => of(QualityRank::Bad, "the recording was interrupted".into()),
    }
}

fn noise(found: Option<Volts>, usual: Option<Volts>) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("noise", rank, words);
    let Some(found) = found else {
        return of(QualityRank::NotJudged, "the run has no tare, so its noise is not known".into());
    };
    let mv = 1e3 * found.0;
    let Some(usual) = usual else {
        let words = format!("the noise is {mv:.2} mV; no daily check says what is usual here");
        return of(QualityRank::NotJudged, words);
    };
    let ratio = found.0 / usual.0;
    let rank = rank_of(ratio, NOISE_RATIO, 5.0 * NOISE_RATIO);
    let advice = match rank {
        QualityRank::Good => "",
        _ => "; look for a loose plug, a cable that moves, or a motor nearby",
    };
    let usual = 1e3 * usual.0;
    of(rank, format!("the noise is {mv:.2} mV, and {usual:.2} mV in the last daily check{advice}"))
}

fn missing(samples: u64, missing: u64) -> QualityCheck {
    let share = missing as f64 / (samples + missing).max(1) as f64;
    let of = |rank, words: String| QualityCheck::new("samples", rank, words);
    match missing {
        0 => of(QualityRank::Good, "no sample is missing".into()),
        missing => of(
            rank_of(share, 0.0, MISSING_SHARE),
            format!(
                "{missing} of {} samples are missing; close other programs on this computer",
                samples + missing
            ),
        ),
    }
}

/// Whether contact was found before the probe pressed, gently and well.
fn contact(session: &Session, records: &[(usize, &Record)]) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("contact", rank, words);
    let found = records.iter().find_map(|(after, record)| match record {
        Record::ContactFound { std_error_mm, .. } => Some((*after, *std_error_mm)),
        _ => None,
    });
    let pressed = session.rows.iter().position(|row| row.phase == Phase::Ramp);
    let Some((after, error)) =
        found.filter(|(after, _)| pressed.is_none_or(|first| *after <= first))
    else {
        return of(
            QualityRank::Doubtful,
            "the tissue was pressed before contact was searched for, so depths count from elsewhere"
                .into(),
        );
    };
    let before = session.rows.iter().take(after);
    let hardest = before.filter_map(|row| Some((row, row.force?)));
    let hardest = hardest.max_by(|one, other| one.1.total_cmp(&other.1));
    if let Some((row, force)) = hardest.filter(|(_, force)| *force > SEARCH_FORCE_MAX_N) {
        let at = row.host.seconds().0;
        let words = format!(
            "the tissue was pressed with {force:.2} N before contact was found, and may have changed by it"
        );
        return of(QualityRank::Doubtful, words).at(at, at);
    }
    let rank = rank_of(error, CONTACT_ERROR_MAX_MM, f64::INFINITY);
    of(rank, format!("contact was found to {:.1} µm before the probe pressed", 1e3 * error))
}

fn saturation(session: &Session) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("saturation", rank, words);
    let pressed = |row: &&SampleRow| matches!(row.phase, Phase::Ramp | Phase::Hold);
    let rows = || session.rows.iter().filter(pressed);
    let mut full = rows().filter(|row| is_saturated(session, row)).map(|row| row.host.seconds().0);
    let Some(first) = full.next() else {
        return of(
            QualityRank::Good,
            "the load cell stayed within the range of its converter".into(),
        );
    };
    let (last, count) = full.fold((first, 1), |(_, count), at| (at, count + 1));
    let share = f64::from(count) / rows().count() as f64;
    let words = format!(
        "{count} samples of ramp and hold are at an end of the converter's range; press less deep, or use a lower gain"
    );
    of(rank_of(share, 0.0, SATURATED_SHARE), words).at(first, last)
}

/// How far the zero moved from before the run to after it.
fn drift(fitted: &SourceFit) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("drift", rank, words);
    let unknown = |words: &str| of(QualityRank::NotJudged, words.into());
    let (Some(signal), Some(last)) = (&fitted.signal, fitted.samples.last()) else {
        return unknown("the signal out of contact was not recorded, so drift is not known");
    };
    let mean = |is_near: &dyn Fn(f64) -> bool| zero(&signal.unloaded, is_near);
    let before = mean(&|t| t < 0.0 && t > signal_end(&signal.unloaded, |t| t < 0.0) - ZERO_SECS);
    let after_from =
        signal.unloaded.iter().map(|one| one.t.0).find(|t| *t > last.t.0).unwrap_or(f64::INFINITY);
    let after = mean(&|t| t >= after_from && t < after_from + ZERO_SECS);
    let (Some((_, before)), Some((_, after))) = (before, after) else {
        return unknown("the zero was not seen before and after the run, so drift is not known");
    };
    let newtons = (after - before) / signal.curve.sensitivity_at(Newtons(0.0));
    let peak = fitted.samples.iter().filter(|one| one.is_measured());
    let peak = peak.map(|one| one.force.0).fold(0.0, f64::max);
    let share = newtons.abs() / peak;
    let words = format!(
        "the zero moved by {:.1} mN from before to after the run, {:.2} % of the peak force; the fit follows it",
        1e3 * newtons,
        100.0 * share
    );
    of(rank_of(share, DRIFT_SHARE, 5.0 * DRIFT_SHARE), words)
}

/// The last time at which this holds.
fn signal_end(unloaded: &[UnloadedMean], is_there: impl Fn(f64) -> bool) -> f64 {
    let times = unloaded.iter().map(|one| one.t.0).filter(|t| is_there(*t));
    times.fold(f64::NEG_INFINITY, f64::max)
}

/// Samples and mean signal in V out of contact at these times; `None` without any.
fn zero(unloaded: &[UnloadedMean], is_near: &dyn Fn(f64) -> bool) -> Option<(f64, f64)> {
    let near = unloaded.iter().filter(|one| is_near(one.t.0));
    let (count, sum) = near.fold((0.0, 0.0), |(count, sum), one| {
        (count + one.count as f64, sum + one.count as f64 * one.volts.0)
    });
    (count > 0.0).then(|| (count, sum / count))
}

fn lack_of_fit(fitted: &SourceFit) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("lack of fit", rank, words);
    match &fitted.result {
        Err(reason) => of(QualityRank::Doubtful, format!("there is no fit: {reason}")),
        Ok(report) => match report.lack_of_fit() {
            Some(sentence) => of(QualityRank::Doubtful, sentence.to_owned()),
            None => {
                let words = format!(
                    "the model describes the force to within its noise (R² {:.5}, {:.1} mN rms)",
                    report.r2,
                    1e3 * report.rmse_n
                );
                of(QualityRank::Good, words)
            }
        },
    }
}

#[cfg(test)]
mod tests;
