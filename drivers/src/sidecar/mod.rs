//! A rig, a load cell or sensors as a separate program or board that speaks the sidecar protocol.
//!
//! The protocol is described in `docs/sidecar-protocol.md`. Read [`protocol`] first, then [`description`], then
//! `session/`, the dialogue with a whole rig. [`cell`] is a load cell beside another axis, `sensor_line.rs` and
//! `sensor_rig.rs` are sensors beside any rig.

mod budget;
mod cell;
pub mod conform;
pub mod connect;
pub mod description;
pub mod protocol;
mod sensor_line;
mod sensor_rig;
pub mod sensors;
mod session;
pub mod skeleton;

pub use connect::{ConnectedSidecar, connect};
pub use description::SidecarDescription;
pub use sensor_rig::{SensorDevice, SensorRig};
pub use session::SidecarSession;

use crate::cell::CellDevice;
use crate::device::{DeviceRig, OpenError, OpenedDevices, RigDevice};
use crate::devices::{DeviceKind, DeviceRole, find_line};
use crate::rig_file::{self, Fields};
use crate::text::DeviceError;
use crate::wire::{DeviceAddress, HostClock, Link, LinkThread, lock};
use connect::DEVICE;
use description::{SidecarAxis, SidecarCell};
use palpate_model::Nanos;
use palpate_model::rig::{RigDescription, SensorReading};
use palpate_model::units::{MmPerS, MmPerS2, Position, Seconds, Volts};
use protocol::{HostMessage, SidecarMessage};
use sensors::{SensorReports, SharedValues};
use std::collections::BTreeMap;
use std::sync::Arc;

const WORD: &str = "sidecar";
const TITLE: &str = "a sidecar";
const INTRODUCTION: &str = "sidecar, ";
/// The number of the farewell: larger than any before it.
const FAREWELL_NUMBER: u64 = u32::MAX as u64;
const FLOODED: &str = "the sidecar sends far more than it promised";
const BEYOND_RANGE: &str = "the load cell's signal is at the end of its converter's range; take the load off, or check the cell's wires";
/// Step in which speeds are reported; a sidecar makes any.
const SPEED_QUANTUM: MmPerS = MmPerS(0.001);
/// A motion begins up to a sample before the first that shows it, and a tick is rounded.
const LAG_PERIODS: f64 = 1.5;

/// As a whole rig.
pub(crate) const KIND: DeviceKind = DeviceKind {
    word: WORD,
    title: TITLE,
    introduction: INTRODUCTION,
    role: DeviceRole::Axis(rig_file::sidecar),
    recognise: |lines| find_line(lines, is_of_sidecar),
};

/// As a load cell beside another axis.
pub(crate) const CELL_KIND: DeviceKind =
    DeviceKind { role: DeviceRole::Cell { read: read_cell, emulation: None }, ..KIND };

/// Its answer to a line that it does not understand, or that it has started.
fn is_of_sidecar(line: &str) -> bool {
    let text = line.rsplit_once('*').map_or(line, |(text, _)| text);
    matches!(
        SidecarMessage::parse(text),
        Some(SidecarMessage::No { .. } | SidecarMessage::Boot(_) | SidecarMessage::Description(_))
    )
}

#[derive(Clone, Debug, PartialEq)]
pub struct SidecarSettings {
    pub name: String,
    pub serial_number: Option<String>,
    /// Where less of the travel is to be used than the sidecar has.
    pub travel: Option<Position>,
    /// Largest speed that the rig may be trusted with.
    pub speed_max: MmPerS,
    /// Where less is to be used than the sidecar makes.
    pub acceleration: Option<MmPerS2>,
    /// Longest way of the probe without a sample.
    pub unseen: Position,
}

impl SidecarSettings {
    fn speed_max(&self, axis: &SidecarAxis) -> MmPerS {
        MmPerS(self.speed_max.0.min(axis.speed_max))
    }

    fn acceleration(&self, axis: &SidecarAxis) -> MmPerS2 {
        let own = axis.acceleration;
        MmPerS2(self.acceleration.map_or(own, |wanted| wanted.0.min(own)))
    }

    /// What is missing for a rig, or the parts of it.
    pub fn parts(
        &self,
        about: &SidecarDescription,
    ) -> Result<(SidecarAxis, SidecarCell), DeviceError> {
        let unfit = |detail: String| DeviceError::unfit(DEVICE, detail);
        let (Some(axis), Some(cell)) = (about.axis, about.cell) else {
            let what = if about.axis.is_none() { "axis" } else { "load cell" };
            return Err(unfit(format!("it has no {what}, so it is not a whole rig")));
        };
        if self.travel.is_some_and(|travel| travel.0 > axis.travel_mm) {
            let end = axis.travel_mm;
            return Err(unfit(format!(
                "its travel ends at {end} mm; give at most that as travel_mm in the rig file"
            )));
        }
        let sensors = about.rig_sensors("");
        sensor_rig::check_count(sensors.channels.len(), sensors.digital_inputs)?;
        Ok((axis, cell))
    }
}

