//! A body on a haptic device: the margin before play, what the loop does without its guards and with them, and
//! how the loop keeps its time on this computer.

use super::fit::SourceFit;
use super::margin::{MarginPoint, margin_curve};
use super::tick_replay::RecordedTicks;
use crate::population::{is_member, library_member};
use crate::source::read;
use palpate_figures::thin::thin;
use palpate_haptics::check::{
    FeedbackCheckSample, FeedbackCheckSettings, calibration_points, check as run_check,
};
use palpate_haptics::margin::MarginReport;
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_haptics::simulation::SimulationSettings;
use palpate_haptics::{BiasCalibration, Buzz, DriveKind, Flags, Period, TorqueSettings};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::fit::{FitOptions, FitReport, FitSample, fit};
use palpate_runner::haptics::device_recording::{DeviceRecorder, RecordedDevice};
use palpate_runner::haptics::timing::LoopTiming;
use palpate_runner::haptics::{LoopTask, RealTimeLoop, SimulatedMasterSlave};
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Name of the source thesis's body, which needs no session.
pub const THESIS: &str = "thesis";

/// Damping of the hand in N s/mm: a firm grip has more, which would calm what is to be seen.
const GRIP_DAMPING: f64 = 0.002;

/// A body to render, from a fit or the source thesis.
#[derive(Clone, Debug, PartialEq)]
pub struct HapticBody {
    pub body: ModifiedKelvin,
    /// Largest depth of the fitted record.
    pub deepest: Depth,
    pub notes: Vec<String>,
}

/// The body of a session or a table by its fit, of a specimen of a population, or the source thesis's.
pub fn fit_haptic_body(source: &Path) -> Result<HapticBody, String> {
    if let Some(text) = source.to_str().filter(|text| is_member(text)) {
        let member = library_member(text).map_err(|err| err.to_string())?;
        let deepest = Depth(member.depth_max_mm);
        return Ok(HapticBody { body: member.body, deepest, notes: Vec::new() });
    }
    if source == Path::new(THESIS) {
        return Ok(HapticBody {
            body: ModifiedKelvin::THESIS,
            deepest: Depth(30.0),
            notes: Vec::new(),
        });
    }
    let options = FitOptions::default();
    let fitted = SourceFit::of(read(source).map_err(|err| err.to_string())?, &options);
    let report = fitted.result.map_err(|err| format!("{} has no fit: {err}", source.display()))?;
    let body = report.kelvin().ok_or_else(|| {
        format!(
            "the fit of {} uses another model family; haptics needs the modified Kelvin model",
            source.display()
        )
    })?;
    let depths = fitted.samples.iter().map(|sample| sample.depth.0);
    let mut notes = fitted.notes;
    notes.extend(report.warnings.iter().cloned());
    Ok(HapticBody { body, deepest: Depth(depths.fold(0.0, f64::max)), notes })
}

impl HapticBody {
    /// A warning if a stroke exceeds the measured depth by more than a pulse of the source's slider.
    pub fn extrapolation_warning(&self, deepest: Depth) -> Option<String> {
        (deepest.0 > self.deepest.0 + 0.015).then(|| {
            format!(
                "the record reaches a depth of {:.3}; between this depth and {deepest:.3} the model is extrapolated without evidence",
                self.deepest
            )
        })
    }
}

/// Settings of a device, its loop and the simulated hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapticSettings {
    pub period: Period,
    pub drive: DriveKind,
    /// Damping of the device without its motor, in N s/mm.
    pub damping: f64,
    /// Its Coulomb friction; that of the source's motor without it.
    pub friction: Option<Newtons>,
    /// Whole ticks from an encoder count to its force.
    pub delay: usize,
    pub deepest: Depth,
    pub speed: MmPerS,
}

impl HapticSettings {
    /// Longest stroke offered, in mm.
    pub const DEPTH_MAX: f64 = 100.0;
    /// Fastest hand offered, in mm/s.
    pub const SPEED_MAX: f64 = 1000.0;
    /// Most ticks of delay offered.
    pub const DELAY_MAX: u8 = 16;

