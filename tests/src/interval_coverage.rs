//! How often the intervals of a fit hold the truth: sessions recorded on simulated rigs, one a seed.

use palpate_analysis::compliance::{
    ComplianceCorrections, LATEST_COMPLIANCE, compliance_from_session,
};
use palpate_analysis::fit::{IntervalRequest, JointFitRequest, fit_together};
use palpate_analysis::recordings::{Recording, Recordings};
use palpate_analysis::source::{self, RecordStretch};
use palpate_drivers::sim::{RigWithTruth, SimCell, SimProfile, SimRig, SimSettings};
use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_model::calibration::Calibration;
use palpate_model::rig::{HandAction, RigCommand, RigDescription};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, MmPerS, Nanos, Seconds};
use palpate_protocols::engine::{Effect, Record};
use palpate_protocols::plans::RampHold;
use palpate_rheology::fit::{
    FitOptions, FitSolution, FittedParameter, JointReport, LiveFit, fit_joint,
};
use palpate_runner::programme::calibration_from_session;
use palpate_sessions::Session;
use palpate_sessions::document_store::save_document;
use std::fmt::Write;
use std::ops::Range;
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
    /// Half of the width of the statistical interval.
    pub half: f64,
    pub is_covered: bool,
    /// Error of the middle of the total interval, and half of its width.
    pub total_error: f64,
    pub total_half: f64,
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
    /// Speed and hold of the run; those of the thesis otherwise.
    pub press: Option<(MmPerS, Seconds)>,
    /// A second run at this speed in mm/s on the same specimen, the body shared.
    pub second_speed: Option<f64>,
    /// Whether the rig gives way, and how much is measured on a stiff surface before.
    pub is_soft: bool,
}

/// The stiff surface gives way by this much itself, in mm/N, which the simulated rig's maker says.
const SURFACE_MM_PER_N: f64 = 1e-3;

impl CoverageCase {
    /// Names of all cases.
    pub const NAMES: [&str; 7] = ["ideal", "lab", "soft", "fast", "speeds", "own", "few-weights"];

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
            "soft" => Self {
                is_soft: true,
                ..of(SimSettings { compliance: "60".parse().expect("a compliance"), ..lab })
            },
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
    /// What the live fit says at the end of the run; it knows no contact position.
    pub live: CoverageDraws,
    /// Whether the 95 % band of the fit in volts holds the true force of a run at [`HELD_OUT_SPEED`], at
    /// [`HELD_OUT_TIMES`].
    pub held_out: [bool; 4],
}

/// Speed in mm/s of a run that is predicted, twice that of the run that is fitted.
pub const HELD_OUT_SPEED: f64 = 1.5;
/// Times in s of that run: in its middle, at its end, and in the hold of it.
pub const HELD_OUT_TIMES: [f64; 4] = [10.0, 20.0, 22.0, 60.0];

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

/// The machine compliance that the protocol measures on the rig of these settings.
fn measured_compliance(settings: SimSettings) -> ComplianceCorrections {
    let rig = SimRig::new(settings);
    let calibration = rig.calibration();
    let measured = |seed| {
        let rig = SimRig::new(SimSettings { seed, ..settings });
        let plan = built_in_plan("stiff-surface", &[]);
        compliance_from_session(&record_plan(Box::new(rig), calibration.clone(), plan), None).ok()
    };
    // Presses whose line bends are refused, and made again.
    let mut again = (0..20).map(|k| settings.seed + 100_000 * k);
    let mut found = again.find_map(measured).expect("a compliance");
    found.mm_per_n -= SURFACE_MM_PER_N;
    let library = tempfile::tempdir().expect("a folder");
    save_document(library.path(), &found).expect("a stored compliance");
    ComplianceCorrections::named(LATEST_COMPLIANCE, Some(library.path())).expect("it is in force")
}

/// A simulated rig that has stood for longer than a run takes, so that no noise of a run of the same seed comes again. Its
/// clocks begin at zero all the same.
struct LaterRig {
    rig: Box<dyn Rig>,
    since: Nanos,
}

/// Ticks that the rig has stood.
const STOOD: u64 = 600_000;

impl LaterRig {
    fn new(mut rig: Box<dyn Rig>, tick_nanos: u64) -> Self {
        let since = Nanos(STOOD * tick_nanos);
        while rig.next_event(since).is_some() {}
        Self { rig, since }
    }
}

