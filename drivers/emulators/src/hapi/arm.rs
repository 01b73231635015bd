//! The arm: the simulated device of the scene in the plane of the linkage, with a hand that pokes.

use palpate_haptics::rig::Pantograph;
use palpate_haptics::scene::{DeviceSettings, HandPose, SimulatedDevice};
use palpate_haptics::{Period, SettingError};
use palpate_model::Nanos;
use std::f64::consts::TAU;

/// Step of the simulation: a quarter of a millisecond, some parts of an exchange.
const STEP: Nanos = Nanos(250_000);
/// Angles in the home position in degrees, as the set-up of Haply's examples has them.
pub(super) const HOME_DEGREES: [f64; 2] = [168.0, 12.0];

/// Mechanics of an arm, and the hand on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapiArmSettings {
    pub linkage: Pantograph,
    /// Mass, friction, damping and the hand's spring, along the plane's x and y.
    pub device: DeviceSettings,
    /// The point around which the hand swings, in mm of the plane.
    pub middle_mm: [f64; 2],
    /// How far it swings along x and y in mm.
    pub swing_mm: [f64; 2],
    /// Swings a second.
    pub swing_hz: f64,
}

impl Default for HapiArmSettings {
    /// Of the class of a desktop device, with a hand that pokes 8 mm deep twice a second. No measured arm.
    fn default() -> Self {
        Self {
            linkage: Pantograph::TWO_DIY,
            device: DeviceSettings {
                // From home, 54 mm before the middle, to a square of 100 mm around it.
                workspace_mm: [100.0, 120.0, 1.0],
                ..DeviceSettings::default()
            },
            middle_mm: [19.0, 90.0],
            swing_mm: [3.0, 8.0],
            swing_hz: 2.0,
        }
    }
}

/// An arm in motion.
#[derive(Clone, Debug)]
pub struct HapiArm {
    settings: HapiArmSettings,
    device: SimulatedDevice,
    steps: u64,
    /// When the hand leaves the home position.
    leaves_at: Option<Nanos>,
}

impl HapiArm {
    /// At rest in its home position.
    pub fn new(settings: HapiArmSettings) -> Result<Self, SettingError> {
        let period = Period::of_nanos(STEP.0).unwrap_or(Period::MILLISECOND);
        let home = settings.linkage.place(HOME_DEGREES.map(f64::to_radians));
        let [x, y] = home.unwrap_or(settings.middle_mm);
        let [middle_x, middle_y] = settings.middle_mm;
        let middle = [middle_x, middle_y, 0.0];
        let device = SimulatedDevice::new(settings.device, period, middle, [x, y, 0.0])?;
        Ok(Self { settings, device, steps: 0, leaves_at: None })
    }

    /// The hand leads the arm from then on.
    pub fn lead_from(&mut self, at: Nanos) {
        self.leaves_at.get_or_insert(at);
    }

    /// Moves to `now` under torques of motors 1 and 2 in N m.
    pub fn advance(&mut self, now: Nanos, torques: [f64; 2]) {
        let until = now.0 / STEP.0;
        // After a pause of the computer the hand goes on from where it is.
        self.steps = self.steps.max(until.saturating_sub(1000));
        while self.steps < until {
            self.steps += 1;
            let now = Nanos(self.steps * STEP.0);
            let Some(leaves_at) = self.leaves_at.filter(|at| *at <= now) else { continue };
            let t = now.since(leaves_at).seconds().0;
            let swing = (TAU * self.settings.swing_hz * t).sin();
            let [x, y] =
                [0, 1].map(|i| self.settings.middle_mm[i] + self.settings.swing_mm[i] * swing);
            let [along, across] = self.force(torques);
            let hand = HandPose { at: [x, y, 0.0], turn: [0.0; 3] };
            self.device.follow(hand, [along, across, 0.0], 1);
        }
    }

    /// The force in N that torques in N m make where the arm is.
    #[must_use]
    pub fn force(&self, torques: [f64; 2]) -> [f64; 2] {
        let angles = self.settings.linkage.angles(self.place_mm());
        let torques = torques.map(|torque| 1e3 * torque);
        angles.and_then(|angles| self.settings.linkage.force(angles, torques)).unwrap_or_default()
    }

    /// Where it is in mm of the plane.
    #[must_use]
    pub fn place_mm(&self) -> [f64; 2] {
        let [x, y, _] = self.device.axes().map(|axis| axis.x);
        [x, y]
    }

    /// The motors' angles in degrees; those of home out of reach.
    #[must_use]
    pub fn degrees(&self) -> [f64; 2] {
        let angles = self.settings.linkage.angles(self.place_mm());
        angles.map_or(HOME_DEGREES, |angles| angles.map(f64::to_degrees))
    }
}
