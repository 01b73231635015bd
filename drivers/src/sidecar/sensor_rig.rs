//! Any rig with sidecars beside it that only measure.

use super::connect::connect;
use super::protocol::HostMessage;
use super::sensor_line::SensorLine;
use super::sensors::{SensorReports, SharedValues};
use super::{FAREWELL_NUMBER, connect::DEVICE};
use crate::device::{CallerTime, OpenError};
use crate::rig::{Rig, RigError, RigEvent, RigEventBody};
use crate::text::DeviceError;
use crate::wire::{DeviceAddress, HaltHandle, HostClock, LinkStats, LinkThread, lock};
use palpate_model::Nanos;
use palpate_model::rig::{
    CHANNELS_MAX, DIGITAL_INPUTS_MAX, Fault, HandAction, RawBytes, RigCommand, RigDescription,
    SensorReading,
};
use std::sync::Arc;
use std::time::Duration;

/// A table `[sensors.NAME]` of a rig file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorDevice {
    pub name: String,
    pub place: DeviceAddress,
    pub serial_number: Option<String>,
}

pub struct SensorRig {
    inner: Box<dyn Rig>,
    devices: Vec<SensorDevice>,
    clock: HostClock,
    lines: Vec<LinkThread>,
    values: SharedValues,
    description: RigDescription,
    /// Bytes exchanged before the threads had the links, by the host's clock.
    raw: Vec<RawBytes>,
    time: CallerTime,
}

impl SensorRig {
    /// Opens the sensors beside a rig that is open.
    pub fn open(
        inner: Box<dyn Rig>,
        devices: Vec<SensorDevice>,
        clock: HostClock,
    ) -> Result<Self, OpenError> {
        let mut rig = Self {
            description: inner.description().clone(),
            inner,
            devices,
            clock,
            lines: Vec::new(),
            values: SharedValues::default(),
            raw: Vec::new(),
            time: CallerTime::default(),
        };
        rig.open_sensors()?;
        Ok(rig)
    }

    fn open_sensors(&mut self) -> Result<(), OpenError> {
        self.description = self.inner.description().clone();
        for device in &self.devices {
            let name: Arc<str> = format!("sensors.{}", device.name).into();
            let mut link = device.place.open()?;
            let serial = device.serial_number.as_deref();
            let connected = connect(link.as_mut(), &self.clock, &name, serial)?;
            let about = &connected.description;
            let sensors = &mut self.description.sensors;
            let own = about.rig_sensors(&format!("{}.", device.name));
            // At most 16 channels and 8 inputs, checked each time.
            let numbers = (sensors.channels.len() as u8, sensors.digital_inputs);
            let reports = SensorReports::new(about, numbers, Arc::clone(&self.values));
            sensors.channels.extend(own.channels);
            sensors.digital_inputs += own.digital_inputs;
            sensors.has_bath |= own.has_bath;
            check_count(sensors.channels.len(), sensors.digital_inputs)?;
            self.description.identity += &format!("; {}", about.identity());
            let line = SensorLine::new(&connected, reports, (self.clock)());
            let farewell = HostMessage::Bye.line(FAREWELL_NUMBER, about.crc);
            self.raw.extend(connected.raw);
            self.lines.push(LinkThread::start(link, line, &self.clock, name, farewell)?);
        }
        Ok(())
    }

    /// A fault of a sidecar beside the rig, if there is one.
    fn take_fault(&mut self, end: Nanos) -> Option<RigEvent> {
        self.lines.iter().find_map(|line| {
            let event = line.next_event(end, Duration::ZERO)?;
            let body = match event.body {
                RigEventBody::Fault(Fault::LinkLost { detail }) => {
                    let detail = format!("{}: {detail}", line.device());
                    RigEventBody::Fault(Fault::LinkLost { detail })
                }
                RigEventBody::Fault(Fault::CommandRefused { detail }) => {
                    RigEventBody::refusal(format!("{}: {detail}", line.device()))
                }
                other => other,
            };
            Some(RigEvent::new(event.at, body))
        })
    }
}

/// Whether a rig can have so many channels and digital inputs.
pub(super) fn check_count(channels: usize, digital_inputs: u8) -> Result<(), DeviceError> {
    if channels > CHANNELS_MAX || usize::from(digital_inputs) > DIGITAL_INPUTS_MAX {
        let detail = format!(
            "the rig has {channels} channels and {digital_inputs} digital inputs with it, but at most {CHANNELS_MAX} and {DIGITAL_INPUTS_MAX} are possible"
        );
        return Err(DeviceError::unfit(DEVICE, detail));
    }
    Ok(())
}

impl Rig for SensorRig {
    fn description(&self) -> &RigDescription {
        &self.description
    }

    fn send(&mut self, command: RigCommand) {
        self.inner.send(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let end = self.time.host_end((self.clock)(), until);
        if let Some(fault) = self.take_fault(end) {
            return Some(RigEvent::new(self.time.event_time(fault.at, until), fault.body));
        }
        let event = self.inner.next_event(until)?;
        self.time.note(event.at);
        Some(event)
    }

    fn reconnect(&mut self) -> Result<(), RigError> {
        let closed = self.lines.drain(..).flat_map(LinkThread::close);
        self.raw.extend(closed);
        self.inner.reconnect()?;
        self.open_sensors()
            .map_err(|error| RigError::Device { file: self.description.name.clone(), error })
    }

    fn link(&self) -> Option<&str> {
        self.inner.link()
    }

    fn is_virtual(&self) -> bool {
        self.inner.is_virtual()
    }

    fn apply_hand_action(&mut self, action: HandAction) {
        self.inner.apply_hand_action(action);
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        let mut raw = std::mem::take(&mut self.raw);
        raw.extend(self.lines.iter().flat_map(LinkThread::take_raw));
        for piece in &mut raw {
            piece.at = self.time.caller_time(piece.at);
        }
        raw.extend(self.inner.take_raw());
        raw.sort_by_key(|piece| piece.at);
        raw
    }

    fn take_sensors(&mut self) -> Vec<SensorReading> {
        let mut all = self.inner.take_sensors();
        all.extend(lock(&self.values).drain(..));
        all
    }

    fn newtons_per_volt(&self) -> Option<f64> {
        self.inner.newtons_per_volt()
    }

    fn halt_handle(&self) -> Option<HaltHandle> {
        self.inner.halt_handle()
    }

    fn links(&self) -> Vec<(String, LinkStats)> {
        let lines = self.lines.iter();
        let own = lines.map(|line| (line.device().to_owned(), line.stats()));
        self.inner.links().into_iter().chain(own).collect()
    }
}
