//! An emulated service on a TCP port of this computer, in a thread of its own.
#![expect(clippy::disallowed_methods, reason = "the clock of a test stands for the runner's")]

use palpate_drivers::wire::HostClock;
use palpate_emulators::inverse::{EmulatedInverse, InversePanel, InverseServiceSettings};
use palpate_emulators::serve::{EmulatorAddress, ServeEvent, ServeOptions, serve};
use palpate_haptic_devices::InverseOptions;
use palpate_haptics::Period;
use palpate_model::Nanos;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;
use std::time::Instant;

/// A service in use; dropping it ends it.
pub struct ServedInverse {
    pub address: SocketAddr,
    pub panel: InversePanel,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ServedInverse {
    pub fn start(settings: InverseServiceSettings) -> Self {
        let (mut device, panel) = EmulatedInverse::new(settings).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&stop);
        let (ready, address) = sync_channel(1);
        let (_orders, received) = sync_channel(1);
        let work = move || {
            let options = ServeOptions {
                address: EmulatorAddress::Tcp(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))),
                baud: None,
                latency: Nanos::ZERO,
                faults: Vec::new(),
                seed: 1,
            };
            let mut notify = |event| {
                if let ServeEvent::Ready(address) = event {
                    ready.send(address).unwrap();
                }
            };
            serve(&mut device, &options, &received, &is_over, &mut notify).unwrap();
        };
        let thread = std::thread::Builder::new().name("inverse".into()).spawn(work).unwrap();
        let address = address.recv().unwrap().parse().unwrap();
        Self { address, panel, stop, thread: Some(thread) }
    }

    pub fn options(&self) -> InverseOptions {
        let options = InverseOptions::new([30.0, 30.0, 0.0], Period::MILLISECOND);
        InverseOptions { address: self.address, ..options }
    }
}

impl Drop for ServedInverse {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
    }
}

pub fn clock() -> HostClock {
    let start = Instant::now();
    Arc::new(move || Nanos(start.elapsed().as_nanos() as u64))
}
