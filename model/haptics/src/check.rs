//! The source's check of its feedback: a second slider pushes the rack by a ramp and holds it while a load cell measures.
//!
//! Commanded torque and measured force should follow each other; where they do not, it is the master's friction, its
//! drive and what its converter rounds.

use super::Period;
use super::calibrate::BiasPoint;
use super::master_slave::MasterSlaveError;
use super::rig::{HandPath, SimulatedHand};
use super::setting_error::{SettingError, SettingRange};
use super::simulation::{Simulation, SimulationSettings};
use super::torque::{DriveKind, TorqueSettings};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds, Volts};
use palpate_model::viscoelastic::ModifiedKelvin;
use thiserror::Error;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedbackCheckSettings {
    pub body: ModifiedKelvin,
    pub period: Period,
    /// Speed of the second slider.
    pub speed: MmPerS,
    pub depth: Depth,
    pub hold: Seconds,
    pub drive: DriveKind,
    /// Share of the motor's friction that is compensated.
    pub friction_share: f64,
    /// Samples kept per second.
    pub samples_hz: f64,
}

impl FeedbackCheckSettings {
    /// As the source did it: 0.75 mm/s to 30 mm and 50 s, on a voltage drive without compensation.
    #[must_use]
    pub fn source(body: ModifiedKelvin) -> Self {
        Self {
            body,
            period: Period::MILLISECOND,
            speed: MmPerS(0.75),
            depth: Depth(30.0),
            hold: Seconds(50.0),
            drive: TorqueSettings::default().drive,
            friction_share: 0.0,
            samples_hz: 20.0,
        }
    }
}

/// No check.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FeedbackCheckError {
    /// The system it would be of.
    #[error(transparent)]
    System(#[from] MasterSlaveError),
    #[error(transparent)]
    Setting(#[from] SettingError),
}

/// Longest check in s: a day.
const LONGEST_S: f64 = 86_400.0;

impl FeedbackCheckSettings {
    /// The master's motor and what drives it.
    pub fn torque(&self) -> TorqueSettings {
        TorqueSettings {
            drive: self.drive,
            friction_share: self.friction_share,
            ..TorqueSettings::default()
        }
    }

    /// When the slider is at its end and begins to hold.
    pub fn ramp_end(&self) -> Seconds {
        Seconds(self.depth.0 / self.speed.0)
    }

    /// How long it takes, if it can be made.
    fn seconds(&self) -> Result<f64, FeedbackCheckError> {
        const CHECK: &str = "a check";
        let positive = [
            ("speed", self.speed.0, " mm/s"),
            ("depth", self.depth.0, " mm"),
            ("samples", self.samples_hz, " Hz"),
        ];
        SettingRange::Positive.check(CHECK, &positive)?;
        SettingRange::MayBeInfinite.check(CHECK, &[("hold", self.hold.0, " s")])?;
        let seconds = self.ramp_end().0 + self.hold.0;
        SettingRange::UpTo(LONGEST_S).check(CHECK, &[("duration", seconds, " s")])?;
        Ok(seconds)
    }
}

/// One sample of a check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedbackCheckSample {
    /// Time since the slider began.
    pub t: Seconds,
    /// Depth of the slave.
    pub depth: Depth,
    pub commanded: Newtons,
    /// Torque commanded, in N mm.
    pub torque: f64,
    pub bias: Volts,
    /// Force between slider and rack.
    pub measured: Newtons,
}

/// A slider as a hand: so stiff that 10 N give way by 0.1 mm, damped to a tenth over the mass it is and moves.
fn slider(path: HandPath) -> SimulatedHand {
    SimulatedHand { mass_kg: 0.5, stiffness: 100.0, damping: 0.2, path }
}

/// Runs a check on the simulated master and gives each sample to `seen`, in order; `progress` hears the share done.
pub fn check(
    settings: &FeedbackCheckSettings,
    mut seen: impl FnMut(&FeedbackCheckSample),
    mut progress: impl FnMut(f64),
) -> Result<(), FeedbackCheckError> {
    let seconds = settings.seconds()?;
    let path = HandPath::RampHold { from: 0.0, to: settings.depth.0, speed: settings.speed.0 };
    let mut all = SimulationSettings::of(settings.body, settings.period, slider(path));
    all.system.torque = settings.torque();
    let mut simulation = Simulation::new(&all)?;
    let ticks = settings.period.ticks_in(Seconds(seconds));
    let apart = settings.period.ticks_in(Seconds(1.0 / settings.samples_hz));
    // The cell's own filter: the mean of the ticks of a sample.
    let mut sum = 0.0;
    for tick in 1..=ticks {
        let one = simulation.tick();
        sum += one.hand.0;
        if tick % apart == 0 {
            seen(&FeedbackCheckSample {
                t: one.t,
                depth: one.snapshot.depth,
                commanded: one.snapshot.force,
                torque: one.snapshot.torque,
                bias: one.snapshot.bias,
                measured: Newtons(sum / apart as f64),
            });
            sum = 0.0;
            progress(tick as f64 / ticks as f64);
        }
    }
    Ok(())
}

/// Samples of a check as points of a calibration: the bias rises while the slider pushes in, and falls in the hold as the
/// tissue relaxes, with the rack at rest. At rest friction holds either way, so that the hold tells nothing of it and
/// is left out; `until` is the end of the ramp.
#[must_use]
pub fn calibration_points(samples: &[FeedbackCheckSample], until: Seconds) -> Vec<BiasPoint> {
    let ramp = samples.iter().filter(|one| one.t <= until);
    ramp.map(|one| BiasPoint { bias: one.bias, force: one.measured, is_rising: true }).collect()
}
