//! What the engine costs a sample, and whether that stays so through a day: a preconditioning plan of as many cycles as
//! fill 24 h at 1 kHz, every sample judged by every interlock.
//!
//! `cargo run -p palpate-runner --example engine_overhead [HOURS]` prints one JSON object. Beside a peer:
//! `benches/bluesky_messages.py`.

use palpate_model::Nanos;
use palpate_model::calibration::Calibration;
use palpate_model::rig::{Ack, AxisStatus, Limits, Reading, RigCommand, RigDescription};
use palpate_model::units::{MmPerS, MmPerS2, Newtons, Position, Seconds, Volts};
use palpate_protocols::engine::{Effect, EngineConfig, EngineInput, EngineState, Operator, step};
use palpate_protocols::file::built_in;
use palpate_protocols::plans::{Hold, HoldRate, Plan, Rest, SelfTest, Step, Tare};
use palpate_protocols::preview::preview;
use palpate_runner::Stopwatch;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Previews timed, for a mean.
const PREVIEWS: u32 = 1000;

fn rig() -> RigDescription {
    RigDescription {
        name: "bench".into(),
        identity: "samples from memory".into(),
        settings: Default::default(),
        mm_per_pulse: 0.015,
        travel: Position(150.0),
        tick_nanos: 1_000_000,
        speed_quantum: MmPerS(0.03),
        speed_max: MmPerS(20.0),
        acceleration: MmPerS2(61.44),
        adc: None,
        noise_expected: Volts(0.001),
        pulse_lag: palpate_model::units::Seconds(0.0),
        cell_delay: Seconds(0.0),
        ticks_per_sample: 1.0,
        unseen_max: RigDescription::UNSEEN_USUAL,
        takes_targets: false,
        sensors: Default::default(),
    }
}

fn plan(hours: u64) -> Plan {
    let mut steps = vec![
        Step::SelfTest(SelfTest { duration: Seconds(0.5) }),
        Step::Tare(Tare { duration: Seconds(1.0) }),
    ];
    for _ in 0..hours * 20 {
        // Three minutes: a hold that looks at its slope, and a rest.
        steps.push(Step::Hold(Hold {
            duration: Seconds(90.0),
            until: None,
            rate: Some(HoldRate { below_n_per_s: 1e-12, over: Seconds(10.0) }),
        }));
        steps.push(Step::Rest(Rest { duration: Seconds(90.0) }));
    }
    Plan::of("overhead", 1, steps)
}

/// Resident memory in kB, from the system's own account.
fn resident_kb() -> Option<u64> {
    let status = palpate_sessions::text::read(std::path::Path::new("/proc/self/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let hours: u64 = match std::env::args().nth(1) {
        Some(text) => text.parse()?,
        None => 24,
    };
    let curve = Calibration::linear("line", Volts(1.28), 0.15, Newtons(50.0)).curve()?;
    let limits = Limits::for_travel(Position(150.0));
    let ten_cycles = built_in("preconditioning").ok_or("no preconditioning")?;
    let ten_cycles = ten_cycles.map_err(|_| "preconditioning has mistakes")?;
    let ten_cycles = ten_cycles.plan(&BTreeMap::new()).map_err(|_| "no plan")?;
    let watch = Stopwatch::start();
    let expected =
        (0..PREVIEWS).map(|_| preview(&ten_cycles, &rig(), &limits, &curve, true).expected.0);
    let expected = expected.fold(0.0, f64::max);
    let preview_us = watch.seconds() / f64::from(PREVIEWS) * 1e6;
    let config = EngineConfig { rig: rig(), limits, curve, plan: plan(hours), is_homed: true };
    let mut state = EngineState::new(Arc::new(config));
    let choice = Operator::Start;
    state = step(state, Nanos::ZERO, EngineInput::Operator { choice }).0;
    let (mut tick, mut per_hour, mut memory) = (0u64, Vec::new(), Vec::new());
    while state.outcome().is_none() && (per_hour.len() as u64) < hours {
        let watch = Stopwatch::start();
        let samples = 3_600_000;
        for _ in 0..samples {
            tick += 1;
            let reading = Reading {
                tick,
                counts: None,
                // A signal that lives, and steps often enough that no hold is ever steady.
                volts: Volts(1.28 + 1e-4 * (tick % 2) as f64 + 1e-3 * (tick / 1000 % 7) as f64),
                pulses: 0,
                status: AxisStatus::MOTOR_ON,
                age: None,
            };
            let now = Nanos(tick * 1_000_000);
            let (next, effects) = step(state, now, EngineInput::Reading(reading));
            state = next;
            for effect in effects {
                if let Effect::Command(command @ (RigCommand::EnableMotor | RigCommand::Stop)) =
                    effect
                {
                    let (next, _) = step(state, now, EngineInput::Ack(Ack { command }));
                    state = next;
                }
            }
        }
        per_hour.push(watch.seconds() / f64::from(samples) * 1e9);
        memory.extend(resident_kb());
    }
    let text = serde_json::json!({
        "preview_of_ten_cycles_us": preview_us,
        "ten_cycles_s": expected,
        "hours": hours,
        "samples": tick,
        "ns_per_sample_first_hour": per_hour.first(),
        "ns_per_sample_last_hour": per_hour.last(),
        "ns_per_sample_worst_hour": per_hour.iter().copied().reduce(f64::max),
        "resident_kb_first_hour": memory.first(),
        "resident_kb_last_hour": memory.last(),
        "outcome": state.outcome().map(|outcome| outcome.reason.clone()),
    });
    use std::io::Write;
    writeln!(std::io::stdout(), "{text}")?;
    Ok(())
}
