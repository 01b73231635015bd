//! The keys of a Grbl board.

use super::RigFile;
use super::address::read_address;
use super::fields::{DIRECTIONS, Fields};
use crate::grbl::{GrblSettings, HomeSwitch, MM_PER_STEP_MIN};
use crate::split_rig::SplitRigDevices;
use crate::wire::DeviceAddress;

/// A rig with the board and the load cell beside it of a rig file.
pub(crate) fn grbl(name: String, fields: &mut Fields) -> Option<RigFile> {
    // Both are read, so that the mistakes of both are reported.
    let (axis, cell) = (read(name, fields), super::read_cell(fields));
    let (axis, cell) = (axis?, cell?);
    if axis.0 == cell.0 {
        fields.mistake(
            "cell.port",
            "the Grbl board uses this port; give another port for the load cell",
        );
        return None;
    }
    let places = vec![axis.0.clone(), cell.0.clone()];
    Some(RigFile::of(places, SplitRigDevices::new(axis, cell)))
}

pub(super) fn read(name: String, fields: &mut Fields) -> Option<(DeviceAddress, GrblSettings)> {
    // A pseudo-terminal or a port; servers for serial ports on a network do no harm either.
    let place = read_address(fields, "");
    let axes = [("X", 'X'), ("Y", 'Y'), ("Z", 'Z')];
    let axis = fields.choice("axis", &axes, Some('X'));
    let mm_per_pulse = fields.required_number("mm_per_pulse", 1e-6, 1.0);
    if mm_per_pulse.is_some_and(|mm| mm < MM_PER_STEP_MIN) {
        fields.mistake(
            "mm_per_pulse",
            "Grbl reports positions in thousandths of a mm, so a step must be at least 0.001 mm; set the drive to coarser microsteps",
        );
    }
    let is_reversed = fields.choice("direction", &DIRECTIONS, Some(false));
    let limits = fields.limits();
    let home = fields.choice(
        "home_switch",
        &[("limit", HomeSwitch::Limit), ("probe", HomeSwitch::Probe)],
        None,
    );
    let is_closed_home = fields.flag("closed_is_home");
    if is_closed_home.is_some() && home == Some(HomeSwitch::Probe) {
        fields.mistake(
            "closed_is_home",
            "this key has no effect with a home switch on the probe pin; remove the key",
        );
    }
    let build_info = fields.text("build_info");
    let is_unlocking = fields.flag("unlock").unwrap_or(false);
    let limits = limits?;
    Some((
        place?,
        GrblSettings {
            name,
            axis: axis?,
            mm_per_pulse: mm_per_pulse?,
            is_reversed: is_reversed?,
            travel: limits.travel,
            speed_max: limits.speed_max,
            acceleration: limits.acceleration,
            unseen: limits.unseen,
            home: home?,
            is_closed_home: is_closed_home.unwrap_or(false),
            build_info,
            is_unlocking,
        },
    ))
}
