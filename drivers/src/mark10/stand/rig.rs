//! A stand as a rig.

use super::StandSettings;
use super::open::connect;
use super::protocol::STOP;
use super::session::StandSession;
use crate::device::{DeviceRig, OpenError, Opened, RigDevice};
use crate::wire::{HostClock, Link, LinkThread, LinkThreadSettings, Place};
use std::sync::Arc;

pub type StandRig = DeviceRig<StandDevice>;

#[derive(Clone)]
pub struct StandDevice {
    pub place: Place,
    pub settings: StandSettings,
}

impl RigDevice for StandDevice {
    fn open(&mut self, clock: &HostClock) -> Result<Opened, OpenError> {
        open(self.place.open()?, &self.settings, clock)
    }
}

/// Sets up the stand behind a link and begins to take samples.
pub fn open(
    mut link: Box<dyn Link>,
    settings: &StandSettings,
    clock: &HostClock,
) -> Result<Opened, OpenError> {
    let device: Arc<str> = "stand".into();
    let connected = connect(link.as_mut(), clock, settings, &device)?;
    let session = StandSession::new(settings.clone(), &connected, clock());
    let line_settings = LinkThreadSettings { device, farewell: STOP.into() };
    Ok(Opened {
        lines: vec![LinkThread::start(link, session, clock, line_settings)?],
        description: connected.description,
        // The gauge reads newtons, each of which counts as a volt.
        newtons_per_volt: Some(1.0),
        link: None,
        raw: connected.raw,
    })
}
