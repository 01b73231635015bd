//! A host that drives a rig the way a runner does.

use palpate_drivers::sim::{SimClock, SimProfile, SimRig, SimSettings};
use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_model::rig::{AxisStatus, Fault, MoveTo, Oscillation, Reading, RigCommand};
use palpate_model::{MmPerS, MmPerS2, Nanos};

/// No event of a test comes later.
pub const FOREVER: Nanos = Nanos(u64::MAX / 2);

pub fn settings(profile: SimProfile, seed: u64, clock: SimClock) -> SimSettings {
    SimSettings { profile, seed, clock, ..SimSettings::default() }
}

pub fn ideal(seed: u64) -> SimRig {
    SimRig::new(settings(SimProfile::Ideal, seed, SimClock::Nominal))
}

pub fn move_to(target_pulses: i64, speed: f64) -> RigCommand {
    RigCommand::MoveTo(MoveTo { target_pulses, speed: MmPerS(speed), acceleration: MmPerS2(61.44) })
}

/// A sine of so many pulses of amplitude and ticks of period.
pub fn oscillate(amplitude_pulses: i64, period_ticks: u32, cycles: u32) -> RigCommand {
    RigCommand::Oscillate(Oscillation {
        amplitude_pulses,
        period_ticks,
        cycles,
        acceleration: MmPerS2(61.44),
    })
}

/// The next sample; panics on a fault.
pub fn next_reading<R: Rig + ?Sized>(rig: &mut R) -> (Nanos, Reading) {
    loop {
        let event = rig.next_event(FOREVER).unwrap();
        match event.body {
            RigEventBody::Reading(reading) => return (event.at, reading),
            RigEventBody::Ack(_) => {}
            RigEventBody::Fault(fault) => panic!("{fault}"),
        }
    }
}

/// Sends a command and returns the answer to it.
pub fn answer_to<R: Rig>(rig: &mut R, command: RigCommand) -> Result<RigCommand, String> {
    rig.send(command);
    loop {
        match rig.next_event(FOREVER).unwrap().body {
            RigEventBody::Reading(_) => {}
            RigEventBody::Ack(ack) => return Ok(ack.command),
            RigEventBody::Fault(Fault::CommandRefused { detail }) => return Err(detail),
            RigEventBody::Fault(fault) => panic!("{fault}"),
        }
    }
}

/// Samples until the axis has moved and rests again, the resting one included.
pub fn samples_to_rest<R: Rig>(rig: &mut R) -> Vec<Reading> {
    let mut samples: Vec<Reading> = Vec::new();
    loop {
        let (_, reading) = next_reading(rig);
        let has_moved = samples.iter().any(|earlier| earlier.status.has(AxisStatus::MOVING));
        samples.push(reading);
        if has_moved && !reading.status.has(AxisStatus::MOVING) {
            return samples;
        }
        assert!(samples.len() < 1_000_000, "the axis never comes to rest");
    }
}

/// Enables the motor, then sends one move and waits for its end.
pub fn run_move<R: Rig>(rig: &mut R, target_pulses: i64, speed: f64) -> Vec<Reading> {
    answer_to(rig, RigCommand::EnableMotor).unwrap();
    answer_to(rig, move_to(target_pulses, speed)).unwrap();
    samples_to_rest(rig)
}

/// Every event up to a time, with a command sent in answer to the n-th.
pub fn events_with<R: Rig>(
    rig: &mut R,
    script: &[(usize, RigCommand)],
    until: Nanos,
) -> Vec<RigEvent> {
    let mut events = Vec::new();
    while let Some(event) = rig.next_event(until) {
        events.push(event);
        for (index, command) in script {
            if events.len() == *index {
                rig.send(*command);
            }
        }
    }
    events
}
