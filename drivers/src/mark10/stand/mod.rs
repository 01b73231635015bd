//! The motorised stands ESM301 and ESM303 with a gauge on them, driven by a computer (option "PC Control").
//!
//! Read [`protocol`] first, then `session.rs`, the dialogue in progress, then `open.rs`, what happens once.
//! [`StandRig`] puts a session on a link.
//!
//! # How it moves
//!
//! Before every move the stand's own travel limit is set to the target and read back; then the crosshead is let go
//! towards it. Whatever becomes of the link, the stand stops at the target by itself: the way to the target is the
//! worst case. `s` stops it before.
//!
//! # Where it is
//!
//! The stand reports its travel some hundred times a second at best, and its acceleration is not published. So what
//! is reported is the commanded course, from the sample in which the stand is first seen to move, as long as the
//! stand's own travel agrees with it within [`REST_TOLERANCE_MM`] and the way of [`LAG`] at the speed of the move; if
//! it does not, the stand's travel is reported, and the check of the path ends the run. The stand's own values are in
//! the log.

mod open;
pub mod protocol;
mod session;

pub use open::{ConnectedStand, connect};
pub use session::{StandPace, StandSession};

use super::gauge::GaugeSettings;
use super::protocol::GaugeLine;
use crate::device::{DeviceRig, OpenError, OpenedDevices, RigDevice};
use crate::devices::{DeviceKind, DeviceRole, find_line};
use crate::rig_file;
use crate::wire::{DeviceAddress, HostClock, Link, LinkThread};
use palpate_model::units::{MmPerS, MmPerS2, Position, Seconds};
use std::sync::Arc;

pub(crate) const KIND: DeviceKind = DeviceKind {
    word: "mark10-stand",
    title: "a Mark-10 stand",
    introduction: "force stand at ",
    role: DeviceRole::Axis(rig_file::stand),
    // A travel alone may be that of any caliper.
    recognise: |lines| {
        let is_reading = |line: &str| matches!(GaugeLine::parse(line), GaugeLine::Reading(_));
        find_line(lines, is_reading)?;
        find_line(lines, |line| protocol::travel(line).is_some())
    },
};

/// Smallest step of a travel limit, and so of a move.
pub const MM_PER_PULSE: f64 = 0.01;
/// Largest distance from its target at which the stand may come to rest, in mm. A guess, to be measured on the device.
pub const REST_TOLERANCE_MM: f64 = 0.05;
/// By how long the stand may be behind or before the commanded course: two samples on a slow converter, and its
/// acceleration. A guess, to be measured on the device.
pub const LAG: Seconds = Seconds(0.15);
/// And by which share of the way that is made its speed may be off. A guess.
pub const SPEED_TOLERANCE: f64 = 0.005;

#[derive(Clone, Debug, PartialEq)]
pub struct StandSettings {
    pub name: String,
    /// End of the travel from home. Home is where the stand's travel reads zero.
    pub travel: Position,
    pub speed_max: MmPerS,
    /// Acceleration of the commanded course; the stand's own is not known and cannot be set.
    pub acceleration: MmPerS2,
    /// Longest way of the probe without a sample.
    pub unseen: Position,
    /// Whether up is into the tissue; down without.
    pub is_upwards: bool,
    /// The gauge on it. Its `per_second` does not matter: the stand is asked.
    pub gauge: GaugeSettings,
}

impl StandSettings {
    /// Pulses from home, into the tissue, of the stand's travel, which grows upwards.
    pub fn pulses(&self, travel_hundredths: i64) -> i64 {
        if self.is_upwards { travel_hundredths } else { -travel_hundredths }
    }
}

pub type StandRig = DeviceRig<StandDevice>;

#[derive(Clone)]
pub struct StandDevice {
    pub place: DeviceAddress,
    pub settings: StandSettings,
}

impl RigDevice for StandDevice {
    fn open(&mut self, clock: &HostClock) -> Result<OpenedDevices, OpenError> {
        open(self.place.open()?, &self.settings, clock)
    }
}

/// Sets up the stand behind a link and begins to take samples.
pub fn open(
    mut link: Box<dyn Link>,
    settings: &StandSettings,
    clock: &HostClock,
) -> Result<OpenedDevices, OpenError> {
    let device: Arc<str> = "stand".into();
    let connected = connect(link.as_mut(), clock, settings, &device)?;
    let session = StandSession::new(settings.clone(), &connected, clock());
    let farewell = protocol::STOP.into();
    Ok(OpenedDevices {
        lines: vec![LinkThread::start(link, session, clock, device, farewell)?],
        description: connected.description,
        // The gauge reads newtons, each of which counts as a volt.
        newtons_per_volt: Some(1.0),
        link: None,
        raw: connected.raw,
    })
}
