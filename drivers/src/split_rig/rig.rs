//! An axis and a load cell as one rig.

use super::cell_line::{CellLine, TICK};
use super::track::AxisTrack;
use crate::cell::CellDevice;
use crate::device::{OpenError, OpenedDevices, RigDevice};
use crate::grbl::{self, GrblSettings};
use crate::rig::RigEventBody;
use crate::text::OpenedCell;
use crate::wire::{DeviceAddress, HostClock, LinkThread, lock};
use palpate_model::Nanos;
use palpate_model::rig::{Ack, AxisStatus, RawBytes, RigCommand};
use std::sync::{Arc, Mutex};

/// An axis in progress and the track that it writes.
pub struct OpenedAxis {
    pub line: LinkThread,
    pub track: Arc<Mutex<AxisTrack>>,
    /// Bytes of the time before the thread had the link.
    pub raw: Vec<RawBytes>,
}

#[derive(Clone)]
pub struct SplitRigDevices {
    axis: (DeviceAddress, GrblSettings),
    cell: (DeviceAddress, Arc<dyn CellDevice>),
    track: Arc<Mutex<AxisTrack>>,
    /// The host's clock where ticks begin.
    start: Nanos,
    /// Offset of the axis' own pulses from the caller's.
    zero: i64,
    motions_shown: u64,
}

impl SplitRigDevices {
    /// A Grbl board and a load cell, each with its place.
    #[must_use]
    pub fn new(
        axis: (DeviceAddress, GrblSettings),
        cell: (DeviceAddress, Arc<dyn CellDevice>),
    ) -> Self {
        Self {
            axis,
            cell,
            track: Arc::new(Mutex::new(AxisTrack::at_rest(0))),
            start: Nanos::ZERO,
            zero: 0,
            motions_shown: 0,
        }
    }
}

impl RigDevice for SplitRigDevices {
    fn open(&mut self, clock: &HostClock) -> Result<OpenedDevices, OpenError> {
        let ((axis_place, settings), (cell_place, cell)) = (&self.axis, &self.cell);
        let device: Arc<str> = "cell".into();
        let axis_link = axis_place.open()?;
        let mut link = cell_place.open()?;
        let (mut description, axis) = grbl::open(axis_link, settings, clock)?;
        let OpenedCell { description: cell, dialogue, raw, closing_bytes } =
            cell.open(link.as_mut(), clock, &device)?;
        (self.track, self.start) = (axis.track, clock());
        (self.zero, self.motions_shown) = (0, 0);
        let line =
            CellLine::new(dialogue, (cell.rate, cell.delay), Arc::clone(&self.track), self.start);
        let cell_line = LinkThread::start(link, line, clock, device, closing_bytes)?;
        description.identity = format!("{}; {}", description.identity, cell.identity);
        description.tick_nanos = TICK.0;
        description.adc = Some(cell.adc);
        description.noise_expected = cell.noise_expected;
        description.cell_delay = cell.delay.seconds();
        let period = 1.0 / cell.rate;
        description.ticks_per_sample = (period * 1e9 / TICK.0 as f64).max(1.0);
        // The first sample of a motion is up to a period behind its beginning.
        description.pulse_lag.0 += 1.5 * period + cell.delay.seconds().0;
        Ok(OpenedDevices {
            description,
            newtons_per_volt: cell.newtons_per_volt,
            link: None,
            lines: vec![axis.line, cell_line],
            raw: [axis.raw, raw].concat(),
        })
    }

    /// Adds the position and state of the axis at the time of the sample.
    fn complete(&mut self, now: Nanos, body: RigEventBody) -> RigEventBody {
        let track = lock(&self.track);
        match body {
            RigEventBody::Reading(mut reading) => {
                let placed = track.at(self.start + Nanos(reading.tick * TICK.0));
                reading.pulses = placed.pulses.round() as i64 - self.zero;
                reading.status = placed.status;
                // A motion that began and ended between two samples is shown by the second.
                if placed.motion > std::mem::replace(&mut self.motions_shown, placed.motion) {
                    reading.status = reading.status | AxisStatus::MOVING;
                }
                RigEventBody::Reading(reading)
            }
            RigEventBody::Ack(Ack { command: RigCommand::DefinePosition { pulses } }) => {
                self.zero = track.at(now).pulses.round() as i64 - pulses;
                body
            }
            _ => body,
        }
    }
}