/// Largest way of the axis after the link is lost: a silence at full speed, and the braking.
#[must_use]
pub fn worst_case_mm(speed: MmPerS, acceleration: MmPerS2, silence: Nanos) -> f64 {
    speed.0 * silence.seconds().0 + speed.0 * speed.0 / (2.0 * acceleration.0)
}

pub type SidecarRig = DeviceRig<SidecarDevice>;

#[derive(Clone)]
pub struct SidecarDevice {
    pub place: DeviceAddress,
    pub settings: SidecarSettings,
    values: SharedValues,
}

impl SidecarDevice {
    #[must_use]
    pub fn new(place: DeviceAddress, settings: SidecarSettings) -> Self {
        Self { place, settings, values: SharedValues::default() }
    }
}

impl RigDevice for SidecarDevice {
    fn open(&mut self, clock: &HostClock) -> Result<OpenedDevices, OpenError> {
        // Values of an earlier connection, and of another rig of the same file, are not its own.
        self.values = SharedValues::default();
        open(self.place.open()?, &self.settings, Arc::clone(&self.values), clock)
    }

    fn take_sensors(&mut self) -> Vec<SensorReading> {
        lock(&self.values).drain(..).collect()
    }
}

/// Sets up the sidecar behind a link and begins to take samples.
pub fn open(
    mut link: Box<dyn Link>,
    settings: &SidecarSettings,
    values: SharedValues,
    clock: &HostClock,
) -> Result<OpenedDevices, OpenError> {
    let device: Arc<str> = WORD.into();
    let serial = settings.serial_number.as_deref();
    let connected = connect(link.as_mut(), clock, &device, serial)?;
    let about = &connected.description;
    let parts = settings.parts(about)?;
    let reports = SensorReports::new(about, (0, 0), values);
    let session = SidecarSession::new(settings, &connected, parts, reports, clock());
    let description = describe(settings, about, parts);
    let farewell = HostMessage::Bye.line(FAREWELL_NUMBER, about.crc);
    Ok(OpenedDevices {
        description,
        newtons_per_volt: parts.1.newtons_per_volt,
        link: None,
        lines: vec![LinkThread::start(link, session, clock, device, farewell)?],
        raw: connected.raw,
    })
}

/// What a rig made of a sidecar is.
#[must_use]
pub fn describe(
    settings: &SidecarSettings,
    about: &SidecarDescription,
    (axis, cell): (SidecarAxis, SidecarCell),
) -> RigDescription {
    let (speed_max, acceleration) = (settings.speed_max(&axis), settings.acceleration(&axis));
    let far = worst_case_mm(speed_max, acceleration, about.silence());
    let period = 1.0 / about.rate;
    RigDescription {
        name: settings.name.clone(),
        // Rounded up: it is a bound.
        identity: format!(
            "{}, {} samples per second; the axis stops within {:.1} mm after the link is lost",
            about.identity(),
            about.rate,
            (far * 10.0).ceil() / 10.0
        ),
        settings: BTreeMap::new(),
        mm_per_pulse: axis.mm_per_pulse,
        travel: settings.travel.unwrap_or(Position(axis.travel_mm)),
        tick_nanos: about.tick_ns,
        speed_quantum: SPEED_QUANTUM,
        speed_max,
        acceleration,
        adc: Some(cell.adc()),
        noise_expected: Volts(cell.noise_v),
        pulse_lag: Seconds(axis.lag_ms * 1e-3 + LAG_PERIODS * period),
        cell_delay: Seconds(cell.delay_ms * 1e-3),
        ticks_per_sample: (period * 1e9 / about.tick_ns as f64).max(1.0),
        unseen_max: settings.unseen,
        takes_targets: false,
        sensors: about.rig_sensors(""),
    }
}

/// A sidecar as a load cell, as its rig file describes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SidecarCellSettings {
    pub serial_number: Option<String>,
    /// Noise at rest in V, where that of the description does not hold.
    pub noise_v: Option<f64>,
}

fn read_cell(fields: &mut Fields) -> Option<Arc<dyn CellDevice>> {
    Some(Arc::new(SidecarCellSettings {
        serial_number: fields.text("cell.serial_number"),
        noise_v: fields.number("cell.noise_v", 0.0, 1e3),
    }))
}