impl Rig for LaterRig {
    fn description(&self) -> &RigDescription {
        self.rig.description()
    }

    fn send(&mut self, command: RigCommand) {
        self.rig.send(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let mut event = self.rig.next_event(Nanos(until.0 + self.since.0))?;
        event.at = event.at.since(self.since);
        if let RigEventBody::Reading(reading) = &mut event.body {
            reading.tick -= STOOD;
        }
        Some(event)
    }

    fn is_virtual(&self) -> bool {
        true
    }

    fn apply_hand_action(&mut self, action: HandAction) {
        self.rig.apply_hand_action(action);
    }
}

/// One ramp and hold as a recording, and what was true. One of a speed of its own is the second on its specimen.
///
/// # Panics
/// If the run fails or its compliance cannot be measured.
#[must_use]
pub fn recorded(
    case: &CoverageCase,
    calibration: &Calibration,
    speed: Option<f64>,
) -> (Recording, [f64; 6]) {
    let settings = case.settings;
    let rig = SimRig::new(settings);
    let (sender, truths) = sync_channel(1);
    let watched = Box::new(RigWithTruth::new(
        rig,
        Box::new(move |rig| {
            let _ = sender.send(rig.truth());
        }),
    ));
    let mut params = RampHold::default();
    if let Some((speed, hold)) = case.press {
        (params.speed, params.hold) = (speed, hold);
    }
    if let Some(speed) = speed {
        params.speed = MmPerS(speed);
    }
    let rig: Box<dyn Rig> = match speed {
        // The second run on a specimen has noise and drift of its own.
        Some(_) => Box::new(LaterRig::new(watched, settings.tick_nanos())),
        None => watched,
    };
    let session = record_ramp_hold(rig, calibration.clone(), params);
    let truth = truths.recv().expect("the rig is switched off");
    let contact = contact_of(&session);
    let read = source::of_session(session, RecordStretch::RampHold, &[]);
    let mut source = read.expect("a session");
    let compliance = case.is_soft.then(|| measured_compliance(settings));
    let compliance = compliance.and_then(|known| known.apply(&mut source).expect("it is applied"));
    let body = truth.body;
    let contact_error = truth.surface_counted().0 - contact;
    let [mu1, mu2, mu3] = body.mu;
    let values = [body.tau_eps, mu1, mu2, mu3, body.tau_sig, contact_error];
    (Recording::of(format!("{speed:?}"), source, compliance), values)
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
    let (first, truth) = recorded(case, &calibration, None);
    let mut all = vec![first];
    if case.second_speed.is_some() {
        all.push(recorded(case, &calibration, case.second_speed).0);
    }
    let options = FitOptions::default();
    let shared = if all.len() > 1 { vec!["body"] } else { Vec::new() };
    let mut records = Recordings { all, notes: Vec::new() };
    let borrowed = records.borrowed();
    let body = if shared.is_empty() { Vec::new() } else { options.body_names() };
    let force = fit_joint(&borrowed, &options, &body).expect("a fit");
    let request = JointFitRequest {
        options: &options,
        shared,
        is_systematic: true,
        intervals: IntervalRequest::default(),
    };
    let signal = fit_together(&mut records, &request, |_, _| ()).expect("a fit");
    let of = |report: &JointReport| draws_of(&report.records[0].report.parameters, &truth);
    let mut live = LiveFit::new(RampHold::default().depth);
    for sample in &records.all[0].samples {
        live.push(sample.t, sample.depth, sample.force, sample.sigma);
    }
    let live = draws_of(&live.estimate().expect("an estimate").parameters, &truth);
    let held_out = held_out(&records, case.settings.cell, &options, &truth);
    SeedDraws { signal: of(&signal.report), force: of(&force), live, held_out }
}

/// Whether the bands of the first record's fit hold true forces at another speed.
fn held_out(
    records: &Recordings,
    cell: SimCell,
    options: &FitOptions,
    truth: &[f64; 6],
) -> [bool; 4] {
    let mut fitted =
        FitSolution::fit_signals(&records.signals()[..1], options, &[]).expect("a fit");
    if cell == SimCell::Own {
        let with_errors =
            records.systematic(|traced| fitted.clone().with_traced_errors(&traced[..1]));
        fitted = with_errors.expect("a fit").unwrap_or(fitted);
    }
    let path: Vec<(Seconds, Depth)> = (0..=6000)
        .map(|k| {
            let t = 0.01 * f64::from(k);
            (Seconds(t), Depth((HELD_OUT_SPEED * t).min(RampHold::default().depth.0)))
        })
        .collect();
    let [tau_eps, mu1, mu2, mu3, tau_sig, _] = *truth;
    let body = ModifiedKelvin { tau_eps, mu: [mu1, mu2, mu3], tau_sig };
    let mut state = KelvinState::at_rest();
    let forces: Vec<f64> = path
        .iter()
        .map(|(t, depth)| state.step(&body, *depth, Seconds(if t.0 == 0.0 { 0.0 } else { 0.01 })).0)
        .collect();
    let band = fitted.predict_band(0, &path).expect("a band");
    HELD_OUT_TIMES.map(|t| {
        let k = (100.0 * t).round() as usize;
        let [low, high] = band[k].ci95;
        (low.0..=high.0).contains(&forces[k])
    })
}

fn draws_of(parameters: &[FittedParameter], truth: &[f64; 6]) -> CoverageDraws {
    std::array::from_fn(|k| {
        let Some(one) = parameters.iter().find(|one| one.name == NAMES[k]) else {
            return CoverageDraw::default();
        };
        let scale = if k < 5 { truth[k].abs() } else { 1.0 };
        let std_error = one.std_error.unwrap_or(0.0);
        let holds = |interval: Option<[f64; 2]>| {
            interval.is_some_and(|[low, high]| (low..=high).contains(&truth[k]))
        };
        let [low, high] = one.total95.or(one.ci95).unwrap_or_default();
        CoverageDraw {
            error: (one.value - truth[k]) / scale,
            std_error: std_error / scale,
            half: one.ci95.map_or(0.0, |[low, high]| 0.5 * (high - low) / scale),
            is_covered: holds(one.ci95),
            total_error: (0.5 * (low + high) - truth[k]) / scale,
            total_half: 0.5 * (high - low) / scale,
            is_covered_in_total: holds(one.total95.or(one.ci95)),
        }
    })
}

/// Draws of these seeds on so many threads.
#[must_use]
pub fn draws(case: CoverageCase, seeds: Range<u64>, threads: u64) -> Vec<SeedDraws> {
    let of = |seed| {
        let settings = SimSettings { seed, ..case.settings };
        draw(&CoverageCase { settings, ..case })
    };
    by_seeds(seeds, threads, of)
}

/// What `of` makes of each seed, on so many threads.
pub(crate) fn by_seeds<T: Send>(
    seeds: Range<u64>,
    threads: u64,
    of: impl Fn(u64) -> T + Sync,
) -> Vec<T> {
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
    pub covered: usize,
    pub total_bias: f64,
    pub total_spread: f64,
    /// A half of the total interval over 1.96, the standard uncertainty of a normal error.
    pub total_stated: f64,
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
        let spread = |of: &dyn Fn(&CoverageDraw) -> f64| {
            let middle = mean(of);
            let square = draws.iter().map(|one| (unit * of(&one[k]) - middle).powi(2));
            (square.sum::<f64>() / (count - 1.0)).sqrt()
        };
        CoverageSummary {
            bias: mean(&|one| one.error),
            spread: spread(&|one| one.error),
            stated: mean(&|one| one.std_error),
            total_bias: mean(&|one| one.total_error),
            total_spread: spread(&|one| one.total_error),
            total_stated: mean(&|one| one.total_half) / 1.96,
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
        "{title}, {} seeds\n\n| parameter | bias | spread | stated | `ci95` covers | bias in total | spread | stated | `total95` covers |\n|---|---|---|---|---|---|---|---|---|\n",
        draws.len()
    );
    for (name, one) in NAMES.iter().zip(summarise(draws)) {
        let percent = |count: usize| 100.0 * count as f64 / one.count as f64;
        let _ = writeln!(
            text,
            "| {name} | {:+.4} | {:.4} | {:.4} | {:.1} % | {:+.4} | {:.4} | {:.4} | {:.1} % |",
            one.bias,
            one.spread,
            one.stated,
            percent(one.covered),
            one.total_bias,
            one.total_spread,
            one.total_stated,
            percent(one.covered_in_total)
        );
    }
    text
}
