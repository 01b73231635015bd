//! An axis and a load cell as one rig.

use super::cell_line::{CellLine, TICK};
use super::track::Track;
use crate::rig::{Rig, RigError, RigEvent, RigEventBody};
use crate::text::OpenedCell;
use crate::wire::{CallerTime, HaltHandle, HostClock, Line, LineSettings, Link, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{Ack, AxisStatus, Fault, RawBytes, RigCommand, RigDescription};
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Two lines are listened to in turns of this length.
const TURN: Nanos = Nanos::from_millis(1);

/// An axis in progress, and what it writes its deeds into.
pub struct Axis {
    /// Its thread.
    pub line: Line,
    /// Where it was when.
    pub track: Arc<Mutex<Track>>,
    /// Bytes of the time before the thread had the link.
    pub raw: Vec<RawBytes>,
}

/// Opens the same devices once more.
pub type Again = Box<dyn Fn() -> Result<PartsRig, RigError> + Send>;

/// An axis and a load cell.
pub struct PartsRig {
    /// How it is opened once more; `None` where it cannot be.
    again: Option<Again>,
    description: RigDescription,
    newtons_per_volt: Option<f64>,
    /// Both are `None` while they are being connected anew, and after that has failed.
    axis: Option<Line>,
    cell: Option<Line>,
    track: Arc<Mutex<Track>>,
    clock: HostClock,
    /// The host's clock where ticks begin.
    start: Nanos,
    time: CallerTime,
    refused: VecDeque<Fault>,
    first_raw: Vec<RawBytes>,
    /// Taken from a line, not told yet.
    from_axis: Option<RigEvent>,
    from_cell: Option<RigEvent>,
    /// What the axis' own pulses are more than the caller's.
    zero: i64,
    /// Motions of which a sample was told.
    motions_shown: u64,
}

impl PartsRig {
    /// Starts to listen to a cell beside an axis that was opened. `description` is the rig's as the axis knows it;
    /// what the cell knows is filled in.
    pub fn new(
        mut description: RigDescription,
        axis: Axis,
        link: Box<dyn Link>,
        opened: OpenedCell,
        clock: HostClock,
    ) -> io::Result<Self> {
        let OpenedCell {
            description: cell,
            dialogue,
            raw,
            farewell,
        } = opened;
        let start = clock();
        let line = CellLine::new(
            dialogue,
            (cell.rate, cell.delay),
            Arc::clone(&axis.track),
            start,
        );
        let settings = LineSettings {
            device: "cell".into(),
            farewell,
        };
        let cell_line = Line::start(link, line, Arc::clone(&clock), settings)?;
        description.identity = format!("{}; {}", description.identity, cell.identity);
        description.tick_nanos = TICK.0;
        description.adc = Some(cell.adc);
        description.noise_expected = cell.noise_expected;
        description.cell_delay = cell.delay.seconds();
        let period = 1.0 / cell.rate;
        description.ticks_per_sample = (period * 1e9 / TICK.0 as f64).max(1.0);
        // The first sample of a motion is up to a period behind its beginning.
        description.pulse_lag.0 += 1.5 * period + cell.delay.seconds().0;
        Ok(Self {
            again: None,
            description,
            newtons_per_volt: cell.newtons_per_volt,
            axis: Some(axis.line),
            cell: Some(cell_line),
            track: axis.track,
            time: CallerTime::new(Arc::clone(&clock)),
            clock,
            start,
            refused: VecDeque::new(),
            first_raw: [axis.raw, raw].concat(),
            from_axis: None,
            from_cell: None,
            zero: 0,
            motions_shown: 0,
        })
    }

    /// Lets it be opened once more.
    #[must_use]
    pub fn with_again(self, again: Again) -> Self {
        Self {
            again: Some(again),
            ..self
        }
    }

    /// The older of what has come from axis and cell, within `wait`; the axis first.
    fn next(&mut self, until: Nanos, end: Nanos) -> Option<RigEvent> {
        let (Some(axis_line), Some(cell_line)) = (&self.axis, &self.cell) else {
            std::thread::sleep(Duration::from_nanos(end.since((self.clock)()).0));
            return None;
        };
        loop {
            if self.from_axis.is_none() {
                self.from_axis = axis_line.next_event(until, Duration::ZERO);
            }
            let left = if self.from_axis.is_some() {
                Nanos::ZERO
            } else {
                end.since((self.clock)())
            };
            if self.from_cell.is_none() {
                let wait = Duration::from_nanos(left.min(TURN).0);
                self.from_cell = cell_line.next_event(until, wait);
            }
            let is_axis_first = match (&self.from_axis, &self.from_cell) {
                (Some(axis), Some(cell)) => axis.at <= cell.at,
                (Some(_), None) => true,
                (None, Some(_)) => false,
                (None, None) if left == Nanos::ZERO => return None,
                (None, None) => continue,
            };
            return if is_axis_first {
                self.from_axis.take()
            } else {
                self.from_cell.take()
            };
        }
    }

    /// Fills in what only both parts together know.
    fn complete(&mut self, body: RigEventBody) -> RigEventBody {
        match body {
            RigEventBody::Reading(mut reading) => {
                let taken = self.start + Nanos(reading.tick * TICK.0);
                let placed = {
                    let track = self.track.lock().unwrap_or_else(PoisonError::into_inner);
                    track.at(taken)
                };
                reading.pulses = placed.pulses.round() as i64 - self.zero;
                reading.status = placed.status;
                // A motion that began and ended between two samples is shown by the second.
                if placed.motion > std::mem::replace(&mut self.motions_shown, placed.motion) {
                    reading.status = reading.status | AxisStatus::MOVING;
                }
                RigEventBody::Reading(reading)
            }
            RigEventBody::Ack(Ack {
                command: RigCommand::DefinePosition { pulses },
            }) => {
                let track = self.track.lock().unwrap_or_else(PoisonError::into_inner);
                self.zero = track.at((self.clock)()).pulses.round() as i64 - pulses;
                body
            }
            _ => body,
        }
    }

    /// What was exchanged since this was last asked, at the host's time.
    fn take_raw_of_host(&mut self) -> Vec<RawBytes> {
        let mut raw = std::mem::take(&mut self.first_raw);
        let lines = [&self.axis, &self.cell];
        raw.extend(lines.into_iter().flatten().flat_map(Line::take_raw));
        raw.sort_by_key(|piece| piece.at);
        raw
    }
}

impl Rig for PartsRig {
    fn description(&self) -> &RigDescription {
        &self.description
    }

    fn send(&mut self, command: RigCommand) {
        let sent = self.axis.as_mut().map(|axis| axis.send(command));
        let detail = match sent {
            Some(Ok(())) => return,
            Some(Err(_)) => "too many commands at once",
            None => "the rig is not connected",
        };
        self.refused.push_back(Fault::CommandRefused {
            detail: detail.into(),
        });
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let (now, end) = self.time.asked(until);
        if let Some(fault) = self.refused.pop_front() {
            let at = self.time.told(now, until);
            return Some(RigEvent::new(at, RigEventBody::Fault(fault)));
        }
        let event = self.next(end, end)?;
        let at = self.time.told(event.at, until);
        let body = self.complete(event.body);
        Some(RigEvent::new(at, body))
    }

    fn reconnect(&mut self) -> Result<(), RigError> {
        let again = self.again.take().ok_or(RigError::NotAgain)?;
        // The old links say farewell and are closed, or their ports would be busy with them.
        let mut raw = self.take_raw_of_host();
        (self.axis, self.cell) = (None, None);
        (self.from_axis, self.from_cell) = (None, None);
        self.refused.clear();
        let opened = again();
        match opened {
            Ok(mut opened) => {
                raw.append(&mut opened.first_raw);
                // Whoever asks goes on with its own time.
                let time =
                    std::mem::replace(&mut self.time, CallerTime::new(Arc::clone(&self.clock)));
                *self = Self {
                    first_raw: raw,
                    time,
                    again: Some(again),
                    ..opened
                };
                Ok(())
            }
            Err(err) => {
                self.first_raw = raw;
                self.again = Some(again);
                Err(err)
            }
        }
    }

    fn is_virtual(&self) -> bool {
        false
    }

    fn newtons_per_volt(&self) -> Option<f64> {
        self.newtons_per_volt
    }

    fn halt_handle(&self) -> Option<HaltHandle> {
        self.axis.as_ref()?.halt_handle()
    }

    fn links(&self) -> Vec<(String, LinkStats)> {
        let lines = [("grbl", &self.axis), ("cell", &self.cell)];
        let open = lines
            .into_iter()
            .filter_map(|(name, line)| Some((name, line.as_ref()?)));
        open.map(|(name, line)| (name.to_owned(), line.stats()))
            .collect()
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        let mut raw = self.take_raw_of_host();
        for piece in &mut raw {
            piece.at = self.time.of(piece.at);
        }
        raw
    }
}
