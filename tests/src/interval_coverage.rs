//! How often the intervals of a fit hold the truth: sessions recorded on simulated rigs, one a seed.

use palpate_analysis::fit::SourceFit;
use palpate_analysis::source::{self, RecordStretch};
use palpate_drivers::sim::{SimRig, SimSettings, SimTruth};
use palpate_drivers::{Rig, RigEvent};
use palpate_model::Nanos;
use palpate_model::rig::{HandAction, RigCommand, RigDescription, SensorReading};
use palpate_protocols::engine::{Effect, Record};
use palpate_protocols::plans::RampHold;
use palpate_rheology::fit::{FitOptions, fit};
use palpate_sessions::Session;
use std::sync::{Arc, Mutex};

use crate::recorded_runs::record_ramp_hold;

/// What is looked at, in the order of all tables.
pub const NAMES: [&str; 6] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig", "x_contact"];

/// One parameter of one seed, in shares of its true value; contact in mm.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoverageDraw {
    pub error: f64,
    pub std_error: f64,
    pub is_covered: bool,
}

/// The fit in volts, and the fit in newtons beside it.
#[derive(Clone, Debug, Default)]
pub struct CoverageDraws {
    pub signal: Vec<[CoverageDraw; 6]>,
    pub force: Vec<[CoverageDraw; 6]>,
}

/// A rig whose truth can be looked at while another thread holds it.
struct WatchedRig(SimRig, Arc<Mutex<SimTruth>>);

impl Rig for WatchedRig {
    fn description(&self) -> &RigDescription {
        self.0.description()
    }
    fn send(&mut self, command: RigCommand) {
        self.0.send(command);
    }
    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let event = self.0.next_event(until);
        if let Ok(mut truth) = self.1.lock() {
            *truth = self.0.truth();
        }
        event
    }
    fn is_virtual(&self) -> bool {
        true
    }
    fn take_sensors(&mut self) -> Vec<SensorReading> {
        self.0.take_sensors()
    }
    fn apply_hand_action(&mut self, action: HandAction) {
        self.0.apply_hand_action(action);
    }
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

/// Records a ramp and hold and fits it as it would be by `palpate fit`.
///
/// # Panics
/// If the run or the fit fails.
#[must_use]
pub fn draw(settings: SimSettings) -> [[CoverageDraw; 6]; 2] {
    let rig = SimRig::new(settings);
    let calibration = rig.calibration();
    let truth = Arc::new(Mutex::new(rig.truth()));
    let watched = Box::new(WatchedRig(rig, Arc::clone(&truth)));
    let session = record_ramp_hold(watched, calibration, RampHold::default());
    let truth = *truth.lock().expect("the run is over");
    let contact = contact_of(&session);
    let source = source::of_session(session, RecordStretch::RampHold, &[]).expect("a session");
    let options = FitOptions::default();
    let body = truth.body;
    let true_values = [
        body.tau_eps,
        body.mu[0],
        body.mu[1],
        body.mu[2],
        body.tau_sig,
        truth.surface_counted().0 - contact,
    ];
    let force = fit(&source.samples, &options).expect("a fit");
    let signal = SourceFit::of(source, &options).result.expect("a fit");
    [signal, force].map(|report| {
        std::array::from_fn(|k| {
            let one = report.parameter(NAMES[k]).expect("a parameter");
            let scale = if k < 5 { true_values[k].abs() } else { 1.0 };
            let [low, high] = one.ci95.unwrap_or([one.value; 2]);
            CoverageDraw {
                error: (one.value - true_values[k]) / scale,
                std_error: one.std_error.unwrap_or(0.0) / scale,
                is_covered: (low..=high).contains(&true_values[k]),
            }
        })
    })
}

/// Draws of these seeds on two threads.
#[must_use]
pub fn draws(settings: SimSettings, seeds: std::ops::Range<u64>) -> CoverageDraws {
    let halves =
        [0, 1].map(|half| seeds.clone().filter(move |seed| seed % 2 == half).collect::<Vec<_>>());
    let mut all = CoverageDraws::default();
    std::thread::scope(|scope| {
        let handles = halves.map(|own| {
            scope.spawn(move || {
                own.into_iter()
                    .map(|seed| draw(SimSettings { seed, ..settings }))
                    .collect::<Vec<_>>()
            })
        });
        for handle in handles {
            for [signal, force] in handle.join().expect("draws") {
                all.signal.push(signal);
                all.force.push(force);
            }
        }
    });
    all
}

/// Bias, spread, mean standard uncertainty in percent (contact: um) and coverage, a line for each parameter.
pub fn print_table(title: &str, draws: &[[CoverageDraw; 6]]) {
    println!("{title}, {} seeds", draws.len());
    let count = draws.len() as f64;
    for (k, name) in NAMES.iter().enumerate() {
        let unit = if k < 5 { 100.0 } else { 1000.0 };
        let errors = || draws.iter().map(|one| unit * one[k].error);
        let mean = errors().sum::<f64>() / count;
        let spread = (errors().map(|one| (one - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
        let stated = draws.iter().map(|one| unit * one[k].std_error).sum::<f64>() / count;
        let covered = draws.iter().filter(|one| one[k].is_covered).count() as f64;
        println!(
            "  {name:<10} bias {mean:+9.4}  spread {spread:8.4}  stated {stated:8.4}  covers {:5.1} %",
            100.0 * covered / count
        );
    }
}
