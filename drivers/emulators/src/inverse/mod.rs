//! Haply's Inverse service 3.5 with an Inverse3: WebSocket and HTTP on one port, an arm with a hand on it, and faults.
//!
//! Messages are as in Haply's public pages (docs.haply.co, Inverse SDK 3.5) and in its crate `haply` 1.3.1. What they do not
//! say is assumed here, and written where it is assumed: how long a command lasts, what a session's end does, and the mechanics
//! of the arm. No real service or device was compared.

mod arm;
mod channel;
mod fault;
mod panel;
mod report;
mod service;

pub use arm::{ArmSettings, EmulatedArm};
pub use fault::{InverseFault, InverseLie};
pub use panel::InversePanel;
pub use service::{InverseService, InverseServiceSettings};

use crate::EmulatedDevice;
use crate::faults::DeviceFault;
use channel::Channel;
use palpate_drivers::sim::{Random, RandomStream};
use palpate_haptics::SettingError;
use palpate_model::Nanos;
use palpate_model::rig::HandAction;

/// Clients at once: palpate's WebSocket, its HTTP, and some others.
const CHANNELS: usize = 8;

/// The service behind its port.
pub struct EmulatedInverse {
    service: InverseService,
    channels: Vec<Channel>,
    panel: InversePanel,
    random: Random,
    now: Nanos,
}

impl EmulatedInverse {
    /// The service and a panel to operate it from another thread.
    pub fn new(settings: InverseServiceSettings) -> Result<(Self, InversePanel), SettingError> {
        let panel = InversePanel::default();
        let emulated = Self {
            random: Random::new(settings.seed, RandomStream::Link),
            service: InverseService::new(settings)?,
            channels: (0..CHANNELS).map(|_| Channel::default()).collect(),
            panel: panel.clone(),
            now: Nanos::ZERO,
        };
        Ok((emulated, panel))
    }

    /// Takes what the panel asks for, and shows it what is.
    fn look_at_panel(&mut self) {
        let (fault, is_held) = self.panel.wishes();
        if self.service.fault() != fault {
            self.service.set_fault(self.now, fault);
            if fault == Some(InverseFault::Cut) {
                for channel in 0..self.channels.len() {
                    self.channels[channel].hang_up();
                    self.service.close(self.now, channel);
                }
            }
        }
        self.service.set_held(is_held);
        self.panel.show(&self.service);
    }
}

impl EmulatedDevice for EmulatedInverse {
    fn channels(&self) -> usize {
        self.channels.len()
    }

    fn connect(&mut self, now: Nanos, channel: usize) {
        self.now = now;
        self.channels[channel] = Channel::default();
        if self.service.fault() == Some(InverseFault::Cut) {
            self.channels[channel].hang_up();
        }
    }

    fn disconnect(&mut self, now: Nanos, channel: usize) {
        self.now = now;
        self.channels[channel] = Channel::default();
        self.service.close(now, channel);
        self.panel.show(&self.service);
    }

    fn receive(&mut self, now: Nanos, channel: usize, bytes: &[u8]) {
        self.now = now;
        self.service.advance(now);
        let settings = self.service.settings();
        let delay = settings.reply_delay.0 as f64 + self.random.unit() * settings.jitter.0 as f64;
        let due = now + Nanos(delay as u64);
        self.channels[channel].receive((now, due), bytes, channel, &mut self.service);
        self.look_at_panel();
    }

    fn advance(&mut self, now: Nanos) {
        self.now = now;
        self.service.advance(now);
        self.look_at_panel();
    }

    fn transmit(&mut self, channel: usize) -> Vec<u8> {
        self.channels[channel].transmit(self.now)
    }

    fn take_hang_up(&mut self, channel: usize) -> bool {
        self.channels[channel].take_hang_up()
    }

    fn apply_fault(&mut self, _now: Nanos, fault: DeviceFault, is_on: bool) {
        // A wrong device is one that is not calibrated; the others are of load cells.
        if fault == DeviceFault::WrongDevice {
            self.panel.set_fault(is_on.then_some(InverseFault::Uncalibrated));
        }
    }

    fn apply_hand_action(&mut self, _now: Nanos, _action: HandAction) {}
}
