//! Question and answer, one at a time, while a device is opened.

use super::error::DeviceError;
use super::lines::{Lines, Taken};
use crate::wire::{HostClock, Link, TappedLink};
use palpate_model::Nanos;
use std::collections::VecDeque;
use std::sync::Arc;

/// So much of what came is kept to tell who it is that answers.
const HEARD_MAX: usize = 512;

/// A link to a device that speaks in lines, with nothing else going on.
pub struct TextConsole<'a> {
    pub link: TappedLink<'a>,
    device: &'static str,
    lines: Lines,
    ready: VecDeque<(Nanos, String)>,
    pub heard: Vec<u8>,
}

impl<'a> TextConsole<'a> {
    /// On a link. `name` stands in the log, `device` in errors.
    pub fn new(
        link: &'a mut dyn Link,
        clock: &'a HostClock,
        name: &Arc<str>,
        device: &'static str,
    ) -> Self {
        Self {
            link: TappedLink::new(link, clock, name),
            device,
            lines: Lines::default(),
            ready: VecDeque::new(),
            heard: Vec::new(),
        }
    }

    /// The host's clock.
    pub fn now(&self) -> Nanos {
        self.link.now()
    }

    pub fn write(&mut self, text: &str) -> Result<(), DeviceError> {
        self.link.write(text.as_bytes()).map_err(|err| DeviceError::lost(self.device, &err))
    }

    /// The next whole line with its arrival; `None` when none comes within a time. Garbled ones are passed over.
    pub fn line(&mut self, within: Nanos) -> Result<Option<(Nanos, String)>, DeviceError> {
        let start = self.now();
        while self.ready.is_empty() && self.now().since(start) < within {
            self.read()?;
        }
        Ok(self.ready.pop_front())
    }

    /// The first line that means something to `read`, within a time; others are passed over.
    pub fn find<T>(
        &mut self,
        within: Nanos,
        mut read: impl FnMut(&str) -> Option<T>,
    ) -> Result<Option<T>, DeviceError> {
        let start = self.now();
        while let Some(left) = within.0.checked_sub(self.now().since(start).0) {
            let Some((_, line)) = self.line(Nanos(left))? else {
                break;
            };
            if let Some(found) = read(&line) {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Throws away what comes until nothing has come for `quiet`. A device that never falls silent is left after ten
    /// times as long.
    pub fn drain(&mut self, quiet: Nanos) -> Result<(), DeviceError> {
        let (start, mut newest) = (self.now(), self.now());
        while self.now().since(newest) < quiet && self.now().since(start) < Nanos(10 * quiet.0) {
            if self.read()? > 0 {
                newest = self.now();
            }
        }
        self.ready.clear();
        self.lines.clear();
        Ok(())
    }

    fn read(&mut self) -> Result<usize, DeviceError> {
        let bytes = self.link.read().map_err(|err| DeviceError::lost(self.device, &err))?;
        let at = self.now();
        self.heard.extend_from_slice(&bytes);
        self.heard.drain(..self.heard.len().saturating_sub(HEARD_MAX));
        for byte in &bytes {
            if let Some(Taken::Line(line)) = self.lines.take(*byte) {
                self.ready.push_back((at, line));
            }
        }
        Ok(bytes.len())
    }
}
