//! What the margin before play needs to know about a device: its mechanics, and the delay measured on its own wire.

use crate::fit::{FitError, WorkspaceFit};
use crate::gate::ForceLimits;
use palpate_haptics::margin::LoopDevice;
use palpate_haptics::scene::DeviceSettings;
use palpate_haptics::{Period, SettingError};
use palpate_model::Nanos;
use palpate_model::units::Newtons;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A tick of the scene may be this late before the force ends.
const TICK_LATE: Nanos = Nanos(500_000);

/// Why a device cannot be used in a scene.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum UseError {
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Figures of the device that no device has.
    #[error(transparent)]
    Figures(#[from] SettingError),
    /// Between two ticks the force would end.
    #[error(
        "a scene of {hz:.0} ticks a second is too slow for a haptic device, whose force ends after {:.1} ms without a tick; set at least {:.0} (rate_hz under [loop])",
        1e3 * .silence.seconds().0, (1.0 / silence.since(TICK_LATE).seconds().0).ceil()
    )]
    SlowScene { hz: f64, silence: Nanos },
}

/// Round trips of messages to a device's service and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RoundTrip {
    /// Messages measured.
    pub count: usize,
    pub median: Nanos,
    /// 99 of 100 are at most this long.
    pub p99: Nanos,
    pub max: Nanos,
}

impl RoundTrip {
    /// Of measured times; all zero without any.
    #[must_use]
    pub fn of(mut times: Vec<Nanos>) -> Self {
        times.sort_unstable();
        let rank = |share: f64| {
            let rank = (share * times.len() as f64).ceil() as usize;
            times.get(rank.saturating_sub(1)).copied().unwrap_or_default()
        };
        Self { count: times.len(), median: rank(0.5), p99: rank(0.99), max: rank(1.0) }
    }
}

/// A device as its owner knows it, in its own millimetres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceFigures {
    /// Mechanics, steps and bounds.
    pub device: DeviceSettings,
    /// Time between sensing and the report, and between the order and the force on the hand, in s. Not seen in a
    /// round trip.
    pub hidden_delay_s: f64,
}

impl DeviceFigures {
    /// The Inverse3. Only the reach is Haply's: its tutorial 06 (service 3.5) keeps the stylus within 0.1 m of the middle, and
    /// the cube in that sphere is taken. Haply's public pages give neither mass, friction, step nor largest force. Those are
    /// assumed, on the side that makes the margin smaller: little damping and friction, a coarse step. The largest force is what
    /// palpate asks for, not what the device has.
    #[must_use]
    pub fn inverse3() -> Self {
        // The cube in a sphere of 100 mm: 2 * 100 / sqrt(3).
        let side_mm = 115.0;
        Self {
            device: DeviceSettings {
                mass_kg: 0.1,
                damping_n_s_per_mm: 0.0002,
                friction_n: 0.1,
                step_mm: 0.05,
                turn_step_rad: 0.002,
                force_max_n: 3.0,
                force_continuous_n: 1.0,
                stiffness_max_n_per_mm: 0.7,
                workspace_mm: [side_mm; 3],
                ..DeviceSettings::default()
            },
            // One exchange of a USB device that is served each millisecond.
            hidden_delay_s: 0.001,
        }
    }

    /// Haply's 2DIY of plastic, in the square of 100 mm around the point (19, 90) mm of its plane.
    ///
    /// Of public sources: 0.123 N m a motor (`MAX_TORQUE` of Haply's firmware M0 V0.3) over its longest lever in the square, 75.5 mm;
    /// both encoders one count on, of the 4880 a turn that the set-up names and the firmware M0 halves, are 0.343 mm at most. The
    /// tests compute both. Assumed: mass, damping, friction, the force for long, the stiffness, and the delay, on the side that
    /// makes the margin smaller.
    #[must_use]
    pub fn two_diy() -> Self {
        Self {
            device: DeviceSettings {
                mass_kg: 0.1,
                damping_n_s_per_mm: 0.0002,
                friction_n: 0.1,
                step_mm: 0.35,
                turn_step_rad: 0.002,
                force_max_n: 1.6,
                force_continuous_n: 0.5,
                stiffness_max_n_per_mm: 0.5,
                // Its third direction is none; a device has a reach along each.
                workspace_mm: [100.0, 100.0, 1.0],
                ..DeviceSettings::default()
            },
            // Half an exchange of a USB device that is served each millisecond, for amplifier and motor.
            hidden_delay_s: 0.0005,
        }
    }

    /// How a device lies in a scene, what the scene knows of it, and the limits of its force; refused where a scene could not use it.
    pub(crate) fn in_scene(
        &self,
        fit: &WorkspaceFit,
        limits: &ForceLimits,
        period: Period,
    ) -> Result<(WorkspaceFit, DeviceSettings, ForceLimits), UseError> {
        let silence = limits.scene_silence;
        if period.nanos() > silence.since(TICK_LATE).0 {
            return Err(UseError::SlowScene { hz: period.hz(), silence });
        }
        let fit = fit.checked()?;
        let force_max_n = self.device.force_max_n.min(limits.force_max_n);
        let device = DeviceSettings { force_max_n, ..self.device };
        let settings = fit.scene_settings(&device).checked()?;
        Ok((fit, settings, ForceLimits { force_max_n, ..*limits }))
    }

    /// What the margin sees of a device with `settings` in the scene. A pose is taken at one tick and used at the next, and
    /// force and pose meet at the service half a round trip away: one tick, the round trip (its 99th percentile) and the
    /// hidden delay.
    #[must_use]
    pub fn loop_device(
        &self,
        settings: &DeviceSettings,
        round_trip: &RoundTrip,
        period: Period,
    ) -> LoopDevice {
        let wire_s = round_trip.p99.seconds().0 + self.hidden_delay_s.max(0.0);
        LoopDevice {
            damping: settings.damping_n_s_per_mm,
            friction: Newtons(settings.friction_n),
            count_mm: settings.step_mm,
            delay_ticks: 1.0 + wire_s / period.seconds().0,
        }
    }
}
