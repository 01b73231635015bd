//! Emulated devices on ports of this computer, each in a thread of its own.
#![expect(clippy::disallowed_methods, reason = "the clock of a test stands for the runner's")]

use palpate_drivers::wire::{DeviceAddress, HostClock};
use palpate_emulators::ServedDevice;
use palpate_emulators::hapi::{EmulatedHapi, HapiBoardSettings, HapiPanel};
use palpate_emulators::inverse::{EmulatedInverse, InversePanel, InverseServiceSettings};
use palpate_haptic_devices::{HapiOptions, InverseOptions};
use palpate_haptics::Period;
use palpate_model::Nanos;
use std::sync::Arc;
use std::time::Instant;

/// The middle of the tissue in the scenes here.
pub const MIDDLE: [f64; 3] = [30.0, 30.0, 0.0];

/// An Inverse service in use; dropping it ends it.
pub struct ServedInverse {
    pub panel: InversePanel,
    served: ServedDevice,
}

impl ServedInverse {
    pub fn start(settings: InverseServiceSettings) -> Self {
        let (device, panel) = EmulatedInverse::new(settings).unwrap();
        let served = ServedDevice::start(device, ServedDevice::free_port()).unwrap();
        Self { panel, served }
    }

    pub fn options(&self) -> InverseOptions {
        let address = self.served.address.parse().unwrap();
        InverseOptions { address, ..InverseOptions::new(MIDDLE, Period::MILLISECOND) }
    }
}

/// A hAPI board in use; dropping it ends it.
pub struct ServedHapi {
    pub panel: HapiPanel,
    served: ServedDevice,
}

impl ServedHapi {
    /// On a pseudo-terminal, or on a TCP port where a system has none.
    pub fn start(settings: HapiBoardSettings) -> Self {
        let (device, panel) = EmulatedHapi::new(settings).unwrap();
        let place = match cfg!(unix) {
            true => palpate_emulators::serve::EmulatorAddress::Pty(None),
            false => ServedDevice::free_port(),
        };
        Self { panel, served: ServedDevice::start(device, place).unwrap() }
    }

    pub fn address(&self) -> DeviceAddress {
        let place = self.served.address.clone();
        match cfg!(unix) {
            true => DeviceAddress::Serial { port: place, baud: 115_200, has_handshake: false },
            false => DeviceAddress::Tcp(place),
        }
    }

    pub fn options(&self) -> HapiOptions {
        HapiOptions::new(self.address(), MIDDLE, Period::MILLISECOND)
    }
}

pub fn clock() -> HostClock {
    let start = Instant::now();
    Arc::new(move || Nanos(start.elapsed().as_nanos() as u64))
}
