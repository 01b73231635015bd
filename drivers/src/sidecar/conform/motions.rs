//! Checks that move the axis, within a range from where it stands.

use super::checks::{ANSWER_LIMIT_MS, garbage};
use super::talk::Talk;
use super::{Check, ConformBench, ConformError, Measured};
use crate::sidecar::description::{SidecarAxis, SidecarDescription};
use crate::sidecar::protocol::HostMessage;
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, MoveTo, PathTracker, Reading, RigDescription, RigSensors};
use palpate_model::units::{MmPerS, MmPerS2, Position, Seconds, Volts};
use std::collections::BTreeMap;

/// Names of all checks of this file, for where the axis must not move.
pub(super) const NAMES: [&str; 10] = [
    "motor-off",
    "too-fast",
    "path",
    "target",
    "second-motion",
    "stop",
    "halt",
    "nonsense-in-motion",
    "silence",
    "lost-link",
];
/// A motion is seen within this time after its answer, and two samples (as the driver has it).
const SEEN_MAX: Nanos = Nanos::from_millis(300);
/// More than any motion of the suite takes: a range of some millimetres at a hundredth of a millimetre a second.
const MOTION_MAX: Nanos = Nanos::from_millis(60_000);
/// What a computer may be late by when it measures a distance in motion.
const LATE_S: f64 = 0.02;
/// Slowest speed of a check, in mm/s.
const SPEED_MIN: f64 = 0.05;
/// A program ends within so long after its input has ended, or it is killed.
const END_MAX: Nanos = Nanos::from_millis(500);
/// Time for a link to come back, and for a computer to notice.
const REOPEN: Nanos = Nanos::from_millis(300);

/// Speeds and targets that keep within the range.
pub(super) struct MotionPlan {
    axis: SidecarAxis,
    /// Signed, in pulses.
    range: i64,
    /// Largest speed from which silence and braking fit into half of the range.
    speed: f64,
    silence: Nanos,
    period: Nanos,
    has_checksum: bool,
    boot: u64,
}

impl MotionPlan {
    pub fn new(about: &SidecarDescription, axis: SidecarAxis, range_mm: f64) -> Self {
        let (half, a) = (range_mm.abs() / 2.0, axis.acceleration);
        let silence = about.silence().seconds().0 + about.period().seconds().0 + LATE_S;
        let gained = (a * half).sqrt();
        let silent = super::speed_for_overtravel(half, silence, MmPerS2(a)).0;
        Self {
            axis,
            range: (range_mm / axis.mm_per_pulse).round() as i64,
            speed: gained.min(silent).min(axis.speed_max).max(SPEED_MIN.min(axis.speed_max)),
            silence: about.silence(),
            period: about.period(),
            has_checksum: about.crc,
            boot: about.boot,
        }
    }

    fn to(&self, to: i64, speed: f64) -> HostMessage {
        let acceleration = MmPerS2(self.axis.acceleration);
        HostMessage::Move { to, speed: MmPerS(speed), acceleration }
    }

    fn mm(&self, pulses: i64) -> f64 {
        pulses as f64 * self.axis.mm_per_pulse
    }

    fn braking_mm(&self, speed: f64) -> f64 {
        speed * speed / (2.0 * self.axis.acceleration)
    }

    fn seen_by(&self) -> Nanos {
        SEEN_MAX + Nanos(2 * self.period.0)
    }

    fn period_s(&self) -> f64 {
        self.period.seconds().0
    }

    /// As much of a rig's description as its path needs.
    fn description(&self, about: &SidecarDescription) -> RigDescription {
        let axis = &self.axis;
        RigDescription {
            name: about.name.clone(),
            identity: String::new(),
            settings: BTreeMap::new(),
            mm_per_pulse: axis.mm_per_pulse,
            travel: Position(axis.travel_mm),
            tick_nanos: 1,
            speed_quantum: MmPerS(axis.speed_max),
            speed_max: MmPerS(axis.speed_max),
            acceleration: MmPerS2(axis.acceleration),
            adc: None,
            noise_expected: Volts(0.0),
            pulse_lag: Seconds(axis.lag_ms * 1e-3 + 1.5 * self.period_s()),
            cell_delay: Seconds(0.0),
            ticks_per_sample: 1.0,
            unseen_max: RigDescription::UNSEEN_USUAL,
            takes_targets: false,
            sensors: RigSensors::default(),
        }
    }
}

