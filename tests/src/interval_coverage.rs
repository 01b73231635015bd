//! How often the intervals of a fit hold the truth: sessions recorded on simulated rigs, one a seed.

use palpate_analysis::fit::{IntervalRequest, JointFitRequest, fit_together};
use palpate_analysis::recordings::{Recording, Recordings};
use palpate_analysis::source::{self, RecordStretch};
use palpate_drivers::sim::{RigWithTruth, SimCell, SimProfile, SimRig, SimSettings};
use palpate_model::MmPerS;
use palpate_model::calibration::Calibration;
use palpate_protocols::engine::{Effect, Record};
use palpate_protocols::plans::RampHold;
use palpate_rheology::fit::{FitOptions, FitReport, JointReport, fit_joint};
use palpate_runner::programme::calibration_from_session;
use palpate_sessions::Session;
use std::fmt::Write;
use std::sync::mpsc::sync_channel;

use crate::built_in_plan;
use crate::recorded_runs::{record_plan, record_ramp_hold};

/// What is looked at, in the order of all tables.
pub const NAMES: [&str; 6] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig", "x_contact"];

/// One parameter of one seed, in shares of its true value; contact in mm.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoverageDraw {
    pub error: f64,
    pub std_error: f64,
    /// Standard uncertainty of everything.
    pub total_error: f64,
    pub is_covered: bool,
    pub is_covered_in_total: bool,
}

/// Draws of all parameters of one seed.
pub type CoverageDraws = [CoverageDraw; 6];

/// What is measured, and on which rig.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoverageCase {
    pub settings: SimSettings,
    /// Weights that the calibration of a cell of its own leaves out.
    pub is_short_of_weights: bool,
    /// A second run at this speed in mm/s on the same specimen, the body shared.
    pub second_speed: Option<f64>,
}

impl CoverageCase {
    /// Names of all cases.
    pub const NAMES: [&str; 6] = ["ideal", "lab", "fast", "speeds", "own", "few-weights"];

    /// The case of a name.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn named(name: &str) -> Self {
        let lab = SimSettings::default();
        let own = SimSettings { cell: SimCell::Own, ..lab };
        let of = |settings| Self { settings, ..Self::default() };
        match name {
            "ideal" => of(SimSettings { profile: SimProfile::Ideal, ..lab }),
            "lab" => of(lab),
            "fast" => of(SimSettings { rate: "20000".parse().expect("a rate"), ..lab }),
            "speeds" => Self { second_speed: Some(1.5), ..of(lab) },
            "own" => of(own),
            "few-weights" => Self { is_short_of_weights: true, ..of(own) },
            other => panic!("there is no case {other}; give any of {:?}", Self::NAMES),
        }
    }
}

/// Fits of one seed: in volts, and in newtons beside it.
#[derive(Clone, Copy, Debug, Default)]
pub struct SeedDraws {
    pub signal: CoverageDraws,
    pub force: CoverageDraws,
}

/// The contact position that depths count from, in mm from home.
fn contact_of(session: &Session) -> f64 {
    let effects = session.entries.iter().rev();
    let mut effects = effects.filter_map(|entry| serde_json::from_value(entry.body.clone()).ok());
    effects
        .find_map(|effect| match effect {
            Effect::Record(Record::ContactFound { position, .. }) => Some(position.0),
            _ => None,
        })
        .expect("a contact position")
}

/// The calibration that the protocol measures on the rig of these settings.
fn measured_calibration(case: &CoverageCase) -> Calibration {
    let masses: &[_] = match case.is_short_of_weights {
        true => &[("masses", "140 g, 340 g, 440 g, 640 g, 740 g, 940 g")],
        false => &[],
    };
    let rig = SimRig::new(case.settings);
    let document = rig.calibration();
    let plan = built_in_plan("load-cell-calibration", masses);
    let session = record_plan(Box::new(rig), document, plan);
    calibration_from_session(&session, "measured").expect("a calibration")
}

/// One ramp and hold as a recording, and what was true.
fn recorded(
    settings: SimSettings,
    calibration: &Calibration,
    speed: Option<f64>,
) -> (Recording, [f64; 6]) {
    let rig = SimRig::new(settings);
    let (sender, truths) = sync_channel(1);
    let watched = Box::new(RigWithTruth::new(
        rig,
        Box::new(move |rig| {
            let _ = sender.send(rig.truth());
        }),
    ));
    let mut params = RampHold::default();
    if let Some(speed) = speed {
        params.speed = MmPerS(speed);
    }
    let session = record_ramp_hold(watched, calibration.clone(), params);
    let truth = truths.recv().expect("the rig is switched off");
    let contact = contact_of(&session);
    let source = source::of_session(session, RecordStretch::RampHold, &[]).expect("a session");
    let body = truth.body;
    let contact_error = truth.surface_counted().0 - contact;
    let [mu1, mu2, mu3] = body.mu;
    let values = [body.tau_eps, mu1, mu2, mu3, body.tau_sig, contact_error];
    (Recording::of(format!("{speed:?}"), source, None), values)
}

