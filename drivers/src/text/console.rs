//! Question and answer, one at a time, while a device that speaks in lines is set up.

use super::error::{DeviceError, describe_unknown_device};
use super::lines::{Lines, ReceivedLine};
use crate::wire::{HostClock, Link, SetupConsole};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use std::io;
use std::sync::Arc;

/// Count of the newest bytes that identify an unexpected device.
const RECEIVED_MAX: usize = 512;

/// A link to a device that speaks in lines, with nothing else going on.
pub struct TextConsole<'a> {
    console: SetupConsole<'a, Lines, ReceivedLine>,
    /// Its name in errors.
    device: &'static str,
}

impl<'a> TextConsole<'a> {
    /// `name` stands in the log, `device` in errors.
    pub fn new(
        link: &'a mut dyn Link,
        clock: &'a HostClock,
        name: &Arc<str>,
        device: &'static str,
    ) -> Self {
        Self { console: SetupConsole::open(link, clock, name, Lines::take), device }
    }

    pub fn now(&self) -> Nanos {
        self.console.now()
    }

    pub fn write(&mut self, text: &str) -> Result<(), DeviceError> {
        let result = self.console.write(text);
        result.map_err(|err| self.link_error(&err))
    }

    /// The next whole line with its arrival; `None` when none comes within a time. Garbled ones are passed over.
    pub fn line(&mut self, within: Nanos) -> Result<Option<(Nanos, String)>, DeviceError> {
        let until = self.now() + within;
        loop {
            match self.console.next(until).map_err(|err| self.link_error(&err))? {
                Some((at, ReceivedLine::Line(line))) => return Ok(Some((at, line))),
                Some((_, ReceivedLine::Garbled)) => {}
                None => return Ok(None),
            }
        }
    }

    /// The first line that means something to `read`, within a time; others are passed over.
    pub fn find<T>(
        &mut self,
        within: Nanos,
        mut read: impl FnMut(&str) -> Option<T>,
    ) -> Result<Option<T>, DeviceError> {
        let start = self.now();
        while let Some(rest) = within.0.checked_sub(self.now().since(start).0)
            && let Some((_, line)) = self.line(Nanos(rest))?
        {
            if let Some(found) = read(&line) {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Throws away what comes until nothing has come for `quiet`, or for ten times as long.
    pub fn drain(&mut self, quiet: Nanos) -> Result<(), DeviceError> {
        let result = self.console.drain(quiet).map(|_| ());
        result.map_err(|err| self.link_error(&err))
    }

    /// The newest text that the device has sent.
    pub fn received(&self) -> String {
        String::from_utf8_lossy(&self.console.last_received(RECEIVED_MAX)).into_owned()
    }

    /// The error of a device that does not answer as expected: it is silent, which the hint is for, or another one.
    pub fn no_answer(&self, hint: &'static str) -> DeviceError {
        let (device, received) = (self.device, self.received());
        if received.is_empty() {
            DeviceError::Silent { device, hint }
        } else {
            DeviceError::Other { device, found: describe_unknown_device(&received) }
        }
    }

    /// Bytes exchanged, by the host's clock.
    pub fn into_raw(self) -> Vec<RawBytes> {
        self.console.raw
    }

    fn link_error(&self, err: &io::Error) -> DeviceError {
        DeviceError::Lost { device: self.device, detail: err.to_string() }
    }
}
