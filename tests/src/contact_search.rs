//! A search for contact on the simulated rig, beside the truth and the bound that no estimate can beat.

use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_drivers::{Rig, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::{HandAction, Limits, Phase};
use palpate_model::signal::MovingMean;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_protocols::engine::{
    ContactPosition, Effect, EngineConfig, EngineInput, EngineState, Operator, Record, RunOutcome,
    step,
};
use palpate_protocols::plans::{FindContact, Plan};
use std::sync::Arc;

/// Depths below which a second of pass is not counted as pass: the axis still brakes or dwells.
const CRUISING: f64 = 1e-9;

/// A search that has ended.
pub struct ContactSearchResult {
    pub outcome: RunOutcome,
    pub contact: Option<ContactPosition>,
    /// True surface on the scale of the pulse counter, in mm.
    pub surface_mm: f64,
    pub body: ModifiedKelvin,
    /// Highest true force during the search, in N.
    pub force_true_max: f64,
    /// Highest mean of 50 forces as measured, in N.
    pub force_filtered_max: f64,
    /// Depths between which the second pass went at its speed, in mm.
    pub pass: [f64; 2],
    /// Records of the engine.
    pub records: Vec<Record>,
    pub duration: Seconds,
}

/// Self-test, home, tare and a search for contact, with something done by hand before.
///
/// # Panics
/// If it takes over an hour of session time.
#[must_use]
pub fn search(
    settings: SimSettings,
    plan: FindContact,
    by_hand: Option<HandAction>,
) -> ContactSearchResult {
    let mut rig = SimRig::new(settings);
    if let Some(action) = by_hand {
        rig.apply_hand_action(action);
    }
    search_on(rig, plan, |_, _| {})
}

/// A search on a rig that `happens` may change at any sample; it sees the engine's state.
///
/// # Panics
/// If it takes over an hour of session time.
#[must_use]
pub fn search_on(
    mut rig: SimRig,
    plan: FindContact,
    mut happens: impl FnMut(&mut SimRig, &EngineState),
) -> ContactSearchResult {
    let steps = crate::lab::set_up(Seconds(4.0), plan);
    let config = EngineConfig {
        rig: rig.description().clone(),
        limits: Limits::for_travel(rig.description().travel),
        curve: rig.calibration().curve().expect("a sound calibration"),
        plan: Plan::of("search", 1, steps),
        is_homed: false,
    };
    let mut state = EngineState::new(Arc::new(config));
    let mut records = Vec::new();
    let mut filter = MovingMean::new(50);
    let (mut force_true_max, mut force_filtered_max) = (0.0f64, 0.0f64);
    let (mut pass, mut begun) = ([f64::INFINITY, f64::NEG_INFINITY], None);
    let choice = Operator::Start;
    let mut next = (Nanos::ZERO, EngineInput::Operator { choice });
    let end = Nanos::from_seconds(Seconds(3600.0));
    while state.outcome().is_none() && state.holding().is_none() {
        let now = next.0;
        let (stepped, effects) = step(state, now, next.1);
        state = stepped;
        for effect in effects {
            match effect {
                Effect::Command(command) => rig.send(command),
                Effect::ByHand(action) => rig.apply_hand_action(action),
                Effect::Record(record) => records.push(record),
                Effect::Finished(_) => {}
            }
        }
        happens(&mut rig, &state);
        let event = rig.next_event(end).expect("the search takes too long");
        let truth = rig.truth();
        if state.phase() == Phase::Contact {
            begun.get_or_insert(now);
            force_true_max = force_true_max.max(truth.force.0);
            let depth = truth.position.distance_from(truth.surface);
            let velocity = state.derived().velocity.0;
            if (velocity - plan.pass_speed.0).abs() < CRUISING {
                pass = [pass[0].min(depth), pass[1].max(depth)];
            }
        }
        let input = match event.body {
            RigEventBody::Reading(reading) => {
                if state.phase() == Phase::Contact
                    && let Some(force) = state.derived().force
                {
                    let filtered = filter.push(force.0);
                    force_filtered_max = force_filtered_max.max(filtered);
                }
                EngineInput::Reading(reading)
            }
            RigEventBody::Ack(ack) => EngineInput::Ack(ack),
            RigEventBody::Fault(fault) => EngineInput::Fault(fault),
        };
        next = (event.at, input);
    }
    let truth = rig.truth();
    let ended = state.outcome().or(state.holding());
    ContactSearchResult {
        outcome: ended.cloned().expect("the search has ended"),
        contact: state.contact(),
        surface_mm: truth.surface_counted().0,
        body: truth.body,
        force_true_max,
        force_filtered_max,
        pass,
        records,
        duration: next.0.since(begun.unwrap_or(next.0)).seconds(),
    }
}

/// Cramer-Rao bound for the contact position, in mm: the smallest standard deviation that any unbiased
/// estimate from one slow pass can have.
///
/// The pass goes from `depths_mm[0]` (before contact, negative) to `depths_mm[1]` at `speed`, one sample a
/// millisecond, each with white noise `noise`. The body's shape is known; unknown are contact, level of the
/// force, offset and a steady drift. The information matrix is `J'J / noise^2` with the columns
/// `dF/dx_c`, `F`, `1`, `t`, and the bound is the root of its inverse's first entry.
#[must_use]
pub fn bound_mm(body: &ModifiedKelvin, depths_mm: [f64; 2], speed: MmPerS, noise: Newtons) -> f64 {
    let dt = 1e-3;
    let [from, to] = depths_mm;
    let count = ((to - from) / (speed.0 * dt)).floor() as usize;
    // A central difference of an exact response: 0.1 um of some millimetres.
    let shift = 1e-4;
    let mut states = [0.0, -shift, shift].map(|by| KelvinState::at_rest_from(Depth(from + by)));
    let mut information = [[0.0; 4]; 4];
    for i in 1..=count {
        let t = i as f64 * dt;
        let mut forces = [0.0; 3];
        for (k, by) in [0.0, -shift, shift].into_iter().enumerate() {
            let depth = Depth(from + speed.0 * t + by);
            forces[k] = states[k].step(body, depth, Seconds(dt)).0;
        }
        let row =
            [(forces[1] - forces[2]) / (2.0 * shift), forces[0], 1.0, t / (count as f64 * dt)];
        for (i, a) in row.iter().enumerate() {
            for (j, b) in row.iter().enumerate() {
                information[i][j] += a * b / noise.0.powi(2);
            }
        }
    }
    first_of_inverse(information).sqrt()
}

/// Entry (0, 0) of the inverse of a positive definite matrix: one over the Schur complement of the rest,
/// found by elimination from the last row up.
fn first_of_inverse(mut matrix: [[f64; 4]; 4]) -> f64 {
    for k in (1..4).rev() {
        let pivot = matrix[k];
        for row in matrix.iter_mut().take(k) {
            let factor = row[k] / pivot[k];
            row.iter_mut().zip(pivot).for_each(|(entry, top)| *entry -= factor * top);
        }
    }
    1.0 / matrix[0][0]
}