    /// The source's device: a voltage drive, its motor's friction, a stroke of 30 mm.
    #[must_use]
    pub fn source(period: Period) -> Self {
        Self {
            period,
            drive: TorqueSettings::default().drive,
            damping: 0.0,
            friction: None,
            delay: 0,
            deepest: Depth(30.0),
            speed: MmPerS(50.0),
        }
    }

    /// The simulation of a body with a firm hand that presses to the end of the stroke and holds there.
    pub fn simulation(&self, body: ModifiedKelvin, is_guarded: bool) -> SimulationSettings {
        let path = HandPath::RampHold { from: 0.0, to: self.deepest.0, speed: self.speed.0 };
        let hand = SimulatedHand { damping: GRIP_DAMPING, ..SimulatedHand::firm(path) };
        let mut all = SimulationSettings::of(body, self.period, hand);
        all.plant.damping = self.damping;
        all.plant.delay = self.delay;
        all.system.damping = self.damping;
        all.system.delay_ticks = self.delay as f64;
        all.system.law.depth_max = self.deepest;
        all.system.torque.drive = self.drive;
        if let Some(friction) = self.friction {
            // The motor's torque of friction, as it is felt at the rack.
            let torque = friction.0 * all.system.torque.pinion.radius_mm();
            all.system.torque.motor.friction = torque;
            all.plant.friction = [friction.0; 2];
            if let Some((motor, _)) = &mut all.plant.motor {
                motor.friction = torque;
            }
        }
        if is_guarded { all } else { all.unguarded() }
    }
}

/// Duration of the hold at the end of the stroke in s: a buzz of a few hertz shows within one.
const HOLD: f64 = 3.0;

/// Start of a trace before the hand arrives, in s.
const BEFORE: f64 = 0.5;

/// Columns that a trace is thinned for: more than half a screen is wide.
const COLUMNS: usize = 1000;

/// Result of a simulated stroke.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulatedTrial {
    pub is_guarded: bool,
    /// Share of the ticks of the hold in which it buzzed.
    pub buzz_share: f64,
    /// Time of the last buzz after the hand arrived, in s; `None` without a buzz in the hold.
    pub buzz_until_s: Option<f64>,
    /// The strongest buzz: its frequency in Hz and its amplitude in mm.
    pub buzz: Option<(f64, f64)>,
    /// From the lowest to the highest place in the last second of the hold, in mm.
    pub swing_mm: f64,
    /// Largest force rendered, in N.
    pub force_max_n: f64,
    /// Lowest energy absorbed by the rendered force in N mm: below zero, so much was returned.
    pub energy_min_mj: f64,
    /// Most damping that the controller added, in N s/m.
    pub damping_added_max: f64,
    pub flags: Vec<&'static str>,
    /// Place of the device in mm over time in s from when the hand arrived, thinned; for pictures.
    #[serde(skip)]
    pub trace: Vec<[f64; 2]>,
}

/// Stability margin of a body on a device, and its simulation.
#[derive(Clone, Debug, Serialize)]
pub struct HapticCheck {
    pub body: ModifiedKelvin,
    pub margin: MarginReport,
    pub sentences: Vec<String>,
    /// Without guards, then with them.
    #[serde(rename = "tried")]
    pub trials: [SimulatedTrial; 2],
    /// Damping needed over depth, in its parts; for pictures.
    #[serde(skip)]
    pub curve: Vec<MarginPoint>,
}

