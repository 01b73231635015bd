//! A link with nothing else going on, while a device is set up: every byte that goes over it is noted.

use super::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use std::io;
use std::sync::Arc;
use std::time::Duration;

const READ_MAX: Duration = Duration::from_millis(5);

pub struct TappedLink<'a> {
    link: &'a mut dyn Link,
    clock: &'a HostClock,
    device: Arc<str>,
    pub raw: Vec<RawBytes>,
}

impl<'a> TappedLink<'a> {
    /// Notes what goes over a link; `device` is what the log calls who is behind it.
    pub fn new(link: &'a mut dyn Link, clock: &'a HostClock, device: &Arc<str>) -> Self {
        Self { link, clock, device: Arc::clone(device), raw: Vec::new() }
    }

    /// The host's clock.
    pub fn now(&self) -> Nanos {
        (self.clock)()
    }

    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.link.write(bytes)?;
        self.tap(true, bytes);
        Ok(())
    }

    /// What has come, or comes within some milliseconds.
    pub fn read(&mut self) -> io::Result<Vec<u8>> {
        let mut buffer = [0_u8; 1024];
        let count = self.link.read(&mut buffer, READ_MAX)?;
        self.tap(false, &buffer[..count]);
        Ok(buffer[..count].to_vec())
    }

    fn tap(&mut self, is_sent: bool, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.raw.push(RawBytes {
                at: self.now(),
                device: Arc::clone(&self.device),
                is_sent,
                bytes: bytes.to_vec(),
            });
        }
    }
}
