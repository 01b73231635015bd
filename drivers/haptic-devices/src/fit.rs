//! A device's metres and axes as the scene's millimetres and axes.
//!
//! A place `p` of the device in m is at `middle + scale (R 1000 p - centre)` in the scene, where `R` turns axes. Forces turn
//! back, without a scale: the hand feels the newtons of the model. So at a scale of 2 a millimetre of the hand is two of the
//! scene, and the hand feels twice the stiffness. [`WorkspaceFit::scene_settings`] gives the device as the scene sees it.

use palpate_haptics::scene::{DeviceSettings, Pose};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// An axis of the device. In Haply's convention x points right, y forward and z up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DeviceAxis {
    #[serde(rename = "+x")]
    PlusX,
    #[serde(rename = "-x")]
    MinusX,
    #[serde(rename = "+y")]
    PlusY,
    #[serde(rename = "-y")]
    MinusY,
    #[serde(rename = "+z")]
    PlusZ,
    #[serde(rename = "-z")]
    MinusZ,
}

impl DeviceAxis {
    fn unit(self) -> [f64; 3] {
        match self {
            Self::PlusX => [1.0, 0.0, 0.0],
            Self::MinusX => [-1.0, 0.0, 0.0],
            Self::PlusY => [0.0, 1.0, 0.0],
            Self::MinusY => [0.0, -1.0, 0.0],
            Self::PlusZ => [0.0, 0.0, 1.0],
            Self::MinusZ => [0.0, 0.0, -1.0],
        }
    }
}

/// How a device's workspace lies in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WorkspaceFit {
    /// The device's axes along the scene's x, y and z.
    pub axes: [DeviceAxis; 3],
    /// Millimetres of the scene for each millimetre of the device.
    pub scale: f64,
    /// The point of the device that is in the middle of the tissue's surface, in mm along the scene's axes.
    pub centre_mm: [f64; 3],
}

impl Default for WorkspaceFit {
    /// Axes and millimetres as they are, around the device's origin.
    fn default() -> Self {
        Self {
            axes: [DeviceAxis::PlusX, DeviceAxis::PlusY, DeviceAxis::PlusZ],
            scale: 1.0,
            centre_mm: [0.0; 3],
        }
    }
}

/// A fit that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum FitError {
    #[error(
        "the axes of the haptic device are not three different ones; name x, y and z once each"
    )]
    Axes,
    #[error(
        "the axes of the haptic device mirror the scene, and right becomes left; turn the sign of one axis"
    )]
    Mirrored,
    #[error(
        "the scale of the haptic device is {0}; give a number of scene millimetres for each device millimetre from 0.1 to 10"
    )]
    Scale(f64),
    #[error("the centre of the haptic device is not three finite numbers; give millimetres")]
    Centre,
}

impl WorkspaceFit {
    /// The fit itself, if it is one: a turn, a scale from 0.1 to 10 and a finite centre.
    pub fn checked(self) -> Result<Self, FitError> {
        let [x, y, z] = self.axes.map(DeviceAxis::unit);
        let turned: f64 = (0..3).map(|i| cross(x, y)[i] * z[i]).sum();
        if turned == 0.0 {
            return Err(FitError::Axes);
        }
        if turned < 0.0 {
            return Err(FitError::Mirrored);
        }
        if !(0.1..=10.0).contains(&self.scale) {
            return Err(FitError::Scale(self.scale));
        }
        if !self.centre_mm.iter().all(|part| part.is_finite()) {
            return Err(FitError::Centre);
        }
        Ok(self)
    }

