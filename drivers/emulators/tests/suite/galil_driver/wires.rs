//! The rig over a TCP connection and over a pseudo-terminal, in real time. Waits are generous: nothing here is about
//! speed.
#![expect(clippy::disallowed_methods, reason = "the clock of a test stands for the runner's")]

use super::bench::{thesis, to};
use palpate_drivers::device::OpenError;
use palpate_drivers::galil::{GalilDevice, GalilOpenError, GalilRig, GalilSettings};
use palpate_drivers::wire::{DeviceAddress, HostClock, WireError};
use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_emulators::galil::{EmulatedGalilSettings as Emulated, GalilEmulator};
use palpate_emulators::serve::{EmulatorAddress as At, ServeEvent, ServeOptions, serve};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, Reading, RigCommand};
use palpate_test_support::skip;
use palpate_test_support::wait::{PATIENCE, until};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Instant;

pub struct Served {
    pub address: String,
    pub orders: SyncSender<String>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

pub fn start(place: At, is_serial: bool, latency: Nanos, baud: Option<u32>) -> Served {
    let (orders, received) = sync_channel(16);
    let (sender, printed) = sync_channel(64);
    let stop = Arc::new(AtomicBool::new(false));
    let is_over = Arc::clone(&stop);
    let thread = std::thread::Builder::new()
        .name("emulator".into())
        .spawn(move || {
            let mut device = GalilEmulator::new(Emulated { is_serial, ..Emulated::default() });
            let options =
                ServeOptions { address: place, baud, latency, faults: Vec::new(), seed: 1 };
            // Only where it is matters here.
            let mut tell = |printed| drop(sender.try_send(printed));
            serve(&mut device, &options, &received, &is_over, &mut tell).expect("it is served");
        })
        .expect("a thread");
    let Ok(ServeEvent::Ready(address)) = printed.recv_timeout(PATIENCE) else {
        panic!("it did not start");
    };
    Served { address, orders, stop, thread: Some(thread) }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let result = thread.join();
            assert!(result.is_ok() || std::thread::panicking());
        }
    }
}

pub fn clock() -> HostClock {
    let start = Instant::now();
    Arc::new(move || Nanos(start.elapsed().as_nanos() as u64))
}

/// The rig at a place, asked for as often as it takes: a computer with much else to do may hear no answer in time.
pub fn opened(place: &DeviceAddress, settings: &GalilSettings) -> Result<GalilRig, OpenError> {
    let device = || GalilDevice::new(place.clone(), settings.clone());
    let attempt = || match GalilRig::open(device(), clock()) {
        Err(OpenError::Galil(GalilOpenError::Silent)) => None,
        other => Some(other),
    };
    until(attempt, || "nothing answers".into())
}

/// The rig with a reader of its reports.
pub struct Runner {
    pub rig: GalilRig,
    now: Nanos,
    pub newest: Option<Reading>,
    pub events: Vec<RigEvent>,
}

impl Runner {
    pub fn open(place: &DeviceAddress, settings: &GalilSettings) -> Self {
        let rig = opened(place, settings).expect("it is a Galil controller");
        assert!(!rig.is_virtual());
        Self { rig, now: Nanos::ZERO, newest: None, events: Vec::new() }
    }

    pub fn pass(&mut self) {
        self.now = self.now + Nanos::from_millis(10);
        while let Some(event) = self.rig.next_event(self.now) {
            assert!(event.at <= self.now);
            if let RigEventBody::Reading(reading) = event.body {
                self.newest = Some(reading);
            }
            self.events.push(event);
        }
    }

    pub fn until(&mut self, what: &str, is_so: impl Fn(&Self) -> bool) {
        let end = Instant::now() + PATIENCE;
        while !is_so(self) {
            assert!(Instant::now() < end, "{what} never: {:?}", self.faults());
            self.pass();
        }
    }

    /// The same, but the link may be lost: on a computer with much else to do the controller answers too late, or its line loses
    /// bytes.
    pub fn until_late(&mut self, what: &str, is_so: impl Fn(&Self) -> bool) -> Result<(), String> {
        let is_lost = |runner: &Self| {
            runner.faults().iter().any(|fault| match fault {
                Fault::LinkLost { .. } => true,
                Fault::CommandRefused { detail } => detail.contains("was garbled"),
                _ => false,
            })
        };
        self.until(what, |runner| is_so(runner) || is_lost(runner));
        if is_so(self) { Ok(()) } else { Err(format!("{what}: {:?}", self.faults())) }
    }

    pub fn faults(&self) -> Vec<&Fault> {
        self.events
            .iter()
            .filter_map(|event| match &event.body {
                RigEventBody::Fault(fault) => Some(fault),
                _ => None,
            })
            .collect()
    }

