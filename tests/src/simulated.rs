//! A protocol on the simulated rig, in memory: engine and rig without disk or threads.

use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_drivers::{Rig, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::{Limits, Phase};
use palpate_model::units::Seconds;
use palpate_protocols::engine::{
    Effect, EngineConfig, EngineInput, EngineState, Operator, Record, step,
};
use palpate_protocols::plans::RampHold;
use palpate_rheology::fit::FitSample;
use std::sync::Arc;

/// A run that has ended, or holds after a stop.
pub struct SimulatedRun {
    pub rig: SimRig,
    pub state: EngineState,
    /// Records of the engine.
    pub records: Vec<Record>,
    /// True force at its highest while contact was searched, in N.
    pub force_peak_in_contact_search: f64,
    pub hold_ticks: u64,
    /// Samples of ramp and hold.
    pub samples: Vec<FitSample>,
}

/// Runs a ramp and hold to its end.
///
/// # Panics
/// If the run takes over ten minutes of session time.
#[must_use]
pub fn run(settings: SimSettings, params: RampHold) -> SimulatedRun {
    let mut rig = SimRig::new(settings);
    let config = EngineConfig {
        rig: rig.description().clone(),
        limits: Limits::for_travel(rig.description().travel),
        curve: rig.calibration().curve().expect("the rig's calibration is sound"),
        plan: params.plan(),
        is_homed: false,
    };
    let mut state = EngineState::new(Arc::new(config));
    let (mut records, mut samples) = (Vec::new(), Vec::new());
    let (mut force_peak, mut hold_ticks, mut first_tick) = (0.0f64, 0, None);
    let mut next = (Nanos::ZERO, EngineInput::Operator { choice: Operator::Start });
    let end = Nanos::from_seconds(Seconds(600.0));
    let tick_secs = rig.description().tick().0;
    while state.outcome().is_none() && state.holding().is_none() {
        let tick = match &next.1 {
            EngineInput::Reading(reading) => Some(reading.tick),
            _ => None,
        };
        let (stepped, effects) = step(state, next.0, next.1);
        state = stepped;
        for effect in effects {
            match effect {
                Effect::Command(command) => rig.send(command),
                Effect::ByHand(action) => rig.apply_hand_action(action),
                Effect::Record(record) => records.push(record),
                Effect::Finished(_) => {}
            }
        }
        let derived = *state.derived();
        if let (Some(tick), Phase::Ramp | Phase::Hold) = (tick, state.phase())
            && let (Some(depth), Some(force), Some(sigma)) =
                (derived.depth, derived.force, derived.force_sigma)
        {
            let first = *first_tick.get_or_insert(tick);
            let t = Seconds((tick - first) as f64 * tick_secs);
            samples.push(FitSample { t, depth, force, sigma });
            hold_ticks += u64::from(state.phase() == Phase::Hold);
        }
        let event = rig.next_event(end).expect("the run takes too long");
        if state.phase() == Phase::Contact {
            force_peak = force_peak.max(rig.truth().force.0);
        }
        let input = match event.body {
            RigEventBody::Reading(reading) => EngineInput::Reading(reading),
            RigEventBody::Ack(ack) => EngineInput::Ack(ack),
            RigEventBody::Fault(fault) => EngineInput::Fault(fault),
        };
        next = (event.at, input);
    }
    SimulatedRun {
        rig,
        state,
        records,
        force_peak_in_contact_search: force_peak,
        hold_ticks,
        samples,
    }
}