/// Looks at a body on a device: the margin, and the simulated device without guards and with them. `is_going` hears
/// the share done and ends it early.
pub fn check(
    body: ModifiedKelvin,
    setting: &HapticSettings,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<HapticCheck, String> {
    let watch = setting.simulation(body, true).system.watch();
    let margin = watch.assess_stroke(setting.deepest, setting.speed);
    let without = try_out(body, setting, false, &mut |share| is_going(0.5 * share))?;
    let with = try_out(body, setting, true, &mut |share| is_going(0.5 + 0.5 * share))?;
    Ok(HapticCheck {
        body,
        sentences: margin.sentences(),
        margin,
        trials: [without, with],
        curve: margin_curve(&watch, setting.deepest, setting.speed),
    })
}

fn try_out(
    body: ModifiedKelvin,
    setting: &HapticSettings,
    is_guarded: bool,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<SimulatedTrial, String> {
    let settings = setting.simulation(body, is_guarded);
    let mut device = SimulatedMasterSlave::new(&settings).map_err(|err| err.to_string())?;
    let arrives = setting.deepest.0 / setting.speed.0;
    let ticks = setting.period.ticks_in(Seconds(arrives + HOLD));
    let last_second = ticks.saturating_sub(setting.period.ticks_in(Seconds(1.0)));
    let mut buzz: Option<Buzz> = None;
    let (mut buzzed, mut held, mut until) = (0_u64, 0_u64, None);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut flags, mut trace) = (Flags::NONE, Vec::new());
    let (mut force_max, mut energy_min, mut damping_max) = (0.0_f64, 0.0_f64, 0.0_f64);
    for tick in 0..ticks {
        device.tick(1);
        let one = device.last();
        let seen = &one.snapshot;
        flags |= seen.flags;
        force_max = force_max.max(seen.force.0.abs());
        energy_min = energy_min.min(seen.energy);
        damping_max = damping_max.max(seen.damping);
        if one.t.0 > arrives - BEFORE {
            trace.push([one.t.0 - arrives, one.x]);
        }
        if one.t.0 > arrives {
            held += 1;
            if seen.buzz.is_some() {
                buzzed += 1;
                until = Some(one.t.0 - arrives);
            }
        }
        buzz = match (buzz, seen.buzz) {
            (Some(most), Some(now)) if now.amplitude_mm <= most.amplitude_mm => Some(most),
            (most, now) => now.or(most),
        };
        if tick >= last_second {
            (low, high) = (low.min(one.x), high.max(one.x));
        }
        if tick.is_multiple_of(100) && !is_going(tick as f64 / ticks as f64) {
            return Err("the simulation was cancelled".into());
        }
    }
    Ok(SimulatedTrial {
        is_guarded,
        buzz_share: buzzed as f64 / held.max(1) as f64,
        buzz_until_s: until,
        buzz: buzz.map(|one| (one.frequency_hz, one.amplitude_mm)),
        swing_mm: high - low,
        force_max_n: force_max,
        energy_min_mj: energy_min,
        damping_added_max: 1e3 * damping_max,
        flags: flags.sentences().collect(),
        trace: thin(trace.iter().copied(), COLUMNS),
    })
}

/// Timing of a loop at one rate.
#[derive(Clone, Debug, Serialize)]
pub struct LoopMeasurement {
    pub rate_hz: f64,
    /// Threads that did nothing but keep the processors busy meanwhile.
    pub busy_threads: usize,
    pub priority: String,
    #[serde(flatten)]
    pub statistics: LoopTiming,
    pub recorded: Option<RecordedTicks>,
}

/// Runs the loop in real time for some seconds beside so many busy threads, and records it if asked to. `is_going` ends it early.
pub fn pace(
    settings: &SimulationSettings,
    seconds: f64,
    busy: usize,
    recorder: Option<DeviceRecorder>,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<LoopMeasurement, String> {
    let period = settings.system.law.period;
    let is_over = Arc::new(AtomicBool::new(false));
    let mut others = Vec::new();
    for _ in 0..busy {
        let is_over = Arc::clone(&is_over);
        let work = move || {
            while !is_over.load(Ordering::Relaxed) {
                std::hint::spin_loop();
            }
        };
        let thread = std::thread::Builder::new().name("busy".into()).spawn(work);
        others.push(thread.map_err(|err| err.to_string())?);
    }
    let device = SimulatedMasterSlave::new(settings).map_err(|err| err.to_string())?;
    let first = *device.last();
    let beat = RealTimeLoop::start(RecordedDevice { device, recorder }, period, first)
        .map_err(|err| format!("the loop's thread cannot be started: {err}"))?;
    let parts = (seconds / PART.as_secs_f64()).ceil().max(1.0);
    for part in 0..parts as u64 {
        std::thread::sleep(PART);
        if !is_going(part as f64 / parts) {
            break;
        }
    }
    let kept = beat.timing();
    let priority = beat.granted_priority().to_string();
    let taped = beat.end();
    is_over.store(true, Ordering::Relaxed);
    for thread in others {
        // It only spins.
        let _ = thread.join();
    }
    let taped = taped.ok_or("the haptic loop failed; report this bug in palpate")?;
    let hash = taped.device.last().snapshot.sum();
    let recorded = taped.recorder.map(|recorder| recorder.finish(hash));
    Ok(LoopMeasurement {
        recorded: recorded.transpose()?.map(RecordedTicks::from),
        rate_hz: 1.0 / period.seconds().0,
        busy_threads: busy,
        priority,
        statistics: kept,
    })
}

/// Interval between two looks at a running loop.
const PART: Duration = Duration::from_millis(100);

/// The source's check of its feedback, simulated: a slider pushes the rack, a load cell measures.
#[derive(Clone, Debug, Serialize)]
pub struct FeedbackCheck {
    #[serde(skip)]
    pub settings: FeedbackCheckSettings,
    /// Samples, which have a table of their own.
    #[serde(skip)]
    pub samples: Vec<FeedbackCheckSample>,
    pub body: ModifiedKelvin,
    #[serde(rename = "samples")]
    pub count: usize,
    /// Highest force commanded and measured, in N.
    pub peak_commanded_n: f64,
    pub peak_measured_n: f64,
    /// Mean of measured minus commanded force on the way in, and root mean square of what is left about it, in N.
    pub offset_n: f64,
    pub scatter_n: f64,
    /// Friction of the motor at the rack that the drive does not make up for, in N.
    pub friction_n: f64,
    /// Drag of the drive at the slider's speed, in N.
    pub drag_n: f64,
    /// Torque-force calibration: force at the rack per volt of bias.
    pub calibration: Option<BiasCalibration>,
    /// The body that a fit of the measured force finds, as the slider felt it.
    pub fit: Option<FitReport>,
    /// The body that a fit of the commanded force finds.
    pub fit_commanded: Option<FitReport>,
    /// A sentence for each result that is missing.
    pub refusals: Vec<String>,
}

pub fn check_feedback(
    settings: &FeedbackCheckSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<FeedbackCheck, String> {
    let mut samples = Vec::new();
    run_check(settings, |one| samples.push(*one), progress).map_err(|err| err.to_string())?;
    let until = settings.ramp_end();
    let ramp = || samples.iter().filter(|one| one.t <= until);
    let count = ramp().count().max(1) as f64;
    let error = |one: &FeedbackCheckSample| one.measured.0 - one.commanded.0;
    let offset = ramp().map(error).sum::<f64>() / count;
    let squares: f64 = ramp().map(|one| (error(one) - offset).powi(2)).sum();
    let peak = |of: fn(&FeedbackCheckSample) -> f64| samples.iter().map(of).fold(0.0, f64::max);
    let points = calibration_points(&samples, until);
    let mut refusals = Vec::new();
    let calibration = BiasCalibration::fit(&points);
    let calibration = calibration.map_err(|err| refusals.push(format!("no calibration: {err}")));
    let mut fitted = |force: fn(&FeedbackCheckSample) -> Newtons, which: &str| {
        let record = samples.iter().map(|one| FitSample {
            t: one.t,
            depth: one.depth,
            force: force(one),
            sigma: Newtons(1.0),
        });
        let found = fit(&record.collect::<Vec<_>>(), &FitOptions::default());
        let found = found
            .map_err(|err| refusals.push(format!("the {which} force cannot be fitted: {err}")));
        found.ok()
    };
    let fit = fitted(|one| one.measured, "measured");
    let fit_commanded = fitted(|one| one.commanded, "commanded");
    let torque = settings.torque();
    Ok(FeedbackCheck {
        settings: *settings,
        body: settings.body,
        count: samples.len(),
        peak_commanded_n: peak(|one| one.commanded.0),
        peak_measured_n: peak(|one| one.measured.0),
        offset_n: offset,
        scatter_n: (squares / count).sqrt(),
        friction_n: (1.0 - torque.friction_share) * torque.friction().0,
        drag_n: torque.damping() * settings.speed.0,
        calibration: calibration.ok(),
        fit,
        fit_commanded,
        refusals,
        samples,
    })
}
