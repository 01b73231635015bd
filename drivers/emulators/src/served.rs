//! An emulated device that is served in a thread of its own, for programs that use it while they run.

use super::EmulatedDevice;
use super::serve::{EmulatorAddress, ServeError, ServeEvent, ServeOptions, serve};
use palpate_drivers::priority::request_real_time;
use palpate_model::Nanos;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;

/// A device being served; dropping it ends that.
#[derive(Debug)]
pub struct ServedDevice {
    /// Where clients connect: a path or `HOST:PORT`.
    pub address: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ServedDevice {
    /// A free TCP port of this computer.
    #[must_use]
    pub fn free_port() -> EmulatorAddress {
        EmulatorAddress::Tcp(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)))
    }

    /// Serves `device` with an undelayed line until it is dropped, with real-time priority where that is granted: without it, the
    /// computer's other work would be the device's delay.
    pub fn start(
        mut device: impl EmulatedDevice + 'static,
        address: EmulatorAddress,
    ) -> Result<Self, ServeError> {
        let stop = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&stop);
        let (ready, started) = sync_channel(2);
        let work = move || {
            let options = ServeOptions {
                address,
                baud: None,
                latency: Nanos::ZERO,
                faults: Vec::new(),
                seed: 1,
            };
            let _ = request_real_time();
            let (_orders, received) = sync_channel(1);
            let mut notify = |event| {
                if let ServeEvent::Ready(address) = event {
                    let _ = ready.send(Ok(address));
                }
            };
            if let Err(err) = serve(&mut device, &options, &received, &is_over, &mut notify) {
                let _ = ready.try_send(Err(err));
            }
        };
        let thread = std::thread::Builder::new()
            .name("emulator".into())
            .spawn(work)
            .map_err(|err| ServeError::Watch(err.to_string()))?;
        let address = started
            .recv()
            .unwrap_or_else(|_| Err(ServeError::Watch("its thread ends at the start".into())))?;
        Ok(Self { address, stop, thread: Some(thread) })
    }
}

impl Drop for ServedDevice {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
