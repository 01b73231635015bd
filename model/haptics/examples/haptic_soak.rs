//! A hundred million virtual ticks, 28 hours at 1 kHz: `cargo run --release -p palpate-haptics --example haptic_soak [TICKS]`.
//!
//! The system goes in and out again and again; in every round it is compared with the same system started afresh. Ends with
//! exit code 1 where anything differs or is no number.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example speaks to its user")]

use palpate_haptics::{
    Flags, LawSettings, MasterSlave, MasterSlaveError, MasterSlaveInput, MasterSlaveSettings,
    MasterSlaveSnapshot, Period,
};
use palpate_model::Newtons;
use palpate_model::viscoelastic::ModifiedKelvin;
use std::process::ExitCode;

/// Ticks of a round: 2000 counts in and out, 15 mm each way, and a rest of 20 relaxation times, after which the memory of
/// the round before is below the last digit.
const ROUND: u64 = 30_000;
const MOVING: u64 = 9_000;

fn counts(phase: u64) -> i64 {
    (phase.min(MOVING.saturating_sub(phase)) / 4) as i64
}

fn tick(system: &mut MasterSlave, phase: u64) -> MasterSlaveSnapshot {
    let counts = counts(phase);
    let cell = if counts > 20 { 1.0 } else { 0.0 };
    let _ = system.tick(&MasterSlaveInput {
        counts,
        elapsed: 1,
        cell: Newtons(cell),
        slave_pulses: None,
        is_on: true,
    });
    system.snapshot()
}

/// Force and place at the deepest point of the second round from a fresh start.
fn fresh(settings: &MasterSlaveSettings) -> Result<MasterSlaveSnapshot, MasterSlaveError> {
    let mut system = MasterSlave::new(settings)?;
    let mut deepest = system.snapshot();
    for i in 0..2 * ROUND {
        let one = tick(&mut system, i % ROUND);
        if i % ROUND == MOVING / 2 {
            deepest = one;
        }
    }
    Ok(deepest)
}

fn soak(ticks: u64) -> Result<bool, MasterSlaveError> {
    let settings =
        MasterSlaveSettings::of(LawSettings::of::<3>(ModifiedKelvin::THESIS, Period::MILLISECOND));
    let expected = fresh(&settings)?;
    let mut system = MasterSlave::new(&settings)?;
    let mut worst = 0.0f64;
    let mut is_right = true;
    for i in 0..ticks {
        let one = tick(&mut system, i % ROUND);
        is_right &= one.force.is_finite() && one.energy.is_finite() && one.bias.is_finite();
        is_right &= !one.flags.has_any(Flags::NO_FORCE | Flags::DEPTH_NAN | Flags::PULSE_RATE);
        if i % ROUND == MOVING / 2 && i > ROUND {
            let off = (one.model.0 / expected.model.0 - 1.0).abs();
            worst = worst.max(off);
            is_right &= one.depth == expected.depth && one.pulses == expected.pulses;
        }
        if i % 10_000_000 == 0 {
            eprintln!("{i} of {ticks} ticks");
        }
    }
    let last = system.snapshot();
    is_right &= last.tick == ticks && last.time.0 == ticks * 1_000_000;
    // Two last digits of the force.
    is_right &= worst <= 5e-16;
    println!(
        "{ticks} ticks, {}: force off by {worst:.1e} of itself at most, place by nothing, energy absorbed {:.3} N mm",
        last.time, last.energy
    );
    Ok(is_right)
}

fn main() -> ExitCode {
    let ticks = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(100_000_000);
    match soak(ticks) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => {
            eprintln!("something drifted or was no number");
            ExitCode::FAILURE
        }
        Err(err) => {
            eprintln!("{err}");
            ExitCode::FAILURE
        }
    }
}