    /// Sends a command until it is acknowledged: on a computer with much else to do an answer may come so late that the rig
    /// refuses the command.
    pub fn tell(&mut self, command: RigCommand) {
        let is_done = |runner: &Self| {
            runner.events.iter().any(
                |event| matches!(&event.body, RigEventBody::Ack(ack) if command.is_answered_by(&ack.command)),
            )
        };
        let is_refused = |runner: &Self| {
            runner.faults().iter().any(|fault| matches!(fault, Fault::CommandRefused { .. }))
        };
        let end = Instant::now() + PATIENCE;
        loop {
            self.events.clear();
            self.rig.send(command);
            self.until("acknowledged", |runner| is_done(runner) || is_refused(runner));
            if is_done(self) {
                return;
            }
            assert!(Instant::now() < end, "acknowledged never: {:?}", self.faults());
        }
    }

    pub fn is_at_rest(&self) -> bool {
        self.newest.is_some_and(|reading| !reading.status.has(AxisStatus::MOVING))
    }

    /// The plug is put back: the same controller, at rest, obeys commands.
    fn reconnect(&mut self) {
        let end = Instant::now() + PATIENCE;
        while let Err(err) = self.rig.reconnect() {
            assert!(Instant::now() < end, "it never came back: {err}");
            self.pass();
        }
        self.newest = None;
        self.until("a sample", |runner| runner.newest.is_some());
        assert!(self.is_at_rest());
        self.tell(RigCommand::EnableMotor);
        self.tell(RigCommand::DefinePosition { pulses: 0 });
        self.tell(to(100, 19.98));
        self.until("there", |runner| {
            runner.is_at_rest() && runner.newest.is_some_and(|reading| reading.pulses == 100)
        });
    }

    /// A move, a stop, a halt; then the plug is pulled in mid-move.
    fn exercise(mut self, served: &Served) {
        self.until("a sample", |runner| runner.newest.is_some());
        self.tell(RigCommand::EnableMotor);
        self.tell(to(100, 19.98));
        self.until("moving", |runner| !runner.is_at_rest());
        self.until("there", |runner| {
            runner.is_at_rest() && runner.newest.is_some_and(|reading| reading.pulses == 100)
        });
        self.tell(to(6000, 0.75));
        self.tell(RigCommand::Stop);
        self.until("at rest", Self::is_at_rest);
        self.tell(RigCommand::Halt);
        let sent = self
            .rig
            .take_raw()
            .iter()
            .filter(|piece| piece.is_sent)
            .flat_map(|piece| piece.bytes.clone())
            .collect::<Vec<u8>>();
        let sent = String::from_utf8(sent).expect("ASCII lines");
        assert!(sent.starts_with("\rEO 0\r") && sent.contains("\rSTA;MG @AN[1]"));
        assert!(self.rig.links()[0].1.answers > 10);
        self.tell(to(6000, 0.75));
        self.events.clear();
        let order = served.orders.send("disconnect:2".into());
        order.expect("the emulator takes orders");
        self.until("lost", |runner| {
            matches!(runner.faults().first(), Some(Fault::LinkLost { .. }))
        });
        // Nothing hangs and nothing comes any more.
        self.rig.send(RigCommand::Stop);
        self.pass();
        let Err(err) = self.rig.reconnect() else {
            panic!("there is no plug");
        };
        assert!(!err.to_string().is_empty());
        self.rig.send(RigCommand::Stop);
        self.pass();
        self.reconnect();
        // The same after a drop of its supply.
        self.events.clear();
        let order = served.orders.send("reset".into());
        order.expect("the emulator takes orders");
        self.until("noticed", |runner| {
            let is_over = |fault: &Fault| {
                // A network connection goes with it.
                matches!(fault, Fault::ControllerReset | Fault::LinkLost { .. })
            };
            runner.faults().into_iter().any(is_over)
        });
        self.reconnect();
    }
}

#[test]
fn a_controller_on_a_network() {
    let at = At::Tcp(([127, 0, 0, 1], 0).into());
    let served = start(at, false, Nanos::ZERO, None);
    Runner::open(&DeviceAddress::Tcp(served.address.clone()), &thesis()).exercise(&served);
}

#[test]
fn a_controller_on_a_serial_port_that_only_one_program_has() {
    if skip::lacks_terminals() {
        return;
    }
    // Put back, it may be another pseudo-terminal, under the same name.
    let folder = tempfile::tempdir().expect("a folder");
    let at = At::Pty(Some(folder.path().join("galil")));
    let served = start(at, true, Nanos::ZERO, None);
    let place =
        DeviceAddress::Serial { port: served.address.clone(), baud: 115_200, has_handshake: false };
    let runner = Runner::open(&place, &thesis());
    let Err(err) = place.open() else {
        panic!("two programs have one port");
    };
    assert!(matches!(err, WireError::Busy { .. }), "{err:?}");
    runner.exercise(&served);
}

#[test]
fn a_converter_that_waits_is_measured() {
    if skip::lacks_terminals() {
        return;
    }
    let served = start(At::Pty(None), true, Nanos::from_millis(16), None);
    let place =
        DeviceAddress::Serial { port: served.address.clone(), baud: 115_200, has_handshake: false };
    let mut runner = Runner::open(&place, &thesis());
    runner.until("samples", |runner| runner.events.len() > 50);
    let stats = runner.rig.links()[0].1;
    assert!(stats.round_trip_max > Nanos::from_millis(8), "{stats:?}");
    assert!(stats.in_flight > 2, "{stats:?}");
}
