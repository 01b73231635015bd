//! Fits of the sessions shown, and the prediction of one session by the fit of another.

use palpate_analysis::fit::{FitRecipe, IntervalRequest, SourceFit};
use palpate_analysis::progress::Progress;
use palpate_analysis::source::SourceSelection;
use palpate_model::signal::track::{SEGMENT, SignalTrack, TrackSegment};
use palpate_model::units::Newtons;
use palpate_rheology::fit::{FitOptions, FitReport, FitSample, ProfileInterval};
use std::path::PathBuf;
use std::sync::Arc;

/// Column of the modelled force in N.
pub const MODELLED: usize = 0;
/// Column of measured minus modelled force in mN; a gap where the force did not count.
pub const RESIDUAL: usize = 1;

/// A session to fit, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct FitSubject {
    pub path: PathBuf,
    /// What it is called on the screen.
    pub name: String,
    /// The analysis by which it is read.
    pub analysis: Option<String>,
    /// Key of the model family; none for the modified Kelvin model of third order.
    pub family: Option<String>,
    pub is_rejected_included: bool,
    /// Time in s since its first sample of the first one that is fitted.
    pub ramp_t: f64,
}

impl FitSubject {
    fn options(&self) -> Result<FitOptions, String> {
        match &self.family {
            Some(key) => FitOptions::by_key(key).map_err(|err| err.to_string()),
            None => Ok(FitOptions::default()),
        }
    }
}

/// The fit of a session.
#[derive(Clone, Debug)]
pub struct SessionFit {
    pub report: FitReport,
    /// Intervals from the profile likelihood, or why there are none.
    pub profile: Result<Vec<ProfileInterval>, String>,
    /// Modelled force and residual over the session's time.
    pub track: SignalTrack,
    /// Remarks of the reader of the session.
    pub notes: Vec<String>,
}

/// The force of a session as the fit of another predicts it.
#[derive(Clone, Debug)]
pub struct SessionPrediction {
    /// Of the first session.
    pub fit: FitReport,
    /// Predicted force and residual over the time of the second session.
    pub track: SignalTrack,
    /// RMSE.
    pub rms_n: f64,
    /// The highest measured force.
    pub peak_n: f64,
    pub predicted_peak_n: f64,
    /// Number of samples compared.
    pub samples: usize,
}

fn samples_of(subject: &FitSubject) -> Result<SourceFit, String> {
    let is_rejected_included = subject.is_rejected_included;
    let wanted = SourceSelection { is_rejected_included, ..SourceSelection::default() };
    let recipe = FitRecipe {
        analysis: subject.analysis.clone(),
        ..FitRecipe::new(subject.options()?, wanted)
    };
    recipe.fit(&subject.path).map_err(|err| err.to_string())
}

/// Modelled forces in N and residuals in mN, from the start of the ramp.
fn track_of(samples: &[FitSample], modelled: &[Newtons], ramp_t: f64) -> SignalTrack {
    let mut track = SignalTrack::default();
    for (samples, modelled) in samples.chunks(SEGMENT).zip(modelled.chunks(SEGMENT)) {
        let residual = samples.iter().zip(modelled).map(|(one, fit)| match one.is_measured() {
            true => ((one.force.0 - fit.0) * 1e3) as f32,
            false => f32::NAN,
        });
        let columns = [modelled.iter().map(|fit| fit.0 as f32).collect(), residual.collect()];
        let times = samples.iter().map(|one| ramp_t + one.t.0).collect();
        track.push(Arc::new(TrackSegment::new(times, &columns)));
    }
    track
}

pub fn fit_session(subject: &FitSubject) -> Result<SessionFit, String> {
    let fitted = samples_of(subject)?;
    let report = fitted.result.clone().map_err(|err| err.to_string())?;
    let modelled = report.predict(&fitted.samples);
    let options = subject.options()?;
    let wanted = IntervalRequest { with_profile: true, bootstrap: None };
    let found = fitted.intervals(&options, wanted, |_| ());
    let profile = found.map(|found| found.profile).map_err(|err| err.to_string());
    Ok(SessionFit {
        track: track_of(&fitted.samples, &modelled, subject.ramp_t),
        report,
        profile,
        notes: fitted.notes,
    })
}

pub type FitAnswer = (FitSubject, Result<Arc<SessionFit>, String>);

