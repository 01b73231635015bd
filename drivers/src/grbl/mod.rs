//! A Grbl 1.1 board with a slide on one of its axes.
//!
//! Read [`protocol`] first, then `session.rs`, the dialogue in progress, then `connect.rs`, what happens once when the
//! board is opened. The board has no load cell: [`crate::split_rig`] makes a rig of it and one.

mod connect;
mod console;
mod error;
mod feed_correction;
mod fitness;
mod motion;
mod pins;
pub mod protocol;
mod session;
mod settings;
mod times;

use crate::device::OpenError;
use crate::devices::{DeviceKind, DeviceRole, find_line};
use crate::split_rig::{AxisTrack, OpenedAxis, TICK};
use crate::wire::{HostClock, Link, LinkThread};
use palpate_model::rig::RigDescription;
use palpate_model::units::{MmPerS, Seconds, Volts};
use protocol::{GrblLine, JOG_CANCEL};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

pub use connect::{ConnectedGrbl, connect};
pub use error::{GrblCode, GrblOpenError};
pub use fitness::MM_PER_STEP_MIN;
pub use motion::worst_case_mm;
pub use session::{GrblSession, SharedTrack};
pub use settings::{BoardParameters, GrblSettings, HomeSwitch};

pub(crate) const KIND: DeviceKind = DeviceKind {
    word: "grbl",
    title: "a Grbl controller",
    introduction: "Grbl, ",
    role: DeviceRole::Axis(crate::rig_file::grbl),
    recognise: |lines| find_line(lines, is_of_grbl),
};

/// Its banner, a status report, an error, an alarm or a message.
fn is_of_grbl(line: &str) -> bool {
    match GrblLine::parse(line) {
        GrblLine::Hello(_) | GrblLine::Status(_) => true,
        GrblLine::Refused(refusal) => refusal.code.is_some(),
        GrblLine::Alarm(alarm) => alarm.code.is_some(),
        GrblLine::Message(message) => message.starts_with("MSG:"),
        _ => false,
    }
}

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
    let ConnectedGrbl { identity, parameters: facts, stats, raw, .. } =
        connect(link.as_mut(), clock, settings, &device)?;
    let track = Arc::new(Mutex::new(AxisTrack::at_rest(settings.sign() * facts.steps)));
    let session = GrblSession::new(settings.clone(), facts, Arc::clone(&track), stats, clock());
    let line = LinkThread::start(link, session, clock, device, vec![JOG_CANCEL])?;
    let description = RigDescription {
        name: settings.name.clone(),
        identity,
        settings: BTreeMap::new(),
        mm_per_pulse: settings.mm_per_pulse,
        travel: settings.travel,
        tick_nanos: TICK.0,
        speed_quantum: SPEED_QUANTUM,
        speed_max: settings.speed_max,
        acceleration: settings.acceleration,
        adc: None,
        noise_expected: Volts(0.0),
        ticks_per_sample: 1.0,
        unseen_max: settings.unseen,
        takes_targets: false,
        sensors: Default::default(),
        pulse_lag: LAG,
        cell_delay: Seconds(0.0),
    };
    Ok((description, OpenedAxis { line, track, raw }))
}
