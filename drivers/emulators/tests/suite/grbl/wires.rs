//! Board and load cell on two pseudo-terminals, as `palpate emulate grbl` puts them there, and the rig of a rig file.

use palpate_drivers::rig_file::RigFile;
use palpate_drivers::sim::SimSettings;
use palpate_drivers::wire::HostClock;
use palpate_drivers::{Rig, RigEventBody};
use palpate_emulators::ScheduledFault;
use palpate_emulators::bench::EmulatedBench;
use palpate_emulators::cell::emulated_cell;
use palpate_emulators::grbl::{EmulatedGrblSettings, Grbl};
use palpate_emulators::serve::{EmulatorAddress, ServeEvent, ServeOptions, serve};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, MoveTo, PathTracker, Reading, RigCommand};
use palpate_model::units::{MmPerS, MmPerS2};
use palpate_test_support::skip;
use palpate_test_support::wait::{PATIENCE, until};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

struct Served {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    orders: SyncSender<String>,
    places: Vec<String>,
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// `None`, with a word, where there are no pseudo-terminals.
fn start(cell: &'static str, faults: Vec<ScheduledFault>) -> Option<Served> {
    start_at(cell, faults, vec![None, None])
}

fn start_at(
    cell: &'static str,
    faults: Vec<ScheduledFault>,
    links: Vec<Option<PathBuf>>,
) -> Option<Served> {
    if skip::lacks_terminals() {
        return None;
    }
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    let (orders, received) = sync_channel(4);
    let (tell, printed) = sync_channel(64);
    let thread = std::thread::Builder::new()
        .name("emulator".into())
        .spawn(move || {
            let cell = emulated_cell(cell, 1).expect("it is emulated");
            let board = Grbl::new(EmulatedGrblSettings::default());
            let mut device = EmulatedBench::new(&SimSettings::default(), Box::new(board), cell);
            let options = ServeOptions {
                address: EmulatorAddress::Ptys(links),
                baud: None,
                latency: Nanos::ZERO,
                faults,
                seed: 1,
            };
            let mut listener = |message| drop(tell.try_send(message));
            let served = serve(&mut device, &options, &received, &asked, &mut listener);
            served.expect("it is served");
        })
        .expect("a thread");
    let Ok(ServeEvent::Ready(places)) = printed.recv_timeout(PATIENCE) else {
        panic!("it did not start");
    };
    Some(Served {
        stop,
        thread: Some(thread),
        orders,
        places: places.split(", ").map(str::to_owned).collect(),
    })
}

#[expect(clippy::disallowed_methods, reason = "real wires take real time")]
fn now() -> Instant {
    Instant::now()
}

/// The rig of a rig file, with a test's clock.
struct Client {
    rig: Box<dyn Rig>,
    start: Instant,
    readings: Vec<Reading>,
    acks: Vec<RigCommand>,
    faults: Vec<Fault>,
}

impl Client {
    fn open(served: &Served, cell: &str) -> Self {
        let [board, cell_port] = served.places.as_slice() else {
            panic!("{:?}", served.places);
        };
        let text = format!(
            "device = \"grbl\"\nport = \"{board}\"\nmm_per_pulse = 0.0025\ntravel_mm = 150\nspeed_max_mm_s = 20\n\
             acceleration_mm_s2 = 60\nhome_switch = \"limit\"\n[cell]\nport = \"{cell_port}\"\n{cell}\n"
        );
        let file = RigFile::parse("bench.toml", &text).expect("a rig file");
        let start = now();
        let clock: HostClock = Arc::new(move || Nanos(start.elapsed().as_nanos() as u64));
        Self {
            // A computer with much else to do may hear no answer in time: who opens a rig tries again.
            rig: until(|| file.open(&clock).ok(), || "it does not open".into()),
            start: now(),
            readings: Vec::new(),
            acks: Vec::new(),
            faults: Vec::new(),
        }
    }

    fn turn(&mut self) {
        let until = Nanos(self.start.elapsed().as_nanos() as u64) + Nanos::from_millis(5);
        while let Some(event) = self.rig.next_event(until) {
            match event.body {
                RigEventBody::Reading(reading) => self.readings.push(reading),
                RigEventBody::Ack(ack) => self.acks.push(ack.command),
                RigEventBody::Fault(fault) => self.faults.push(fault),
            }
        }
    }

    fn until(&mut self, what: &str, is_so: impl Fn(&Self) -> bool) {
        let end = now() + PATIENCE;
        while !is_so(self) {
            assert!(now() < end, "{what} never: {:?}", self.faults);
            self.turn();
        }
    }

    fn tell(&mut self, command: RigCommand) {
        let before = self.acks.len();
        self.rig.send(command);
        self.until("acknowledged", |client| client.acks.len() > before);
    }

