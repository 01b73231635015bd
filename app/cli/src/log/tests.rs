//! A panic while an emulated stand moves: what is on the wire before what is in the log.
//!
//! Hook and log belong to a process, so each case runs in a child: this test program again, with one test and the
//! case in its environment.
#![expect(
    clippy::disallowed_methods,
    reason = "the rig has to move before it is stopped; the clock of a test stands for the runner's"
)]

use super::{begin, stop_rigs_on_panic};
use palpate_drivers::Rig;
use palpate_drivers::device::{DeviceRig, OpenError, OpenedDevices, RigDevice};
use palpate_drivers::mark10::gauge::GaugeSettings;
use palpate_drivers::mark10::stand::{self, StandSettings};
use palpate_drivers::wire::{HostClock, Link, MemoryLink, memory_link_pair};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::mark10::{EmulatedStand, EmulatedStandSettings};
use palpate_model::Nanos;
use palpate_model::rig::{MoveTo, RigCommand, RigDescription};
use palpate_model::units::{MmPerS, MmPerS2, Newtons, Position};
use palpate_runner::{Runner, TimeScale};
use palpate_sessions::program_log::log_files;
use palpate_test_support::wait::until;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Names the case to a child.
const CASE: &str = "PALPATE_TEST_PANIC";
/// Stands among the writes for the moment of the panic.
const MOMENT: &[u8] = b"panic";
const WORDS: &str = "as if an index were out of bounds";

/// What is on the wire and what is in the log, at the time of each write of the host.
#[derive(Default)]
struct Seen {
    is_watched: AtomicBool,
    /// Every write since it is watched and the moment of the panic, each with whether the log spoke of the panic by then.
    writes: Mutex<Vec<(Vec<u8>, bool)>>,
    fails: AtomicBool,
}

impl Seen {
    fn note(&self, bytes: &[u8], is_reported: bool) {
        self.writes.lock().unwrap().push((bytes.to_vec(), is_reported));
    }

    fn panics(&self) -> ! {
        self.note(MOMENT, false);
        panic!("{WORDS}");
    }
}

/// The host's end of the wire.
struct Watched {
    inner: MemoryLink,
    seen: Arc<Seen>,
    log: PathBuf,
}

fn speaks_of_panic(log: &Path) -> bool {
    let texts = log_files(log).into_iter().map(std::fs::read_to_string);
    texts.flatten().any(|text| text.contains(WORDS))
}

impl Link for Watched {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        if self.seen.fails.swap(false, Ordering::SeqCst) {
            self.seen.panics();
        }
        self.inner.read(buffer, wait)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.seen.is_watched.load(Ordering::SeqCst) {
            self.seen.note(bytes, speaks_of_panic(&self.log));
        }
        self.inner.write(bytes)
    }
}

/// A stand at the other end, until the program ends.
fn emulate(mut theirs: MemoryLink, clock: HostClock) {
    let work = move || {
        let mut stand = EmulatedStand::new(EmulatedStandSettings::default());
        let mut buffer = [0_u8; 256];
        while let Ok(count) = theirs.read(&mut buffer, Duration::from_millis(1)) {
            stand.receive(clock(), 0, &buffer[..count]);
            stand.advance(clock());
            let bytes = stand.transmit(0);
            if !bytes.is_empty() && theirs.write(&bytes).is_err() {
                return;
            }
        }
    };
    let thread = std::thread::Builder::new().name("emulator".into());
    thread.spawn(work).unwrap();
}

fn settings() -> StandSettings {
    StandSettings {
        name: "stand".into(),
        travel: Position(100.0),
        speed_max: MmPerS(10.0),
        acceleration: MmPerS2(50.0),
        unseen: RigDescription::UNSEEN_USUAL,
        is_upwards: false,
        gauge: GaugeSettings { capacity: Newtons(25.0), ..GaugeSettings::default() },
    }
}

/// A stand on a link that is there once.
struct OnLink(Option<Box<dyn Link>>);

impl RigDevice for OnLink {
    fn open(&mut self, clock: &HostClock) -> Result<OpenedDevices, OpenError> {
        let used = || OpenError::Thread("the link was used".into());
        stand::open(self.0.take().ok_or_else(used)?, &settings(), clock)
    }
}

