//! Emulated devices on ports of this computer, each in a thread of its own.
#![expect(clippy::disallowed_methods, reason = "the clock of a test stands for the runner's")]

use palpate_drivers::wire::{DeviceAddress, HostClock};
use palpate_emulators::ServedDevice;
use palpate_emulators::hapi::{EmulatedHapi, HapiBoardSettings, HapiPanel};
use palpate_emulators::inverse::{EmulatedInverse, InversePanel, InverseServiceSettings};
use palpate_haptic_devices::{
    DeviceMonitor, HapiOptions, InverseOptions, LinkReport, LinkedDevice,
};
use palpate_haptics::scene::Pose;
use palpate_haptics::{HapticDevice, Period};
use palpate_model::Nanos;
use palpate_test_support::wait::until;
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

/// The force in N that [`tick_until`] gives.
const GIVEN: [f64; 3] = [0.0, 0.0, 0.5];

pub fn is_given(force: [f64; 3]) -> bool {
    force.iter().eq(&GIVEN)
}

/// Ticks until the connection is as wanted.
pub fn tick_until(
    device: &mut LinkedDevice,
    monitor: &DeviceMonitor,
    is_so: impl Fn(&LinkReport) -> bool,
) -> LinkReport {
    let mut tick = || {
        device.sense(1);
        device.give(GIVEN);
        let report = monitor.report();
        is_so(&report).then_some(report)
    };
    until(&mut tick, || format!("{:?}", monitor.report()))
}

/// A pose that is one. On a busy computer an answer may be late for some ticks.
pub fn finite_pose(device: &mut LinkedDevice) -> Pose {
    let mut sense = || Some(device.sense(1)).filter(|pose| pose.at[0].is_finite());
    until(&mut sense, || "no pose".into())
}

pub fn no_pose(device: &mut LinkedDevice) {
    until(|| device.sense(1).at[0].is_nan().then_some(()), || "a pose".into());
}

pub fn assert_ticks_allocate_nothing(device: &mut LinkedDevice) {
    let counted = allocation_counter::measure(|| {
        for _ in 0..1000 {
            std::hint::black_box(device.sense(1));
            device.give([0.1, 0.2, 0.3]);
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
}