fn is_ok(talk: &mut Talk, message: HostMessage) -> Result<bool, ConformError> {
    Ok(talk.ask(message)?.is_some_and(|answer| answer.is_ok))
}

/// Position of the newest sample.
fn here(talk: &Talk) -> i64 {
    talk.samples.last().map_or(0, super::talk::TimedSample::pulses)
}

/// Begins a motion; whether it is seen in time.
fn begin(talk: &mut Talk, plan: &MotionPlan, to: i64, speed: f64) -> Result<bool, ConformError> {
    Ok(is_ok(talk, plan.to(to, speed))? && talk.until(plan.seen_by(), |one| one.is_moving())?)
}

/// Waits until the axis stands; whether it does.
fn rest(talk: &mut Talk) -> Result<bool, ConformError> {
    talk.until(MOTION_MAX, |one| !one.is_moving())
}

/// Begins a motion and lets it reach its speed.
fn cruise(talk: &mut Talk, plan: &MotionPlan, to: i64, speed: f64) -> Result<bool, ConformError> {
    let is_begun = begin(talk, plan, to, speed)?;
    let gaining = Nanos((speed / plan.axis.acceleration * 1e9) as u64);
    talk.pass(gaining + plan.period)?;
    Ok(is_begun)
}

fn go(talk: &mut Talk, plan: &MotionPlan, to: i64) -> Result<bool, ConformError> {
    if here(talk) == to {
        return Ok(true);
    }
    Ok(begin(talk, plan, to, plan.speed)? && rest(talk)? && here(talk) == to)
}

/// Motions that must be refused. The motor is on after this.
pub(super) fn refusals(talk: &mut Talk, plan: &MotionPlan) -> Result<Vec<Check>, ConformError> {
    talk.check = "motion";
    talk.until(plan.seen_by(), |_| true)?;
    let base = here(talk);
    let mut checks = Vec::new();
    let is_on = talk
        .samples
        .last()
        .is_some_and(|one| AxisStatus(one.sample.status).has(AxisStatus::MOTOR_ON));
    if is_on {
        checks.push(Check::skipped("motor-off", "its motor is always on"));
    } else {
        let is_refused = !is_ok(talk, plan.to(base + plan.range.signum(), SPEED_MIN))?;
        checks.push(Check::of(
            "motor-off",
            "a motion is refused while the motor is off",
            is_refused,
        ));
        talk.ask(HostMessage::Stop)?;
        rest(talk)?;
    }
    let is_enabled = is_ok(talk, HostMessage::Enable)?;
    let is_refused = !is_ok(talk, plan.to(base + plan.range, 2.0 * plan.axis.speed_max))?;
    if !is_refused {
        talk.ask(HostMessage::Halt)?;
        rest(talk)?;
    }
    let what = "twice its largest speed is refused";
    checks.push(Check::of("too-fast", what, is_refused && is_enabled).safety());
    Ok(checks)
}

/// A motion that is compared with its commanded path.
pub(super) fn follow(
    talk: &mut Talk,
    plan: &MotionPlan,
    about: &SidecarDescription,
) -> Result<Vec<Check>, ConformError> {
    let mut checks = Vec::new();
    let base = here(talk);
    let mut path = PathTracker::new(&plan.description(about));
    let from = talk.samples.len().saturating_sub(1);
    let target = base + plan.range;
    let to = MoveTo {
        target_pulses: target,
        speed: MmPerS(plan.speed),
        acceleration: MmPerS2(plan.axis.acceleration),
    };
    let is_begun = begin(talk, plan, target, plan.speed)?;
    let is_second_refused = !is_ok(talk, plan.to(base, plan.speed))?;
    let is_at_rest = rest(talk)?;
    let mut off = 0_u64;
    let mut is_sent = false;
    for one in &talk.samples[from..] {
        if one.is_moving() && !std::mem::replace(&mut is_sent, true) {
            path.on_move(to);
        }
        let reading = Reading {
            tick: one.time.0,
            counts: None,
            volts: Volts(0.0),
            pulses: one.pulses(),
            status: AxisStatus(one.sample.status),
            age: None,
        };
        off += u64::from(path.on_reading(&reading).is_err());
    }
    let what = format!(
        "samples off the commanded path of {:.2} mm at {:.2} mm/s by more than a pulse and lag_ms",
        plan.mm(plan.range).abs(),
        plan.speed
    );
    let mut on_path = Check::at_most("path", what, off as f64, 0.0, "samples").safety();
    if !(is_begun && is_at_rest) {
        on_path = Check::of("path", "the motion was not seen, or did not end", false).safety();
    }
    checks.push(on_path);
    let missed = plan.mm((here(talk) - target).abs());
    checks.push(Check::at_most(
        "target",
        "distance from the target at rest",
        missed,
        plan.axis.mm_per_pulse,
        "mm",
    ));
    checks.push(Check::of(
        "second-motion",
        "a motion is refused while the axis moves",
        is_second_refused,
    ));
    go(talk, plan, base)?;
    Ok(checks)
}