/// Fits sessions one after the other.
pub fn fit_sessions(
    subjects: &[FitSubject],
    progress: &dyn Progress,
) -> Result<Vec<FitAnswer>, String> {
    let mut answers = Vec::with_capacity(subjects.len());
    for (number, subject) in subjects.iter().enumerate() {
        if progress.report(number, subjects.len(), &subject.name).is_break() {
            return Err("cancelled".into());
        }
        answers.push((subject.clone(), fit_session(subject).map(Arc::new)));
    }
    Ok(answers)
}

/// Fits the first session and predicts the force at the depths of the second.
pub fn predict(
    pair: &[FitSubject; 2],
    progress: &dyn Progress,
) -> Result<SessionPrediction, String> {
    let [known, other] = pair;
    if progress.report(0, 2, "fitting the first").is_break() {
        return Err("cancelled".into());
    }
    let fit = samples_of(known)?.result.map_err(|err| err.to_string())?;
    if progress.report(1, 2, "predicting the second").is_break() {
        return Err("cancelled".into());
    }
    let samples = samples_of(other)?.samples;
    let modelled = fit.predict(&samples);
    let pairs = || samples.iter().zip(&modelled).filter(|(one, _)| one.is_measured());
    let count = pairs().count();
    if count == 0 {
        return Err(
            "the second session has no measured force to compare with the prediction".into()
        );
    }
    let squares: f64 = pairs().map(|(one, fit)| (one.force.0 - fit.0).powi(2)).sum();
    let highest = |forces: &mut dyn Iterator<Item = f64>| forces.fold(f64::NEG_INFINITY, f64::max);
    Ok(SessionPrediction {
        track: track_of(&samples, &modelled, other.ramp_t),
        rms_n: (squares / count as f64).sqrt(),
        peak_n: highest(&mut pairs().map(|(one, _)| one.force.0)),
        predicted_peak_n: highest(&mut pairs().map(|(_, fit)| fit.0)),
        samples: count,
        fit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_analysis::progress::NoProgress;
    use palpate_analysis::session_actions::{Attribution, set_data_quality};
    use palpate_sessions::edits::DataQuality;
    use std::path::Path;

    fn recorded() -> FitSubject {
        FitSubject {
            path: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions/ramp-hold-lab"),
            name: "recorded".to_owned(),
            analysis: None,
            family: None,
            is_rejected_included: false,
            ramp_t: 3.0,
        }
    }

    #[test]
    fn residuals_have_the_rmse_of_the_report() {
        let found = fit_session(&recorded()).unwrap();
        let values: Vec<f32> =
            found.track.segments().iter().flat_map(|one| one.values(RESIDUAL).to_vec()).collect();
        let squares: f64 = values.iter().map(|one| f64::from(*one).powi(2)).sum();
        let rms_n = (squares / values.len() as f64).sqrt() * 1e-3;
        assert_eq!(values.len(), found.report.samples);
        assert!((rms_n / found.report.rmse_n - 1.0).abs() < 1e-3, "{rms_n}");
        assert!((found.track.span().unwrap()[0] - 3.0).abs() < 1e-9);
        assert!(found.profile.unwrap().len() >= 5);
    }

    #[test]
    fn a_rejected_session_is_fitted_only_where_that_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hair");
        std::fs::create_dir(&path).unwrap();
        for file in std::fs::read_dir(recorded().path).unwrap() {
            let file = file.unwrap().path();
            std::fs::copy(&file, path.join(file.file_name().unwrap())).unwrap();
        }
        let who = Attribution { by: "Ada".into(), reason: "a hair".into() };
        set_data_quality(&path, DataQuality::Rejected, &who).unwrap();
        let mut subject = FitSubject { path, ..recorded() };
        assert!(fit_session(&subject).unwrap_err().contains("a hair"));
        let pair = [recorded(), subject.clone()];
        assert!(predict(&pair, &NoProgress).unwrap_err().contains("a hair"));
        subject.is_rejected_included = true;
        assert!(fit_session(&subject).is_ok());
    }

    #[test]
    fn a_session_predicts_itself_as_well_as_it_is_fitted() {
        let pair = [recorded(), recorded()];
        let found = predict(&pair, &NoProgress).unwrap();
        assert!((found.rms_n - found.fit.rmse_n).abs() < 1e-9);
        assert!((found.peak_n - found.predicted_peak_n).abs() < 0.05 * found.peak_n);
        let gone = FitSubject { path: "/nowhere/at-all".into(), ..recorded() };
        let refused = predict(&[gone.clone(), recorded()], &NoProgress);
        assert!(refused.unwrap_err().contains("/nowhere/at-all"));
        let answers = fit_sessions(&[gone, recorded()], &NoProgress).unwrap();
        assert!(answers[0].1.is_err() && answers[1].1.is_ok());
    }
}