/// Records what the case asks for and fits it as `palpate fit` does.
///
/// # Panics
/// If the run or the fit fails.
#[must_use]
pub fn draw(case: &CoverageCase) -> SeedDraws {
    let calibration = match case.settings.cell {
        SimCell::Own => measured_calibration(case),
        SimCell::Document => SimRig::new(case.settings).calibration(),
    };
    let (first, truth) = recorded(case.settings, &calibration, None);
    let mut all = vec![first];
    if case.second_speed.is_some() {
        all.push(recorded(case.settings, &calibration, case.second_speed).0);
    }
    let options = FitOptions::default();
    let shared = if all.len() > 1 { vec!["body"] } else { Vec::new() };
    let records = Recordings { all, notes: Vec::new() };
    let borrowed = records.borrowed();
    let body = if shared.is_empty() { Vec::new() } else { options.body_names() };
    let force = fit_joint(&borrowed, &options, &body).expect("a fit");
    let request = JointFitRequest {
        options: &options,
        shared,
        is_systematic: true,
        intervals: IntervalRequest::default(),
    };
    let signal = fit_together(&records, &request, |_, _| ()).expect("a fit");
    let of = |report: &JointReport| draws_of(&report.records[0].report, &truth);
    SeedDraws { signal: of(&signal.report), force: of(&force) }
}

fn draws_of(report: &FitReport, truth: &[f64; 6]) -> CoverageDraws {
    std::array::from_fn(|k| {
        let one = report.parameter(NAMES[k]).expect("a parameter");
        let scale = if k < 5 { truth[k].abs() } else { 1.0 };
        let std_error = one.std_error.unwrap_or(0.0);
        let holds = |interval: Option<[f64; 2]>| {
            interval.is_some_and(|[low, high]| (low..=high).contains(&truth[k]))
        };
        CoverageDraw {
            error: (one.value - truth[k]) / scale,
            std_error: std_error / scale,
            total_error: std_error.hypot(one.systematic_error.unwrap_or(0.0)) / scale,
            is_covered: holds(one.ci95),
            is_covered_in_total: holds(one.total95.or(one.ci95)),
        }
    })
}

/// Draws of these seeds on so many threads.
#[must_use]
pub fn draws(case: CoverageCase, seeds: std::ops::Range<u64>, threads: u64) -> Vec<SeedDraws> {
    let of = |seed| {
        let settings = SimSettings { seed, ..case.settings };
        draw(&CoverageCase { settings, ..case })
    };
    let part = |k| seeds.clone().filter(move |seed| seed % threads == k);
    let (part, of) = (&part, &of);
    std::thread::scope(|scope| {
        let handles: Vec<_> = (0..threads)
            .map(|k| scope.spawn(move || part(k).map(of).collect::<Vec<_>>()))
            .collect();
        handles.into_iter().flat_map(|one| one.join().expect("draws")).collect()
    })
}

/// What many draws of a parameter come to.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoverageSummary {
    pub bias: f64,
    pub spread: f64,
    pub stated: f64,
    pub total: f64,
    pub covered: usize,
    pub covered_in_total: usize,
    pub count: usize,
}

/// For each parameter, in percent of its value; contact in um.
#[must_use]
pub fn summarise(draws: &[CoverageDraws]) -> [CoverageSummary; 6] {
    std::array::from_fn(|k| {
        let unit = if k < 5 { 100.0 } else { 1000.0 };
        let count = draws.len() as f64;
        let mean = |of: &dyn Fn(&CoverageDraw) -> f64| {
            draws.iter().map(|one| unit * of(&one[k])).sum::<f64>() / count
        };
        let bias = mean(&|one| one.error);
        let square = draws.iter().map(|one| (unit * one[k].error - bias).powi(2)).sum::<f64>();
        CoverageSummary {
            bias,
            spread: (square / (count - 1.0)).sqrt(),
            stated: mean(&|one| one.std_error),
            total: mean(&|one| one.total_error),
            covered: draws.iter().filter(|one| one[k].is_covered).count(),
            covered_in_total: draws.iter().filter(|one| one[k].is_covered_in_total).count(),
            count: draws.len(),
        }
    })
}

/// A table in Markdown.
#[must_use]
pub fn table(title: &str, draws: &[CoverageDraws]) -> String {
    let mut text = format!(
        "{title}, {} seeds\n\n| parameter | bias | spread | stated | `ci95` covers | in total | `total95` covers |\n|---|---|---|---|---|---|---|\n",
        draws.len()
    );
    for (name, one) in NAMES.iter().zip(summarise(draws)) {
        let percent = |count: usize| 100.0 * count as f64 / one.count as f64;
        let _ = writeln!(
            text,
            "| {name} | {:+.4} | {:.4} | {:.4} | {:.1} % | {:.4} | {:.1} % |",
            one.bias,
            one.spread,
            one.stated,
            percent(one.covered),
            one.total,
            percent(one.covered_in_total)
        );
    }
    text
}
