//! The keys of a Galil controller.

use super::RigFile;
use super::address::read_address;
use super::fields::{DIRECTIONS, Fields};
use crate::galil::{AnalogRange, GalilDevice, GalilSettings, MotorType, Sampling, SwitchLevel};
use crate::wire::DeviceAddress;
use palpate_model::units::Volts;

pub(crate) fn galil(name: String, fields: &mut Fields) -> Option<RigFile> {
    let (place, settings) = read(name, fields)?;
    let device = GalilDevice::new(place.clone(), settings);
    Some(RigFile::of(vec![place], device))
}

/// Address and settings of the controller.
pub(super) fn read(name: String, fields: &mut Fields) -> Option<(DeviceAddress, GalilSettings)> {
    let place = read_address(fields, "");
    let serial_number = fields.whole_number("serial_number", 0, 1_000_000_000_000_000);
    let axis = fields.text("axis").unwrap_or_else(|| "A".into());
    let axis = match axis.as_bytes() {
        [letter @ b'A'..=b'H'] => char::from(*letter),
        _ => {
            fields.mistake("axis", "give a letter from A to H");
            'A'
        }
    };
    let input = fields.whole_number("input", 1, 8).unwrap_or(1);
    let mm_per_pulse = fields.required_number("mm_per_pulse", 1e-6, 1.0);
    let is_reversed = fields.choice("direction", &DIRECTIONS, Some(false));
    let limits = fields.limits();
    let motor_type = fields.choice("motor_type", &MOTOR_TYPES, Some(MotorType::ActiveLow));
    let limit_switches = fields.choice("limit_switches", &LEVELS, Some(SwitchLevel::ActiveLow));
    let home = fields.choice("home_switch", &LEVELS, Some(SwitchLevel::ActiveLow));
    let range = fields.choice("range", &RANGES, Some(AnalogRange::Bipolar10));
    let bits = fields.choice("converter", &[("12 bit", 12), ("16 bit", 16)], None);
    let noise = fields.number("noise_v", 1e-9, 1.0);
    let filter = fields.text("filter");
    let has_watchdog = fields.flag("watchdog").unwrap_or(true);
    let sampling = fields.choice("sampling", &SAMPLINGS, Some(Sampling::Auto));
    // Up to 1000, as `TM` starts; at 500 the watchdog is still renewed often enough.
    let sample_us = fields.whole_number("sample_us", 500, 1000);
    let (mm_per_pulse, limits) = (mm_per_pulse?, limits?);
    // The least acceleration that the controller makes (`AC`, DMC-40x0 command reference).
    if limits.acceleration.0 / mm_per_pulse < 1024.0 {
        let least = 1024.0 * mm_per_pulse;
        fields.mistake(
            "acceleration_mm_s2",
            &format!("give at least {least:.4} mm/s2, the lowest acceleration of the controller for this mm_per_pulse"),
        );
    }
    let range = range?;
    let bits = bits?;
    let counts = f64::from(1_u32 << bits);
    Some((
        place?,
        GalilSettings {
            name,
            axis,
            // Between 1 and 8, both checked.
            input: input as u8,
            mm_per_pulse,
            is_reversed: is_reversed?,
            travel: limits.travel,
            speed_max: limits.speed_max,
            acceleration: limits.acceleration,
            unseen: limits.unseen,
            motor_type: motor_type?,
            limits: limit_switches?,
            home: home?,
            range,
            bits,
            // Without better knowledge, a count of the converter.
            noise: Volts(noise.unwrap_or(range.span().0 / counts)),
            serial_number,
            has_watchdog,
            filter,
            sampling: sampling?,
            sample_us: sample_us.map(|us| us as u16),
        },
    ))
}

const MOTOR_TYPES: [(&str, MotorType); 2] =
    [("active-low", MotorType::ActiveLow), ("active-high", MotorType::ActiveHigh)];

const LEVELS: [(&str, SwitchLevel); 2] =
    [("active-low", SwitchLevel::ActiveLow), ("active-high", SwitchLevel::ActiveHigh)];

const RANGES: [(&str, AnalogRange); 4] = [
    ("-10..10 V", AnalogRange::Bipolar10),
    ("-5..5 V", AnalogRange::Bipolar5),
    ("0..5 V", AnalogRange::Unipolar5),
    ("0..10 V", AnalogRange::Unipolar10),
];

const SAMPLINGS: [(&str, Sampling); 3] =
    [("auto", Sampling::Auto), ("poll", Sampling::Poll), ("record", Sampling::Record)];