    fn is_moving(&self) -> bool {
        self.readings.last().is_some_and(|reading| reading.status.has(AxisStatus::MOVING))
    }
}

fn to(target_pulses: i64, speed: f64) -> MoveTo {
    MoveTo { target_pulses, speed: MmPerS(speed), acceleration: MmPerS2(60.0) }
}

const HX711: &str = "device = \"hx711\"";
const NUMBERS: &str = "device = \"plain-numbers\"\nunit = \"counts\"\nfull_scale = 8388607";
const GAUGE: &str = "device = \"mark10\"\ncapacity_n = 25";

#[test]
fn samples_follow_the_path_with_every_cell() {
    for (word, cell, newtons_per_volt) in
        [("hx711", HX711, None), ("mark10", GAUGE, Some(1.0)), ("plain-numbers", NUMBERS, None)]
    {
        let Some(served) = start(word, Vec::new()) else {
            return;
        };
        let mut client = Client::open(&served, cell);
        assert_eq!(client.rig.newtons_per_volt(), newtons_per_volt);
        assert_eq!(client.rig.links().len(), 2);
        let mut tracker = PathTracker::new(client.rig.description());
        client.tell(RigCommand::EnableMotor);
        client.until("samples", |client| client.readings.len() > 5);
        for reading in client.readings.drain(..) {
            tracker.on_reading(&reading).expect("on the path");
        }
        for (target, speed) in [(2_000, 9.0), (2_020, 0.75), (2_010, 9.0)] {
            let wanted = to(target, speed);
            tracker.on_move(wanted);
            client.tell(RigCommand::MoveTo(wanted));
            client.until("begun", |client| {
                client.readings.iter().any(|r| r.status.has(AxisStatus::MOVING))
            });
            client.until("at rest", |client| !client.is_moving());
            for reading in client.readings.drain(..) {
                tracker.on_reading(&reading).expect("on the path");
                if tracker.is_at_rest() {
                    assert_eq!(reading.pulses, target);
                }
            }
            assert!(tracker.is_at_rest());
        }
        client.tell(RigCommand::DefinePosition { pulses: -7 });
        let before = client.readings.len();
        client.until("a sample", |client| client.readings.len() > before);
        assert_eq!(client.readings[before].pulses, -7);
        assert_eq!(client.faults, []);
        assert!(client.readings.windows(2).all(|pair| pair[0].tick < pair[1].tick));
        assert!(!client.rig.take_raw().is_empty());
    }
}

#[test]
fn a_stop_ends_a_move_and_both_ends_of_a_pulled_plug_are_reported() {
    let Some(served) = start("hx711", Vec::new()) else {
        return;
    };
    let mut client = Client::open(&served, HX711);
    client.tell(RigCommand::EnableMotor);
    client.tell(RigCommand::MoveTo(to(40_000, 9.0)));
    client.until("moving", Client::is_moving);
    client.tell(RigCommand::Stop);
    client.until("at rest", |client| !client.is_moving());
    assert_eq!(client.faults, []);
    served.orders.send("disconnect:60".into()).expect("it listens");
    client.until("printed", |client| {
        let lost = client.faults.iter().filter(|fault| matches!(fault, Fault::LinkLost { .. }));
        lost.count() == 2
    });
}

#[test]
fn a_cell_that_falls_silent_stops_the_axis() {
    let Some(served) = start("hx711", Vec::new()) else {
        return;
    };
    let mut client = Client::open(&served, HX711);
    client.tell(RigCommand::EnableMotor);
    client.tell(RigCommand::MoveTo(to(40_000, 5.0)));
    client.until("moving", Client::is_moving);
    // Nothing comes from either device for as long as the cell may be silent, and from the board shorter than it may be.
    served.orders.send("mute:0.7".into()).expect("it listens");
    client.until("printed", |client| {
        client.faults.iter().any(|fault| fault.to_string().contains("load cell"))
    });
    let before = client.readings.len();
    client.until("samples again", |client| client.readings.len() > before + 20);
    client.until("at rest", |client| !client.is_moving());
    assert!(client.readings.last().expect("one").pulses < 30_000);
}

#[test]
fn both_plugs_pulled_and_put_back_the_rig_is_connected_anew_and_nothing_moves() {
    let folder = tempfile::tempdir().expect("a folder");
    let links = ["board", "cell"].map(|name| Some(folder.path().join(name)));
    let Some(served) = start_at("hx711", Vec::new(), links.to_vec()) else {
        return;
    };
    let mut client = Client::open(&served, HX711);
    client.tell(RigCommand::EnableMotor);
    client.tell(RigCommand::MoveTo(to(40_000, 5.0)));
    client.until("moving", Client::is_moving);
    served.orders.send("disconnect:2".into()).expect("it listens");
    client.until("printed", |client| {
        let lost = client.faults.iter().filter(|fault| matches!(fault, Fault::LinkLost { .. }));
        lost.count() == 2
    });
    client.rig.reconnect().expect_err("nothing is there");
    let end = now() + PATIENCE;
    while let Err(err) = client.rig.reconnect() {
        assert!(now() < end, "never again: {err}");
        std::thread::sleep(Duration::from_millis(100));
    }
    client.readings.clear();
    client.faults.clear();
    client.until("samples", |client| client.readings.len() > 20);
    let first = client.readings[0].pulses;
    for reading in &client.readings {
        assert_eq!(reading.pulses, first);
        assert!(!reading.status.has(AxisStatus::MOVING));
    }
    assert_eq!(client.faults, []);
    // It can be driven again.
    client.tell(RigCommand::EnableMotor);
    client.tell(RigCommand::MoveTo(to(first + 200, 5.0)));
    client.until("there", |client| {
        client.readings.last().is_some_and(|reading| reading.pulses == first + 200)
    });
}