/// The program that panics; it tells its parent what was written when.
fn child(case: &str) {
    let log = begin(true);
    stop_rigs_on_panic(log.clone());
    let start = Instant::now();
    let clock: HostClock = Arc::new(move || Nanos(start.elapsed().as_nanos() as u64));
    let (ours, theirs) = memory_link_pair();
    emulate(theirs, Arc::clone(&clock));
    let seen = Arc::new(Seen::default());
    let folder = palpate_sessions::library_folder().unwrap();
    let link = Watched {
        inner: ours,
        seen: Arc::clone(&seen),
        log: palpate_sessions::program_log::log_folder(&folder),
    };
    let mut rig = DeviceRig::open(OnLink(Some(Box::new(link))), clock).unwrap();
    seen.is_watched.store(true, Ordering::SeqCst);
    rig.send(RigCommand::MoveTo(MoveTo {
        target_pulses: 5_000,
        speed: MmPerS(1.0),
        acceleration: MmPerS2(50.0),
    }));
    let is_written = |what: &'static [u8]| {
        let writes = seen.writes.lock().unwrap();
        writes.iter().any(|(bytes, _)| bytes.ends_with(what))
    };
    until(|| is_written(b"d").then_some(()), || "the stand does not move".into());
    let is_runner = case == "runner";
    let (wakes, printed) = (Mutex::new(0), Arc::clone(&seen));
    let wake = move || {
        let mut wakes = wakes.lock().unwrap();
        *wakes += 1;
        if is_runner && *wakes == 2 {
            printed.panics();
        }
    };
    let runner = Runner::start(Box::new(rig), TimeScale::Factor(1.0), None, wake).unwrap();
    match case {
        "runner" => {}
        "link" => seen.fails.store(true, Ordering::SeqCst),
        _ => {
            let thread = std::thread::Builder::new().name("elsewhere".into());
            let printed = Arc::clone(&seen);
            let thread = thread.spawn(move || printed.panics()).unwrap();
            assert!(thread.join().is_err());
        }
    }
    let log = log.unwrap();
    let folder = palpate_sessions::program_log::log_folder(&folder);
    let is_reported = || {
        log.flush();
        speaks_of_panic(&folder).then_some(())
    };
    until(is_reported, || "the panic is not logged".into());
    for (bytes, is_reported) in seen.writes.lock().unwrap().iter() {
        println!("WROTE {} {is_reported}", String::from_utf8_lossy(bytes).escape_default());
    }
    drop(runner);
}

/// Runs a case; the writes of its host, each with whether the log spoke of the panic by then, and the log.
fn panics(case: &str) -> (Vec<(String, bool)>, String) {
    let home = tempfile::tempdir().unwrap();
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["log::tests::a_panic_stops_the_rig_before_it_is_logged", "--exact", "--nocapture"])
        .env(CASE, case)
        .env("PALPATE_HOME", home.path())
        .env_remove("RUST_LOG")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stdout).into_owned();
    let writes = message.lines().filter_map(|line| line.split_once("WROTE "));
    let writes = writes.filter_map(|(_, write)| write.rsplit_once(' '));
    let writes: Vec<_> =
        writes.map(|(bytes, is_reported)| (bytes.to_owned(), is_reported == "true")).collect();
    let log = log_files(&home.path().join("log"));
    let log = log.first().map(|path| std::fs::read_to_string(path).unwrap());
    let errors = String::from_utf8_lossy(&output.stderr);
    (writes, log.unwrap_or_else(|| panic!("no log: {message}{errors}")))
}

#[test]
fn a_panic_stops_the_rig_before_it_is_logged() {
    if let Ok(case) = std::env::var(CASE) {
        return child(&case);
    }
    for (case, thread) in [("elsewhere", "elsewhere"), ("runner", "runner"), ("link", "stand")] {
        let (writes, log) = panics(case);
        let after = writes.iter().skip_while(|(bytes, _)| bytes != "panic").skip(1);
        let mut stops = after.filter(|(bytes, _)| bytes.ends_with('s'));
        let first = stops.next();
        assert!(matches!(first, Some((_, false))), "{case}: {writes:?}\n{log}");
        let panicked = log.lines().find(|line| line.contains("panicked at")).unwrap();
        assert!(panicked.contains("log/tests.rs"), "{case}: {log}");
        assert!(log.contains(WORDS) && log.starts_with("palpate "), "{case}: {log}");
        assert!(log.contains(thread), "{case}: {log}");
    }
}