/// Distance and time from a stop to the standstill.
pub(super) fn stops(
    talk: &mut Talk,
    plan: &MotionPlan,
    measured: &mut Measured,
) -> Result<Vec<Check>, ConformError> {
    talk.check = "stop";
    let mut checks = Vec::new();
    for (name, message) in [("stop", HostMessage::Stop), ("halt", HostMessage::Halt)] {
        let (mut worst, mut longest, mut is_stopped) = (f64::NEG_INFINITY, Nanos::ZERO, true);
        let mut limit = 0.0;
        for share in [1.0, 0.5] {
            let (base, speed) = (here(talk), share * plan.speed);
            is_stopped &= cruise(talk, plan, base + plan.range, speed)?;
            let (from, begun) = (here(talk), talk.now());
            let Some(answer) = talk.ask(message)?.filter(|answer| answer.is_ok) else {
                is_stopped = false;
                continue;
            };
            measured.answer_max = measured.answer_max.max(answer.latency);
            is_stopped &= rest(talk)?;
            let way = plan.mm((here(talk) - from).abs());
            let reaction = ANSWER_LIMIT_MS * 1e-3 + plan.period_s() + LATE_S;
            let most = speed * reaction + plan.braking_mm(speed);
            if way - most > worst {
                (worst, limit) = (way - most, most);
            }
            longest = longest.max(talk.now().since(begun));
            go(talk, plan, base)?;
        }
        let what = format!(
            "way from {name} to standstill, from up to {:.2} mm/s, after at most {:.0} ms",
            plan.speed,
            longest.0 as f64 * 1e-6
        );
        let check = Check::at_most(name, what, worst + limit, limit, "mm");
        let missing = Check::of(
            name,
            format!("the {name} was not accepted, or the axis did not come to rest"),
            false,
        );
        checks.push(if is_stopped { check } else { missing }.safety());
    }
    Ok(checks)
}

/// Nonsense while the axis moves changes nothing.
pub(super) fn nonsense(talk: &mut Talk, plan: &MotionPlan) -> Result<Check, ConformError> {
    talk.check = "nonsense in motion";
    let base = here(talk);
    let target = base + plan.range;
    let is_begun = begin(talk, plan, target, plan.speed / 2.0)?;
    let from = talk.samples.len();
    for line in garbage(plan.has_checksum) {
        talk.write_raw(&line)?;
        talk.pass(Nanos::from_millis(5))?;
    }
    let is_at_rest = rest(talk)?;
    let is_straight = !talk.samples[from..].iter().any(super::talk::TimedSample::is_stopping);
    let is_there = (here(talk) - target).abs() <= 1;
    go(talk, plan, base)?;
    let what = "a motion goes on to its target while nonsense arrives";
    Ok(Check::of("nonsense-in-motion", what, is_begun && is_at_rest && is_straight && is_there)
        .safety())
}

