//! A Galil controller as a rig.

use super::connect::connect;
use super::session::Session;
use super::settings::GalilSettings;
use crate::device::{DeviceRig, OpenError, Opened, RigDevice};
use crate::wire::{HostClock, LinkThread, LinkThreadSettings, Place};
use std::sync::Arc;

pub type GalilRig = DeviceRig<GalilDevice>;

#[derive(Clone)]
pub struct GalilDevice {
    place: Place,
    settings: GalilSettings,
    worst_case_mm: f64,
}

impl GalilDevice {
    #[must_use]
    pub fn new(place: Place, settings: GalilSettings) -> Self {
        Self { worst_case_mm: settings.travel.0, place, settings }
    }

    /// Longest way of the axis after palpate falls silent, in mm, as it was set up last.
    pub const fn worst_case_mm(&self) -> f64 {
        self.worst_case_mm
    }
}

impl RigDevice for GalilDevice {
    fn open(&mut self, clock: &HostClock) -> Result<Opened, OpenError> {
        let device: Arc<str> = "galil".into();
        let mut link = self.place.open()?;
        let connected = connect(link.as_mut(), clock, &self.settings, &device)?;
        // The next opening must find the same controller, even if the rig file has no serial number.
        self.settings.serial_number = connected.board.serial_number;
        self.worst_case_mm = connected.worst_case_mm;
        let session = Session::new(self.settings.clone(), &connected, clock());
        let line_settings = LinkThreadSettings {
            device,
            // The recording ends too, so that the next program finds an idle controller.
            farewell: format!("ST{};RC 0\r", self.settings.axis).into_bytes(),
        };
        Ok(Opened {
            description: connected.description,
            newtons_per_volt: None,
            link: Some(connected.link),
            lines: vec![LinkThread::start(link, session, clock, line_settings)?],
            raw: connected.raw,
        })
    }
}
