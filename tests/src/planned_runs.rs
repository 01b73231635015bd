//! Runs of planned protocols, each planned from a first run on the same specimen.

use crate::interval_coverage::{CoverageCase, by_seeds, draw, recorded};
use palpate_analysis::plan::{PlanAssumptions, PlanRequest, PlanningRig, plan};
use palpate_analysis::recordings::Recordings;
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::rig::Limits;
use palpate_model::units::{MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_protocols::plans::RampHold;
use palpate_rheology::expected::{FreeOffsets, PrecisionTarget, ProtocolFamily};
use palpate_rheology::fit::{FitOptions, FitSolution};
use std::ops::Range;

/// One planned run; the relaxation time in percent of its true value.
#[derive(Clone, Debug)]
pub struct PlannedRun {
    pub assumed: PlanAssumptions,
    /// Planned time in tissue in s.
    pub secs: f64,
    pub error: f64,
    /// Half of the interval that its fit states.
    pub stated: f64,
}

/// A ramp and hold as planned: its speed, its hold, and its time in tissue in s.
pub type PlannedPress = (MmPerS, Seconds, f64);

/// What `palpate plan --like` takes from one run of a case.
///
/// # Panics
/// If the run or the fit fails.
#[must_use]
pub fn plan_assumptions(case: &CoverageCase) -> PlanAssumptions {
    let (recording, _) = recorded(case, &SimRig::new(case.settings).calibration(), None);
    let records = Recordings { all: vec![recording], notes: Vec::new() };
    let fitted = FitSolution::fit_signals(&records.signals(), &FitOptions::default(), &[]);
    let fitted = fitted.expect("a fit");
    let report = fitted.report();
    let value = |name| report.value(name).expect("a parameter");
    PlanAssumptions {
        body: ModifiedKelvin {
            tau_eps: value("tau_eps"),
            mu: ["mu1", "mu2", "mu3"].map(value),
            tau_sig: value("tau_sig"),
        },
        noise: Newtons(report.rmse_n),
        signal: fitted.expected_signal(),
        source: "one run".into(),
        is_hardly_known: false,
        notes: Vec::new(),
    }
}

/// The ramp and hold that finds the relaxation time within so many percent.
///
/// # Panics
/// If there is none.
#[must_use]
pub fn planned_press(assumed: PlanAssumptions, percent: f64) -> PlannedPress {
    let rig = SimRig::new(SimSettings::default());
    let curve = rig.calibration().curve().expect("a curve");
    let limits = Limits::for_travel(rig.description().travel);
    let request = PlanRequest {
        targets: vec![PrecisionTarget::new("tau", percent).expect("a target")],
        unknowns: FreeOffsets::default(),
        white: None,
        memory: None,
        sample_rate_hz: 1000.0,
        depth: RampHold::default().depth,
        force_max: None,
        speed_max: None,
        duration_max: Seconds(3600.0),
        command: &|_| String::new(),
    };
    let rig = PlanningRig { rig: rig.description(), limits: &limits, curve: &curve };
    let report = plan(request, assumed, rig).expect("a plan");
    let mut all = report.proposals.into_iter().map(|offer| offer.proposal);
    let press = all.find_map(|proposal| match proposal.family {
        ProtocolFamily::RampHold { speed, hold } => {
            Some((speed, hold, proposal.expected.duration.0))
        }
        _ => None,
    });
    press.expect("a ramp and hold")
}

/// A first run on the specimen of each seed, the plan like it, and the planned run.
#[must_use]
pub fn planned_runs(
    case: CoverageCase,
    percent: f64,
    seeds: Range<u64>,
    threads: u64,
) -> Vec<PlannedRun> {
    let of = |seed| {
        let case = CoverageCase { settings: SimSettings { seed, ..case.settings }, ..case };
        let assumed = plan_assumptions(&case);
        let (speed, hold, secs) = planned_press(assumed.clone(), percent);
        let found = draw(&CoverageCase { press: Some((speed, hold)), ..case }).signal[0];
        PlannedRun { assumed, secs, error: 100.0 * found.error, stated: 100.0 * found.half }
    };
    by_seeds(seeds, threads, of)
}