/// Without a good line the axis brakes by itself, also while nonsense arrives.
pub(super) fn silence(talk: &mut Talk, plan: &MotionPlan) -> Result<Check, ConformError> {
    talk.check = "silence";
    let base = here(talk);
    let is_begun = cruise(talk, plan, base + plan.range, plan.speed)?;
    talk.ask(HostMessage::Beat)?;
    talk.set_silent(true, plan.silence);
    let (from, begun) = (here(talk), talk.now());
    let patience = Nanos(2 * plan.silence.0) + Nanos::from_millis(1_000);
    let end = begun + patience + Nanos((plan.speed / plan.axis.acceleration * 1e9) as u64);
    let mut is_at_rest = false;
    while !is_at_rest && talk.now() < end {
        talk.write_raw(b"{\"n\":7,\"do\":\"be\n")?;
        is_at_rest = talk.until(Nanos::from_millis(20), |one| !one.is_moving())?;
    }
    let took = talk.now().since(begun);
    let way = plan.mm((here(talk) - from).abs());
    talk.set_silent(false, plan.silence);
    // It must not run to its target: that is no stop.
    let is_short = (here(talk) - base).abs() < plan.range.abs();
    if !is_at_rest {
        talk.ask(HostMessage::Stop)?;
        rest(talk)?;
    }
    go(talk, plan, base)?;
    let time = plan.silence.seconds().0 + plan.period_s() + LATE_S;
    let limit = plan.speed * time + plan.braking_mm(plan.speed);
    let what = format!(
        "way without a line from {:.2} mm/s; it stands after {:.0} ms",
        plan.speed,
        took.0 as f64 * 1e-6
    );
    if !(is_begun && is_at_rest && is_short) {
        let why = "the axis does not stop by itself when palpate is silent";
        return Ok(Check::of("silence", why, false).safety());
    }
    Ok(Check::at_most("silence", what, way, limit, "mm").safety())
}

/// The link is cut in motion. The suite's link is over after this.
pub(super) fn lost_link(
    bench: &mut ConformBench<'_>,
    mut talk: Talk,
    plan: &MotionPlan,
) -> Result<Vec<Check>, ConformError> {
    talk.check = "lost link";
    let base = here(&talk);
    let is_begun = cruise(&mut talk, plan, base + plan.range, plan.speed)?;
    let from = here(&talk);
    if !is_begun {
        return Ok(vec![Check::of("lost-link", "the motion was not seen", false).safety()]);
    }
    if talk.close_input() {
        return Ok(ended_input(talk, plan, from));
    }
    drop(talk);
    let braking = Nanos((plan.speed / plan.axis.acceleration * 1e9) as u64);
    (bench.wait)(plan.silence + braking + REOPEN);
    let mut talk = Talk::begin((bench.open)()?, &bench.clock);
    talk.check = "lost link";
    let about = talk.introduce()?;
    talk.start_samples()?;
    let is_moving = talk.samples.last().is_some_and(super::talk::TimedSample::is_moving);
    let way = plan.mm((here(&talk) - from).abs());
    let reaction = plan.silence.seconds().0 + plan.period_s() + LATE_S;
    let limit = plan.speed * reaction + plan.braking_mm(plan.speed);
    let has_restarted = about.boot != plan.boot;
    if has_restarted && !is_moving {
        let why = "it restarts when its port is opened, so its position is not known";
        return Ok(vec![Check::skipped("lost-link", why)]);
    }
    let what = format!("way after the link was cut at {:.2} mm/s", plan.speed);
    let check = Check::at_most("lost-link", what, way, limit, "mm");
    let moving = Check::of("lost-link", "the axis still moves after the link was cut", false);
    Ok(vec![if is_moving { moving } else { check }.safety()])
}

/// A program whose input has ended brakes at once, and ends.
fn ended_input(mut talk: Talk, plan: &MotionPlan, from: i64) -> Vec<Check> {
    let begun = talk.now();
    let mut has_ended = false;
    while !has_ended && talk.now().since(begun) < Nanos(3 * END_MAX.0) {
        has_ended = talk.turn().is_err();
    }
    let took = talk.now().since(begun).0 as f64 * 1e-6;
    let way = plan.mm((here(&talk) - from).abs());
    let reaction = ANSWER_LIMIT_MS * 1e-3 + plan.period_s() + LATE_S;
    let limit = plan.speed * reaction + plan.braking_mm(plan.speed);
    let what = format!("way after the end of its input at {:.2} mm/s", plan.speed);
    let is_seen = talk.samples.last().is_some_and(|one| !one.is_moving());
    let check = Check::at_most("lost-link", what, way, limit, "mm").safety();
    let unseen = "the program ended before a sample showed the standstill";
    vec![
        if is_seen || way > limit { check } else { Check::skipped("lost-link", unseen) },
        Check::at_most(
            "end",
            "time from the end of its input to its own end",
            took,
            END_MAX.0 as f64 * 1e-6,
            "ms",
        ),
    ]
}
