//! A load cell that sends lines whoever listens: its rate and its lines are those that its driver gives for it.

use super::DeviceFault;
use super::cell::{CellLoad, EmulatedCell};
use palpate_drivers::devices::LineEmulation;
use palpate_model::Nanos;

/// From its switching on to its first line: the boot loader of an Arduino Uno waits about so long.
const BOOT: Nanos = Nanos::from_millis(1_600);
/// Bytes that wait to be taken; more are lost, as on a line that nobody reads.
const OUTPUT_MAX: usize = 4096;

/// The cell.
pub struct EmulatedLineCell {
    emulation: LineEmulation,
    /// When it was switched on.
    since: Nanos,
    next: Nanos,
    is_other: bool,
    output: Vec<u8>,
}

impl EmulatedLineCell {
    /// A cell that has been on for a while.
    #[must_use]
    pub const fn new(emulation: LineEmulation) -> Self {
        Self {
            emulation,
            since: Nanos::ZERO,
            next: Nanos::ZERO,
            is_other: false,
            output: Vec::new(),
        }
    }
}

impl EmulatedCell for EmulatedLineCell {
    fn receive(&mut self, _now: Nanos, _bytes: &[u8]) {}

    fn advance(&mut self, now: Nanos, load: CellLoad) {
        while self.next <= now {
            let line = if self.is_other {
                "21.5 C, 48 %\r\n".to_owned()
            } else {
                (self.emulation.line)(self.next.since(self.since), load.volts)
            };
            if self.output.len() + line.len() <= OUTPUT_MAX {
                self.output.extend_from_slice(line.as_bytes());
            }
            self.next = self.next + Nanos((1e9 / self.emulation.rate).round() as u64);
        }
    }

    fn transmit(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        match fault {
            DeviceFault::Reset if is_on => {
                (self.since, self.next) = (now, now + BOOT);
                self.output.clear();
            }
            DeviceFault::WrongDevice => self.is_other = is_on,
            // The signal that it is given is stuck or saturated already.
            DeviceFault::Reset | DeviceFault::Stuck | DeviceFault::Saturated => {}
        }
    }
}
