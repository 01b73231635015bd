//! A Grbl board as the axis of a rig.

use super::connect::{Connected, connect};
use super::protocol::JOG_CANCEL;
use super::session::Session;
use super::settings::GrblSettings;
use crate::device::OpenError;
use crate::parts::{OpenedAxis, Track};
use crate::wire::{HostClock, Link, LinkThread, LinkThreadSettings};
use palpate_model::rig::RigDescription;
use palpate_model::units::{MmPerS, Seconds, Volts};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// Grbl makes any speed; this is the step in which speeds are reported, 0.6 mm/min.
const SPEED_QUANTUM: MmPerS = MmPerS(0.01);
/// A stop begins with what Grbl has made ahead, five segments of 10 ms, and the start of a motion is known to some ms.
const LAG: Seconds = Seconds(0.08);

/// Sets up the board behind a link and begins to talk to it. The description has no load cell yet.
pub fn open(
    mut link: Box<dyn Link>,
    settings: &GrblSettings,
    clock: &HostClock,
) -> Result<(RigDescription, OpenedAxis), OpenError> {
    let device: Arc<str> = "grbl".into();
    let Connected { identity, facts, stats, raw, .. } =
        connect(link.as_mut(), clock, settings, &device)?;
    let track = Arc::new(Mutex::new(Track::at_rest(settings.sign() * facts.steps)));
    let session = Session::new(settings.clone(), facts, Arc::clone(&track), stats, clock());
    let line_settings = LinkThreadSettings { device, farewell: vec![JOG_CANCEL] };
    let line = LinkThread::start(link, session, clock, line_settings)?;
    let description = RigDescription {
        name: settings.name.clone(),
        identity,
        settings: BTreeMap::new(),
        mm_per_pulse: settings.mm_per_pulse,
        travel: settings.travel,
        tick_nanos: crate::parts::TICK.0,
        speed_quantum: SPEED_QUANTUM,
        speed_max: settings.speed_max,
        acceleration: settings.acceleration,
        adc: None,
        noise_expected: Volts(0.0),
        ticks_per_sample: 1.0,
        unseen_max: settings.unseen,
        sensors: Default::default(),
        pulse_lag: LAG,
        cell_delay: Seconds(0.0),
    };
    Ok((description, OpenedAxis { line, track, raw }))
}
