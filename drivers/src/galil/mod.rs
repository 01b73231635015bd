//! A Galil DMC controller on a serial line or a network, with a pulse-driven slide on one axis and the load cell on an
//! analog input.
//!
//! Read [`protocol`] first, then `session`, the dialogue in progress, then `connect.rs`, what happens once when the
//! controller is opened. [`GalilRig`] puts a session on a link.

mod capture;
mod clock_alignment;
mod connect;
mod console;
mod error;
mod model;
mod order;
pub mod protocol;
mod recording;
mod sampling;
mod session;
mod settings;
mod sine;
mod watchdog;

use crate::device::{DeviceRig, OpenError, OpenedDevices, RigDevice};
use crate::devices::{DeviceKind, DeviceRole, find_line};
use crate::wire::{DeviceAddress, HostClock, LinkThread};
use std::sync::Arc;

pub use connect::{ConnectedGalil, connect};
pub use error::{ErrorCode, GalilError};
pub use model::{GalilBoard, GalilOpenError};
pub use session::GalilSession;
pub use settings::{AnalogRange, GalilSettings, MotorType, Sampling, SwitchLevel};

pub(crate) const KIND: DeviceKind = DeviceKind {
    word: "galil",
    title: "a Galil controller",
    introduction: "Galil controller, ",
    role: DeviceRole::Axis(crate::rig_file::galil),
    recognise: |lines| find_line(lines, |line| line.starts_with("DMC") || line.starts_with("RIO")),
};

pub type GalilRig = DeviceRig<GalilDevice>;

#[derive(Clone)]
pub struct GalilDevice {
    place: DeviceAddress,
    settings: GalilSettings,
    worst_case_mm: f64,
}

impl GalilDevice {
    #[must_use]
    pub fn new(place: DeviceAddress, settings: GalilSettings) -> Self {
        Self { worst_case_mm: settings.travel.0, place, settings }
    }

    /// Longest way of the axis after palpate falls silent, in mm, as it was set up last.
    pub const fn worst_case_mm(&self) -> f64 {
        self.worst_case_mm
    }
}

impl RigDevice for GalilDevice {
    fn open(&mut self, clock: &HostClock) -> Result<OpenedDevices, OpenError> {
        let device: Arc<str> = "galil".into();
        let mut link = self.place.open()?;
        let connected = connect(link.as_mut(), clock, &self.settings, &device)?;
        // The next opening must find the same controller, even if the rig file has no serial number.
        self.settings.serial_number = connected.board.serial_number;
        self.worst_case_mm = connected.worst_case_mm;
        let session = GalilSession::new(self.settings.clone(), &connected, clock());
        // The recording ends too, so that the next program finds an idle controller.
        let farewell = format!("ST{};RC 0\r", self.settings.axis).into_bytes();
        Ok(OpenedDevices {
            description: connected.description,
            newtons_per_volt: None,
            link: Some(connected.link),
            lines: vec![LinkThread::start(link, session, clock, device, farewell)?],
            raw: connected.raw,
        })
    }
}
