//! A load cell that sends lines without being queried, at the rate and in the form that its driver declares.

use super::DeviceFault;
use super::cell::{CellLoad, EmulatedCell};
use super::wire::Outbox;
use palpate_drivers::devices::LineEmulation;
use palpate_model::Nanos;

/// From power-up to the first line: about as long as the boot loader of an Arduino Uno waits.
const BOOT: Nanos = Nanos::from_millis(1_600);

pub struct EmulatedLineCell {
    emulation: LineEmulation,
    /// When it was switched on; its lines count time from there.
    since: Nanos,
    next: Nanos,
    is_other: bool,
    output: Outbox,
}

impl EmulatedLineCell {
    pub fn new(emulation: LineEmulation) -> Self {
        Self {
            emulation,
            since: Nanos::ZERO,
            next: Nanos::ZERO,
            is_other: false,
            output: Outbox::default(),
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
            self.output.push(line.as_bytes());
            self.next = self.next + Nanos((1e9 / self.emulation.rate).round() as u64);
        }
    }

    fn transmit(&mut self) -> Vec<u8> {
        self.output.take()
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        match fault {
            DeviceFault::Reset if is_on => {
                (self.since, self.next) = (now, now + BOOT);
                self.output.clear();
            }
            DeviceFault::WrongDevice => self.is_other = is_on,
            // The load that the bench passes in is stuck or saturated already.
            DeviceFault::Reset | DeviceFault::Stuck | DeviceFault::Saturated => {}
        }
    }
}
