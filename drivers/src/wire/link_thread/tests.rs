use super::*;
use std::sync::atomic::AtomicU64;
use std::sync::mpsc::Receiver;

/// Notes its commands, writes a line for each command and reports every byte as an acknowledgement of a stop.
struct Notes {
    heard: Arc<Mutex<Vec<String>>>,
    lines: VecDeque<Vec<u8>>,
    events: VecDeque<(Nanos, RigEventBody)>,
    fails_at: Option<u8>,
    fails: Box<dyn Fn() + Send>,
}

impl Default for Notes {
    fn default() -> Self {
        Self {
            heard: Arc::default(),
            lines: VecDeque::new(),
            events: VecDeque::new(),
            fails_at: None,
            fails: Box::new(|| ()),
        }
    }
}

impl Notes {
    fn note(&self, text: String) {
        self.heard.lock().unwrap().push(text);
    }
}

impl Dialogue for Notes {
    fn note_attendance(&mut self, _at: Nanos) {}

    fn command(&mut self, _now: Nanos, command: RigCommand) {
        self.note(format!("{command:?}"));
        self.lines.push_back(format!("{command:?}\r").into_bytes());
    }

    fn overtaken(&mut self, _now: Nanos, command: RigCommand) {
        self.note(format!("overtaken {command:?}"));
    }

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        for byte in bytes {
            if Some(*byte) == self.fails_at {
                (self.fails)();
                panic!("a driver that fails");
            }
            let ack = palpate_model::rig::Ack { command: RigCommand::Stop };
            self.events.push_back((now, RigEventBody::Ack(ack)));
        }
    }

    fn take_line(&mut self, _now: Nanos) -> Option<Vec<u8>> {
        self.lines.pop_front()
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        now + Nanos::from_millis(1)
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, _now: Nanos) -> Option<String> {
        None
    }

    fn stats(&self) -> LinkStats {
        LinkStats::default()
    }
}

/// A link whose reads wait until the test lets them go on.
struct Gate {
    inner: super::super::MemoryLink,
    waits: SyncSender<()>,
    go_on: Receiver<()>,
}

impl Link for Gate {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        // The test looks once; once it has let go nothing waits any more.
        let _ = self.waits.try_send(());
        let _ = self.go_on.recv();
        self.inner.read(buffer, wait)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.inner.write(bytes)
    }
}

fn clock() -> HostClock {
    let count = AtomicU64::new(0);
    Arc::new(move || Nanos(count.fetch_add(1_000, Ordering::Relaxed)))
}

fn start(link: impl Link + 'static, notes: Notes) -> LinkThread {
    LinkThread::start(Box::new(link), notes, &clock(), "controller".into(), b"bye".to_vec())
        .unwrap()
}

const WAIT: Duration = Duration::from_secs(20);

fn read(link: &mut impl Link, count: usize) -> Vec<u8> {
    let mut all = Vec::new();
    while all.len() < count {
        let mut part = [0_u8; 64];
        let got = link.read(&mut part, WAIT).unwrap();
        assert!(got > 0, "only {all:?}");
        all.extend_from_slice(&part[..got]);
    }
    all
}

#[test]
fn stops_overtake_waiting_commands() {
    let (here, mut there) = super::super::memory_link_pair();
    let (release, go_on) = sync_channel::<()>(1);
    let (waits, waiting) = sync_channel(1);
    let notes = Notes::default();
    let heard = Arc::clone(&notes.heard);
    let gate = Gate { inner: here, waits, go_on };
    let mut line = start(gate, notes);
    waiting.recv().unwrap();
    let define = RigCommand::DefinePosition { pulses: 3 };
    line.send(define).unwrap();
    line.send(RigCommand::Halt).unwrap();
    line.send(RigCommand::EnableMotor).unwrap();
    drop(release);
    assert_eq!(read(&mut there, 17), b"Halt\rEnableMotor\r");
    let heard = heard.lock().unwrap().clone();
    assert_eq!(heard, ["overtaken DefinePosition { pulses: 3 }", "Halt", "EnableMotor"]);
    let mut raw = line.take_raw();
    while raw.is_empty() {
        std::thread::yield_now();
        raw = line.take_raw();
    }
    assert!(raw.iter().all(|piece| piece.is_sent && &*piece.device == "controller"));
    drop(line);
    assert_eq!(read(&mut there, 3), b"bye");
}

