//! A link while a device is set up: one question at a time, and every byte is recorded for the log.

use super::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// Longest single wait for bytes.
const READ_MAX: Duration = Duration::from_millis(5);

/// A link whose bytes the parser `P` turns into items `T`.
pub struct SetupConsole<'a, P, T> {
    link: &'a mut dyn Link,
    clock: &'a HostClock,
    device: Arc<str>,
    parser: P,
    parse: fn(&mut P, u8) -> Option<T>,
    /// Items with their arrival, not taken yet.
    waiting: VecDeque<(Nanos, T)>,
    received: usize,
    received_max: usize,
    /// All bytes in both directions.
    pub raw: Vec<RawBytes>,
}

impl<'a, P: Default, T> SetupConsole<'a, P, T> {
    /// `device` is its name in the log.
    pub fn open(
        link: &'a mut dyn Link,
        clock: &'a HostClock,
        device: &Arc<str>,
        parse: fn(&mut P, u8) -> Option<T>,
    ) -> Self {
        Self {
            link,
            clock,
            device: Arc::clone(device),
            parser: P::default(),
            parse,
            waiting: VecDeque::new(),
            received: 0,
            received_max: usize::MAX,
            raw: Vec::new(),
        }
    }

    /// Goes on with another parser.
    pub fn set_parser(&mut self, parser: P) {
        self.parser = parser;
    }

    pub fn now(&self) -> Nanos {
        (self.clock)()
    }

    pub fn write(&mut self, bytes: impl AsRef<[u8]>) -> io::Result<()> {
        self.link.write(bytes.as_ref())?;
        self.record(true, bytes.as_ref());
        Ok(())
    }

    /// The next item with its arrival, if one comes until then, and within the allowed bytes.
    pub fn next(&mut self, until: Nanos) -> io::Result<Option<(Nanos, T)>> {
        while self.waiting.is_empty() && self.now() < until && !self.is_flooded() {
            self.read_chunk()?;
        }
        Ok(self.waiting.pop_front())
    }

    /// All items that wait and those of one more read, which waits for some milliseconds.
    pub fn take_chunk(&mut self) -> io::Result<impl Iterator<Item = T>> {
        self.read_chunk()?;
        Ok(self.waiting.drain(..).map(|(_, item)| item))
    }

    /// Throws away what comes until nothing has come for `quiet`, or for ten times as long if the device never falls
    /// silent, and returns it.
    pub fn drain(&mut self, quiet: Nanos) -> io::Result<Vec<u8>> {
        let (start, mut newest, mut all) = (self.now(), self.now(), Vec::new());
        while self.now().since(newest) < quiet && self.now().since(start) < Nanos(10 * quiet.0) {
            let bytes = self.read_chunk()?;
            if !bytes.is_empty() {
                newest = self.now();
                all.extend(bytes);
            }
        }
        self.waiting.clear();
        self.parser = P::default();
        Ok(all)
    }

    /// Waits for nothing more once so many further bytes have come.
    pub fn allow(&mut self, count: usize) {
        self.received_max = self.received.saturating_add(count);
    }

    /// Whether more has come than was allowed.
    pub fn is_flooded(&self) -> bool {
        self.received > self.received_max
    }

    /// Count of all bytes of the device.
    pub fn received(&self) -> usize {
        self.received
    }

    /// The newest bytes of the device, at most `count`.
    pub fn last_received(&self, count: usize) -> Vec<u8> {
        let received = self.raw.iter().filter(|piece| !piece.is_sent);
        let all: Vec<u8> = received.flat_map(|piece| &piece.bytes).copied().collect();
        all[all.len().saturating_sub(count)..].to_vec()
    }

    fn read_chunk(&mut self) -> io::Result<Vec<u8>> {
        let mut buffer = [0_u8; 1024];
        let count = self.link.read(&mut buffer, READ_MAX)?;
        let bytes = &buffer[..count];
        self.received += count;
        self.record(false, bytes);
        let at = self.now();
        for byte in bytes {
            let item = (self.parse)(&mut self.parser, *byte);
            self.waiting.extend(item.map(|item| (at, item)));
        }
        Ok(bytes.to_vec())
    }

    fn record(&mut self, is_sent: bool, bytes: &[u8]) {
        if !bytes.is_empty() {
            let (at, device) = (self.now(), Arc::clone(&self.device));
            self.raw.push(RawBytes { at, device, is_sent, bytes: bytes.to_vec() });
        }
    }
}
