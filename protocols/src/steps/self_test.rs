//! Self-test: the stop command is acknowledged, samples arrive at their rate, the signal at rest
//! is alive, quiet and unloaded, the motor is energised.

use super::prelude::*;
use super::stats::RunningStats;
use palpate_model::rig::AxisStatus;

/// Check link, stop command, sample rate and signal at rest; energise the motor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SelfTest {
    pub duration: Seconds,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Check the link, the signal and the stop command, and switch the motor on. The axis moves only after this step.",
    keys: &[Key::usual(
        "for",
        QuantityKind::Time,
        "0.5 s",
        "time over which the signal is checked",
    )],
    build: Some(|args| Ok(SelfTest { duration: args.seconds("for")? }.into())),
    may_touch: false,
    label: "self-test",
    gives: &[Need::Motor],
    ..StepFacts::of("self-test", Phase::SelfTest, PauseBehaviour::Complete)
};

impl StepKind for SelfTest {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_span(self.duration);
        DurationEstimate(self.duration.0, self.duration.0, false)
    }
}

impl Executable for SelfTest {
    type Run = SelfTestRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<SelfTestRun, String> {
        cx.energise();
        Ok(SelfTestRun {
            until_tick: cx.tick_after(self.duration),
            first_tick: cx.tick(),
            volts: RunningStats::default(),
        })
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SelfTestRun {
    until_tick: u64,
    first_tick: u64,
    volts: RunningStats,
}

/// An unloaded cell reads within this of the calibration's zero: the platform and probe shift it
/// by far less, a probe resting in tissue or a weight left on by more.
const UNLOADED_MAX: Newtons = Newtons(0.5);

/// Noise above this multiple of what the rig should show is a loose wire or a wrong range.
const NOISE_FACTOR_MAX: f64 = 5.0;

impl RunningStep for SelfTestRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        self.volts.push(reading.volts.0);
        if reading.tick < self.until_tick || !cx.is_acknowledged() {
            return Ok(Progress::Continue);
        }
        self.judge(cx, reading.tick)?;
        cx.allow_motion();
        Ok(Progress::Done)
    }
}

impl SelfTestRun {
    fn judge(&self, cx: &Context<'_>, tick: u64) -> Result<(), String> {
        let rig = cx.rig();
        let ticks = (tick - self.first_tick) as f64;
        let expected = (ticks / rig.ticks_per_sample).floor() as u64;
        let received = self.volts.count();
        // One sample in a hundred may be late at the end; more is a link that loses data. A rig that is asked for its
        // samples by a computer with much else to do may get half of them.
        let share = if rig.ticks_per_sample > 1.0 { 50 } else { 99 };
        if received * 100 < expected * share {
            return Err(format!("only {received} of {expected} samples arrived; check the link"));
        }
        let noise = self.volts.std_dev();
        if noise == 0.0 && rig.shows_noise() {
            return Err("the signal does not change at all; check the load cell's wiring".into());
        }
        let noise_max = NOISE_FACTOR_MAX * rig.noise_expected.0.max(cx.volts_per_count());
        if noise > noise_max {
            return Err(format!(
                "the signal's noise is {:.2} mV rms, above the limit of {:.2} mV; check the wiring and the measuring range",
                noise * 1e3,
                noise_max * 1e3
            ));
        }
        if !cx.status().has(AxisStatus::MOTOR_ON) {
            return Err("the motor is not energised; check its supply".into());
        }
        check_unloaded(cx, Volts(self.volts.mean()))
    }
}

/// Refuses a cell that is loaded while nothing should touch it.
pub(super) fn check_unloaded(cx: &Context<'_>, volts: Volts) -> Result<(), String> {
    let force = cx.curve().newtons_from_volts(volts);
    if force.abs() > UNLOADED_MAX {
        return Err(format!(
            "the load cell reads {force:.2} before anything touches the probe; free the probe or recalibrate"
        ));
    }
    Ok(())
}