#[test]
fn stop_does_not_wait_for_a_reader_of_reports() {
    let (here, mut there) = super::super::memory_link_pair();
    let mut line = start(here, Notes::default());
    let reports = Arc::clone(&line.reports);
    let reading = reports.0.lock().unwrap();
    // Something to report comes first, so that the thread has wanted to hand it over.
    there.write(b"a").unwrap();
    line.send(RigCommand::EnableMotor).unwrap();
    assert_eq!(read(&mut there, 12), b"EnableMotor\r");
    line.send(RigCommand::Halt).unwrap();
    assert_eq!(read(&mut there, 5), b"Halt\r");
    drop(reading);
    let event = line.next_event(Nanos(u64::MAX), WAIT).unwrap();
    assert!(matches!(event.body, RigEventBody::Ack(_)));
}

#[test]
fn events_are_reported_in_order_and_a_lost_link_last() {
    let (here, mut there) = super::super::memory_link_pair();
    let line = start(here, Notes::default());
    there.write(b"ab").unwrap();
    let late = Nanos(u64::MAX);
    for _ in 0..2 {
        let event = line.next_event(late, WAIT).unwrap();
        assert!(matches!(event.body, RigEventBody::Ack(_)));
    }
    drop(there);
    let last = line.next_event(late, WAIT).unwrap();
    assert!(matches!(&last.body, RigEventBody::Fault(Fault::LinkLost { .. })), "{last:?}");
    // Waiting for events that cannot come ends at once.
    assert_eq!(line.next_event(late, Duration::from_secs(600)), None);
}

#[test]
fn a_driver_that_fails_is_a_lost_link() {
    let (here, mut there) = super::super::memory_link_pair();
    let notes = Notes { fails_at: Some(b'!'), ..Notes::default() };
    let line = start(here, notes);
    there.write(b"!").unwrap();
    let last = line.next_event(Nanos(u64::MAX), WAIT).unwrap();
    assert!(matches!(last.body, RigEventBody::Fault(Fault::LinkLost { .. })));
    // No other thread has the link: its farewell stops what moves.
    assert_eq!(read(&mut there, 3), b"bye");
}

#[test]
fn a_halt_around_the_owner_is_on_the_wire_when_it_says_so() {
    let (here, mut there) = super::super::memory_link_pair();
    let mut line = start(here, Notes::default());
    let handle = line.halt_handle().unwrap();
    assert!(handle.halt(WAIT) && handle.written() == 1);
    assert_eq!(read(&mut there, 5), b"Halt\r");
    // Stops of the owner count on from there.
    line.send(RigCommand::Stop).unwrap();
    assert!(handle.is_written(2, WAIT));
    assert_eq!(read(&mut there, 5), b"Stop\r");
    drop(there);
    let late = Nanos(u64::MAX);
    assert!(line.next_event(late, WAIT).is_some());
    drop(line);
    assert!(!handle.halt(WAIT));
}

#[test]
fn what_waits_for_a_farewell_comes_after_it() {
    let (here, mut there) = super::super::memory_link_pair();
    let (events, order) = sync_channel(2);
    let deferred = events.clone();
    let notes = Notes {
        fails_at: Some(b'!'),
        fails: Box::new(move || {
            let deferred = deferred.clone();
            super::super::run_after_link_stop(move || deferred.send("deferred").unwrap());
        }),
        ..Notes::default()
    };
    struct EventLink(super::super::MemoryLink, SyncSender<&'static str>);
    impl Link for EventLink {
        fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
            self.0.read(buffer, wait)
        }

        fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.1.send("written").unwrap();
            self.0.write(bytes)
        }
    }
    let _line = start(EventLink(here, events), notes);
    there.write(b"!").unwrap();
    assert_eq!(order.recv_timeout(WAIT).unwrap(), "written");
    assert_eq!(order.recv_timeout(WAIT).unwrap(), "deferred");
}
