//! Self-test: the stop command is acknowledged, samples arrive at their rate, the signal at rest
//! is alive, quiet and unloaded, the motor is energised.

use super::context::{Context, Progress};
use super::state::Power;
use super::stats::RunningStats;
use palpate_model::rig::{AxisStatus, Reading, RigCommand};
use palpate_model::units::{Newtons, Seconds, Volts};

/// Data of a self-test in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SelfTest {
    until_tick: u64,
    first_tick: u64,
    volts: RunningStats,
}

/// An unloaded cell reads within this of the calibration's zero: the platform and probe shift it
/// by far less, a probe resting in tissue or a weight left on by more.
const UNLOADED_MAX: Newtons = Newtons(0.5);

/// Noise above this multiple of what the rig should show is a loose wire or a wrong range.
const NOISE_FACTOR_MAX: f64 = 5.0;

impl SelfTest {
    pub fn begin(cx: &mut Context<'_>, duration: Seconds) -> Self {
        cx.state.power = Power::Reset;
        cx.command(RigCommand::EnableMotor);
        cx.command(RigCommand::Stop);
        Self {
            until_tick: cx.state.tick + cx.state.ticks(duration),
            first_tick: cx.state.tick,
            volts: RunningStats::default(),
        }
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Progress {
        self.volts.push(reading.volts.0);
        if reading.tick < self.until_tick || !cx.state.unacknowledged.is_empty() {
            return Progress::Continue;
        }
        match self.verdict(cx, reading.tick) {
            Ok(()) => {
                cx.state.power = Power::Enabled;
                Progress::Done
            }
            Err(reason) => Progress::Fail(format!("self-test: {reason}")),
        }
    }

    fn verdict(&self, cx: &Context<'_>, tick: u64) -> Result<(), String> {
        let ticks = (tick - self.first_tick) as f64;
        let expected = (ticks / cx.state.config.rig.ticks_per_sample).floor() as u64;
        let received = self.volts.count();
        // One sample in a hundred may be late at the end; more is a link that loses data. A rig that is asked for its
        // samples by a computer with much else to do may get half of them.
        let share = if cx.state.config.rig.ticks_per_sample > 1.0 {
            50
        } else {
            99
        };
        if received * 100 < expected * share {
            return Err(format!(
                "only {received} of {expected} samples arrived; check the link"
            ));
        }
        let noise = self.volts.std_dev();
        if noise == 0.0 && cx.state.config.rig.shows_noise() {
            return Err("the signal does not change at all; check the load cell's wiring".into());
        }
        let rig = &cx.state.config.rig;
        let count = rig.adc.map_or(0.0, |adc| adc.volts_per_count);
        let noise_max = NOISE_FACTOR_MAX * rig.noise_expected.0.max(count);
        if noise > noise_max {
            return Err(format!(
                "the signal's noise is {:.2} mV rms, above {:.2} mV; check wiring and range",
                noise * 1e3,
                noise_max * 1e3
            ));
        }
        if !cx.state.status.has(AxisStatus::MOTOR_ON) {
            return Err("the motor is not energised; check its supply".into());
        }
        check_unloaded(cx, Volts(self.volts.mean()))
    }
}

/// Refuses a cell that is loaded while nothing should touch it.
pub(super) fn check_unloaded(cx: &Context<'_>, volts: Volts) -> Result<(), String> {
    let force = cx.state.config.curve.newtons_from_volts(volts);
    if force.abs() > UNLOADED_MAX {
        return Err(format!(
            "the load cell reads {force:.2} before anything touches the probe; free it or recalibrate"
        ));
    }
    Ok(())
}
