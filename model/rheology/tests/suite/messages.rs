//! The words of what fits, steps and curves refuse.

use palpate_rheology::families::StepError;
use palpate_rheology::fit::FitError;
use palpate_rheology::integrators::IntegratorError;
use palpate_rheology::select::HoldOutError;
use palpate_rheology::trade::CurveError;
use palpate_test_support::assert_messages;

#[test]
fn what_a_fit_refuses_is_worded() {
    let name = || "mu1".to_owned();
    assert_messages! {
        FitError::TooFewSamples { samples: 5, parameters: 7 } => ["5 sample", "7 free"],
        FitError::NotFinite { index: 7, what: "force", value: f64::NAN } => ["sample 7", "force", "NaN"],
        FitError::Scale { what: "largest depth", value: 1e60, unit: "mm" } => ["largest depth", "1e60 mm"],
        FitError::SigmaNotPositive { index: 3, sigma: 0.0 } => ["sample 3", "0 N"],
        FitError::TimeNotIncreasing { index: 4, t: 1.0, before: 2.0 } => ["sample 4", "1 s", "2 s"],
        FitError::NeverInTissue { deepest: -1.0, contact: 0.5 } => ["-1 mm", "0.5 mm"],
        FitError::Inseparable { names: vec!["mu1".into(), "tau_sig".into()], advice: "hold longer".into() } => ["mu1", "tau_sig", "hold longer"],
        FitError::InRecord { record: "slow.csv".into(), reason: Box::new(FitError::Overflow) } => ["slow.csv", "not finite"],
        FitError::NotShareable { name: name(), known: "mu2".into() } => ["mu1", "mu2"],
        FitError::TooFewBlocks { blocks: 3, needed: 20 } => ["3 independent block", "20"],
        FitError::ConstantForce { force: 3.0 } => ["3 N"],
        FitError::ConstantDepth { depth: 5.0 } => ["5 mm"],
        FitError::UnknownParameter { name: name(), known: "mu2".into() } => ["'mu1'", "mu2"],
        FitError::BadValue { name: name(), value: -1.0, reason: "give 0 or more" } => ["mu1", "-1", "give 0 or more"],
        FitError::Unsupported { family: "kelvin".into(), reason: "it has no unloading".into() } => ["kelvin", "it has no unloading"],
        FitError::Overflow => ["not finite"],
    }
}

#[test]
fn what_a_step_refuses_is_worded() {
    let (from, to, dt) = (1.0, 2.0, 0.5);
    assert_messages! {
        StepError::Depth(f64::NAN) => ["NaN mm"],
        StepError::Time(-1.0) => ["-1 s"],
        StepError::Jump { from, to } => ["1 mm", "2 mm"],
        StepError::Speed { from, to, dt } => ["1 mm", "2 mm", "0.5 s"],
        StepError::Rest { depth: 3.0 } => ["3 mm"],
        StepError::Overflow { from, to, dt } => ["1 mm", "2 mm", "0.5 s"],
    }
    assert_messages! {
        IntegratorError::Time(0.0) => ["0 s"],
        IntegratorError::Unstable { name: "explicit Euler", dt: 2.1, h: 2.1, limit: 2.0 } => ["explicit Euler", "2.1 s", "2.000"],
    }
}

#[test]
fn what_a_selection_and_stored_curves_refuse_is_worded() {
    assert_messages! {
        HoldOutError::Unknown("weather".into()) => ["'weather'"],
        HoldOutError::AllAlike { what: "speed", records: 2 } => ["speed", "2 record"],
        HoldOutError::NoSpecimen { record: "slow.csv".into() } => ["slow.csv"],
    }
    let what = || "the fit at 10 Hz".to_owned();
    assert_messages! {
        CurveError::Format(2) => ["format 2"],
        CurveError::Number { what: what(), value: -1.0 } => ["the fit at 10 Hz", "-1"],
        CurveError::Contradiction(what()) => ["the fit at 10 Hz"],
        CurveError::Error { what: what(), stored: 1e-3, found: 2e-3 } => ["the fit at 10 Hz", "1e-3", "2e-3"],
        CurveError::Missing(what()) => ["the fit at 10 Hz"],
    }
}
