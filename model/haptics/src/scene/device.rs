//! A six-axis haptic device with a hand on its stylus, simulated.
//!
//! Each axis is a mass with damping and Coulomb friction that the hand's spring and damper lead ([`Rack`], whose
//! energies add up exactly). Turns carry no torque, as on the Omni: they are where the hand has them, in steps of
//! the sensor.

use super::{LED_MAX, SceneSettings};
use crate::rig::{HandPath, Rack, RackForces, SimulatedHand};
use crate::{Period, SettingError, SettingRange};
use serde::{Deserialize, Serialize};

/// Parts of a tick in which the device moves: a quarter of a millisecond, a 30th of the period in which a firm hand's spring
/// swings the lightest device.
const PARTS: u32 = 4;

/// Pose of the stylus that a hand intends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandPose {
    /// x, y and z in mm. The surface at rest is z = 0, tissue is below; x and y begin at the mesh's first node.
    pub at: [f64; 3],
    /// Yaw, pitch and roll in rad.
    pub turn: [f64; 3],
}

impl HandPose {
    pub(super) fn is_finite(&self) -> bool {
        self.at.iter().chain(&self.turn).all(|part| part.is_finite())
    }
}

/// A device and the grip of the hand on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeviceSettings {
    /// Apparent mass at the stylus in kg.
    pub mass_kg: f64,
    /// Its own damping in N s/mm.
    pub damping_n_s_per_mm: f64,
    /// Friction along each axis in N.
    pub friction_n: f64,
    /// Step of sensed places in mm.
    pub step_mm: f64,
    /// Step of sensed turns in rad.
    pub turn_step_rad: f64,
    /// Largest force in N.
    pub force_max_n: f64,
    /// Force that it can give for long in N.
    pub force_continuous_n: f64,
    /// Largest stiffness that it renders in N/mm.
    pub stiffness_max_n_per_mm: f64,
    /// Lengths along x, y and z that the stylus reaches, in mm, around the middle of the mesh at rest.
    pub workspace_mm: [f64; 3],
    /// Mass of the hand that moves with it in kg.
    pub hand_mass_kg: f64,
    /// Spring of the hand in N/mm.
    pub hand_stiffness_n_per_mm: f64,
    /// Damper of the hand in N s/mm.
    pub hand_damping_n_s_per_mm: f64,
    /// Fastest speed at which the place that the hand wants moves, in mm/s.
    pub hand_speed_max_mm_per_s: f64,
}

impl Default for DeviceSettings {
    /// Of the class of the PHANTOM Omni, held firmly.
    ///
    /// 3.3 N and 0.7 N/mm are what CHAI3D's driver (`CPhantomDevices.cpp`) has for it. Mass, friction, the step of places, 0.88 N for
    /// long and the reach are of SensAble's data sheet as remembered. Its damping, the step of turns (potentiometers read to 12 bits) and
    /// the grip are assumed.
    fn default() -> Self {
        let grip = SimulatedHand::firm(HandPath::Still { at: 0.0 });
        Self {
            mass_kg: 0.045,
            damping_n_s_per_mm: 0.0005,
            friction_n: 0.26,
            step_mm: 0.055,
            turn_step_rad: 0.0015,
            force_max_n: 3.3,
            force_continuous_n: 0.88,
            stiffness_max_n_per_mm: 0.7,
            workspace_mm: [160.0, 120.0, 70.0],
            hand_mass_kg: grip.mass_kg,
            hand_stiffness_n_per_mm: grip.stiffness,
            hand_damping_n_s_per_mm: grip.damping,
            hand_speed_max_mm_per_s: 500.0,
        }
    }
}

impl DeviceSettings {
    /// The settings themselves if there can be such a device.
    pub fn checked(self) -> Result<Self, SettingError> {
        const DEVICE: &str = "a device";
        const MOST: f64 = 1e6;
        let [wide, deep, high] = self.workspace_mm;
        let positive = [
            ("mass_kg", self.mass_kg, ""),
            ("step_mm", self.step_mm, ""),
            ("turn_step_rad", self.turn_step_rad, ""),
            ("force_max_n", self.force_max_n, ""),
            ("force_continuous_n", self.force_continuous_n, ""),
            ("stiffness_max_n_per_mm", self.stiffness_max_n_per_mm, ""),
            ("workspace_mm", wide, ""),
            ("workspace_mm", deep, ""),
            ("workspace_mm", high, ""),
            ("hand_speed_max_mm_per_s", self.hand_speed_max_mm_per_s, ""),
        ];
        SettingRange::PositiveUpTo(MOST).check(DEVICE, &positive)?;
        let or_zero = [
            ("damping_n_s_per_mm", self.damping_n_s_per_mm, ""),
            ("friction_n", self.friction_n, ""),
            ("hand_mass_kg", self.hand_mass_kg, ""),
            ("hand_stiffness_n_per_mm", self.hand_stiffness_n_per_mm, ""),
            ("hand_damping_n_s_per_mm", self.hand_damping_n_s_per_mm, ""),
        ];
        SettingRange::UpTo(MOST).check(DEVICE, &or_zero)?;
        Ok(self)
    }

