//! The emulated sidecar on its link: bytes in, bytes out, faults.

use super::{CATCH_UP, EmulatedSidecar};
use crate::plant::CellFault;
use crate::{DeviceFault, EmulatedDevice};
use palpate_model::Nanos;
use palpate_model::rig::HandAction;

impl EmulatedDevice for EmulatedSidecar {
    fn disconnect(&mut self, now: Nanos, _channel: usize) {
        self.advance(now);
        self.brake(now);
        self.is_sending = false;
    }

    fn receive(&mut self, now: Nanos, _channel: usize, bytes: &[u8]) {
        self.advance(now);
        for byte in bytes {
            self.take_byte(*byte);
        }
    }

    fn advance(&mut self, now: Nanos) {
        let period = Nanos((1e9 / self.settings.rate) as u64);
        // After a long gap only its last two seconds are simulated.
        if now.since(self.next_sample) > CATCH_UP {
            self.next_sample = Nanos(now.0 - CATCH_UP.0);
        }
        loop {
            let due = self.waiting.iter().map(|(at, _)| *at).min();
            match due.filter(|at| *at <= now && *at <= self.next_sample) {
                Some(at) => {
                    self.advance_to(at);
                    let index = self.waiting.iter().position(|(other, _)| *other == at);
                    if let Some(index) = index {
                        let (_, line) = self.waiting.remove(index);
                        self.on_line(&line);
                    }
                }
                None if self.next_sample <= now => {
                    self.advance_to(self.next_sample);
                    self.next_sample = self.next_sample + period;
                    self.sample();
                }
                None => break,
            }
        }
        self.advance_to(now);
    }

    fn transmit(&mut self, _channel: usize) -> Vec<u8> {
        self.output.take()
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        self.advance(now);
        match fault {
            DeviceFault::Stuck => self.plant.set_cell_fault(is_on.then_some(CellFault::Stuck)),
            DeviceFault::Saturated => {
                self.plant.set_cell_fault(is_on.then_some(CellFault::Saturated));
            }
            DeviceFault::Reset if is_on => self.restart(),
            DeviceFault::Reset => {}
            DeviceFault::WrongDevice => {
                self.settings.name = if is_on { "another" } else { "emulated" }.into();
                self.restart();
            }
        }
    }

    fn apply_hand_action(&mut self, now: Nanos, action: HandAction) {
        self.advance(now);
        self.plant.apply_hand_action(action);
    }
}