    /// A vector of the device along the scene's axes, in its own unit.
    #[must_use]
    pub fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        // By choice, not by a product with zeros: that would make every part of a vector no number if one is.
        self.axes.map(|axis| match axis {
            DeviceAxis::PlusX => x,
            DeviceAxis::MinusX => -x,
            DeviceAxis::PlusY => y,
            DeviceAxis::MinusY => -y,
            DeviceAxis::PlusZ => z,
            DeviceAxis::MinusZ => -z,
        })
    }

    /// A place of the device in m as one of the scene in mm, the tissue's middle at `middle`.
    #[must_use]
    pub fn place(&self, metres: [f64; 3], middle: [f64; 3]) -> [f64; 3] {
        let turned = self.turned(metres);
        [0, 1, 2].map(|i| middle[i] + self.scale * (1000.0 * turned[i] - self.centre_mm[i]))
    }

    /// A force of the scene in N along the device's axes.
    #[must_use]
    pub fn device_force(&self, force: [f64; 3]) -> [f64; 3] {
        let mut turned = [0.0; 3];
        for (part, axis) in force.into_iter().zip(self.axes) {
            for (sum, unit) in turned.iter_mut().zip(axis.unit()) {
                if unit != 0.0 {
                    *sum += part * unit;
                }
            }
        }
        turned
    }

    /// The stylus in the scene: a place in m and a unit quaternion (w, x, y, z) along the device's axes.
    #[must_use]
    pub fn pose(&self, metres: [f64; 3], quaternion: [f64; 4], middle: [f64; 3]) -> Pose {
        let [w, x, y, z] = quaternion;
        let [x, y, z] = self.turned([x, y, z]);
        Pose { at: self.place(metres, middle), turn: yaw_pitch_roll([w, x, y, z]) }
    }

    /// The device as the scene sees it. Forces are the same and lengths `scale` times as long, and so stiffness, damping and
    /// mass are smaller by `scale`.
    #[must_use]
    pub fn scene_settings(&self, device: &DeviceSettings) -> DeviceSettings {
        let scale = self.scale;
        let reach = self.turned(device.workspace_mm).map(f64::abs);
        DeviceSettings {
            mass_kg: device.mass_kg / scale,
            damping_n_s_per_mm: device.damping_n_s_per_mm / scale,
            friction_n: device.friction_n,
            step_mm: device.step_mm * scale,
            turn_step_rad: device.turn_step_rad,
            force_max_n: device.force_max_n,
            force_continuous_n: device.force_continuous_n,
            stiffness_max_n_per_mm: device.stiffness_max_n_per_mm / scale,
            workspace_mm: reach.map(|side| side * scale),
            hand_mass_kg: device.hand_mass_kg / scale,
            hand_stiffness_n_per_mm: device.hand_stiffness_n_per_mm / scale,
            hand_damping_n_s_per_mm: device.hand_damping_n_s_per_mm / scale,
            hand_speed_max_mm_per_s: device.hand_speed_max_mm_per_s * scale,
        }
    }
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// Yaw about z, then pitch about y, then roll about x, in rad, of a unit quaternion (w, x, y, z).
fn yaw_pitch_roll([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
    let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
    [yaw, pitch, roll]
}

#[cfg(test)]
mod tests {
    use super::*;
    use DeviceAxis::{MinusX, MinusY, MinusZ, PlusX, PlusY, PlusZ};

    const ALL: [DeviceAxis; 6] = [PlusX, MinusX, PlusY, MinusY, PlusZ, MinusZ];

    #[test]
    fn of_all_axes_the_24_turns_are_taken() {
        let mut counts = [0; 3];
        for x in ALL {
            for y in ALL {
                for z in ALL {
                    let fit = WorkspaceFit { axes: [x, y, z], ..WorkspaceFit::default() };
                    match fit.checked() {
                        Ok(_) => counts[0] += 1,
                        Err(FitError::Mirrored) => counts[1] += 1,
                        Err(err) => {
                            assert_eq!(err, FitError::Axes);
                            counts[2] += 1;
                        }
                    }
                }
            }
        }
        // A cube has 24 turns and as many mirrored ones.
        assert_eq!(counts, [24, 24, 168]);
        for scale in [0.0, -1.0, 11.0, f64::NAN] {
            assert!(WorkspaceFit { scale, ..WorkspaceFit::default() }.checked().is_err());
        }
        let centre_mm = [0.0, f64::NAN, 0.0];
        assert!(WorkspaceFit { centre_mm, ..WorkspaceFit::default() }.checked().is_err());
    }

    #[test]
    fn metres_become_millimetres_and_forces_turn_back() {
        let fit = WorkspaceFit {
            axes: [PlusY, MinusX, PlusZ],
            scale: 2.0,
            centre_mm: [10.0, 0.0, 100.0],
        };
        let fit = fit.checked().unwrap();
        // 20 mm along the device's y are 20 mm along the scene's x: 10 mm from the centre, times two.
        let place = fit.place([0.0, 0.02, 0.1], [30.0, 30.0, 0.0]);
        for (part, expected) in place.into_iter().zip([50.0, 30.0, 0.0]) {
            assert!((part - expected).abs() < 1e-9, "{place:?}");
        }
        for force in [[1.0, 2.0, 3.0], [-0.5, 0.0, 2.0]] {
            assert_eq!(fit.turned(fit.device_force(force)), force);
        }
        assert_eq!(fit.device_force([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn work_of_hand_and_scene_is_the_scale_apart() {
        // Work of the scene is force times its path: `scale` times that of the hand.
        let fit = WorkspaceFit { axes: [MinusY, PlusX, PlusZ], scale: 0.5, ..Default::default() };
        let (force, step) = ([1.0, -2.0, 0.5], [0.001, 0.002, -0.004]);
        let scene = fit.place(step, [0.0; 3]);
        let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f64>();
        let hand = 1000.0 * dot(fit.device_force(force), step);
        assert!((dot(force, scene) - 0.5 * hand).abs() < 1e-12);
    }

    #[test]
    fn turns_are_about_the_axes_of_the_scene() {
        // A turn by 1 rad: at a quarter turn of pitch, yaw and roll are one.
        let (cos, sin) = (0.5_f64.cos(), 0.5_f64.sin());
        let identity = WorkspaceFit::default();
        let turn = |fit: &WorkspaceFit, quaternion| fit.pose([0.0; 3], quaternion, [0.0; 3]).turn;
        let close = |turn: [f64; 3], expected: [f64; 3]| {
            // Some roundings of sines and their inverses.
            turn.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14)
        };
        assert!(close(turn(&identity, [cos, 0.0, 0.0, sin]), [1.0, 0.0, 0.0]));
        assert!(close(turn(&identity, [cos, sin, 0.0, 0.0]), [0.0, 0.0, 1.0]));
        assert!(close(turn(&identity, [cos, 0.0, sin, 0.0]), [0.0, 1.0, 0.0]));
        // The scene's x is the device's y: a turn about that is a roll.
        let turned = WorkspaceFit { axes: [PlusY, MinusX, PlusZ], ..identity };
        assert!(close(turn(&turned, [cos, 0.0, sin, 0.0]), [0.0, 0.0, 1.0]));
    }

    #[test]
    fn scaled_device_swings_as_the_device_does() {
        let device = DeviceSettings::default();
        let fit = WorkspaceFit { scale: 4.0, ..WorkspaceFit::default() };
        let scene = fit.scene_settings(&device);
        // Frequencies and time constants do not depend on the unit of length.
        let frequency = |one: &DeviceSettings| one.hand_stiffness_n_per_mm / one.mass_kg;
        let decay = |one: &DeviceSettings| one.damping_n_s_per_mm / one.mass_kg;
        assert!((frequency(&scene) / frequency(&device) - 1.0).abs() < 1e-12);
        assert!((decay(&scene) / decay(&device) - 1.0).abs() < 1e-12);
        assert!((scene.step_mm / device.step_mm - 4.0).abs() < 1e-12);
    }
}