    /// `force` as far as the device can give it, the same way, and whether it is less than requested.
    #[must_use]
    pub fn limit_force(&self, force: [f64; 3]) -> ([f64; 3], bool) {
        let requested = length(force);
        if requested <= self.force_max_n {
            return (force, false);
        }
        if !requested.is_finite() {
            return ([0.0; 3], true);
        }
        let share = self.force_max_n / requested;
        (force.map(|part| share * part), true)
    }
}

/// Pose of the stylus as the device senses it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Place of the stylus in mm.
    pub at: [f64; 3],
    /// Its yaw, pitch and roll in rad.
    pub turn: [f64; 3],
}

#[derive(Clone, Copy, Debug)]
pub struct SimulatedDevice {
    settings: DeviceSettings,
    middle: [f64; 3],
    tick_s: f64,
    axes: [Rack; 3],
    /// Position that the hand intends, within the bounds of speed and workspace.
    aim: [f64; 3],
    turn: [f64; 3],
}

impl SimulatedDevice {
    /// At rest at `at`, with its workspace around `middle`.
    pub fn new(
        settings: DeviceSettings,
        period: Period,
        middle: [f64; 3],
        at: [f64; 3],
    ) -> Result<Self, SettingError> {
        let settings = settings.checked()?;
        let mass_kg = settings.mass_kg + settings.hand_mass_kg;
        let axis = |x| Rack::new(mass_kg, settings.damping_n_s_per_mm, [settings.friction_n; 2], x);
        Ok(Self {
            settings,
            middle,
            tick_s: period.seconds().0,
            axes: at.map(axis),
            aim: at,
            turn: [0.0; 3],
        })
    }

    /// The device of a scene, over the middle of its tissue.
    pub fn of(settings: &SceneSettings) -> Result<Self, SettingError> {
        let (middle, start) = (settings.middle(), settings.start());
        Self::new(settings.device, settings.period, middle, start)
    }

    pub fn settings(&self) -> &DeviceSettings {
        &self.settings
    }

    /// The sensed pose, in whole steps of the sensors.
    pub fn pose(&self) -> Pose {
        let stepped = |value: f64, step: f64| (value / step).round() * step;
        Pose {
            at: self.axes.map(|axis| stepped(axis.x, self.settings.step_mm)),
            turn: self.turn.map(|turn| stepped(turn, self.settings.turn_step_rad)),
        }
    }

    /// True motion and energies along x, y and z.
    pub fn axes(&self) -> &[Rack; 3] {
        &self.axes
    }

    /// Moves through `ticks` ticks, a thousand at most, with `force` (N) held on the stylus, led by a hand. A hand at no number
    /// stays where it was.
    pub fn follow(&mut self, hand: HandPose, force: [f64; 3], ticks: u64) {
        let (force, _) = self.settings.limit_force(force);
        let target = if hand.is_finite() {
            self.turn = hand.turn;
            [0, 1, 2].map(|axis| {
                let reach = 0.5 * self.settings.workspace_mm[axis];
                hand.at[axis].clamp(self.middle[axis] - reach, self.middle[axis] + reach)
            })
        } else {
            self.aim
        };
        for _ in 0..ticks.min(LED_MAX) {
            self.tick(target, force);
        }
    }

    fn tick(&mut self, target: [f64; 3], force: [f64; 3]) {
        let way = [0, 1, 2].map(|axis| target[axis] - self.aim[axis]);
        let share =
            (self.settings.hand_speed_max_mm_per_s * self.tick_s / length(way).max(1e-12)).min(1.0);
        let speed = way.map(|part| part * share / self.tick_s);
        let dt = self.tick_s / f64::from(PARTS);
        let grip = SimulatedHand {
            mass_kg: self.settings.hand_mass_kg,
            stiffness: self.settings.hand_stiffness_n_per_mm,
            damping: self.settings.hand_damping_n_s_per_mm,
            path: HandPath::Still { at: 0.0 },
        };
        for axis in 0..3 {
            for part in 0..PARTS {
                let place = self.aim[axis] + (f64::from(part) + 0.5) * dt * speed[axis];
                let forces = RackForces { motor: force[axis], hand: [place, speed[axis]] };
                self.axes[axis].step(&forces, &grip, dt);
            }
            self.aim[axis] += share * way[axis];
        }
    }
}

/// Length of a vector.
pub(super) fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}
