//! The runner with clocks that jump and a live fit that panics.

use super::clock::{HostTimes, TimeScale, host_times};
use super::live_feed::{Estimator, LiveFeed};
use super::main_loop::{MainLoop, Runner};
use super::panic_stop::is_registered;
use super::run_log::FaultLog;
use super::snapshot::RunnerSnapshot;
use super::start::{AfterStop, PromptResponder, RunRequest};
use crate::replay::replay;
use arc_swap::ArcSwap;
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::Nanos;
use palpate_model::estimate::LiveEstimate;
use palpate_model::metadata::SessionLabels;
use palpate_model::rig::{Fault, Limits};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_protocols::plans::RampHold;
use palpate_sessions::health::{AnchorReason, HealthContent};
use palpate_sessions::{HealthMessage, LogPart, Session};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

fn request(out: &Path) -> RunRequest {
    let rig = SimRig::new(SimSettings::default());
    let plan = RampHold {
        speed: MmPerS(3.0),
        depth: Depth(6.0),
        hold: Seconds(2.0),
        ..RampHold::default()
    };
    RunRequest {
        plan: plan.plan(),
        calibration: rig.calibration(),
        limits: Limits::for_travel(rig.description().travel),
        out: Some(out.to_path_buf()),
        labels: SessionLabels::default(),
        is_acknowledged: true,
        to_acknowledge: Vec::new(),
        after_stop: AfterStop::Close,
        answers: PromptResponder::Confirm,
        leader: None,
    }
}

/// A loop on a rig with a run that was just started.
fn started(rig: Box<dyn Rig>, scale: TimeScale, clock: Clock, out: &Path) -> MainLoop {
    let mut main_loop = MainLoop::new(rig, scale, Arc::new(clock));
    main_loop.start_run(&request(out)).unwrap();
    main_loop
}

type Clock = Box<dyn Fn() -> HostTimes + Send + Sync>;

/// The computer's clocks, read at one moment: a busy computer may do something else between two of them.
fn alike(start: HostTimes) -> HostTimes {
    let passed = host_times().awake - start.awake;
    HostTimes { wall: start.wall + passed, awake: start.awake + passed, all: start.all + passed }
}

/// Lets the loop turn until its run is over.
fn run(main_loop: MainLoop) {
    let (sender, requests) = sync_channel(1);
    let shared = ArcSwap::from_pointee(main_loop.snapshot(0));
    let sender = std::sync::Mutex::new(Some(sender));
    let shared = Arc::new(shared);
    let seen = Arc::clone(&shared);
    let wake = move || {
        let snapshot: Arc<RunnerSnapshot> = seen.load_full();
        let is_over = snapshot.run.as_ref().is_some_and(|run| run.outcome.is_some());
        if is_over {
            sender.lock().unwrap().take();
        }
    };
    main_loop.run(None, &requests, &shared, &wake);
}

/// Everything that a session tells of the computer.
fn health_of(path: &Path) -> Vec<HealthMessage> {
    let mut found = Vec::new();
    Session::scan_parts(path, &mut |part| {
        if let LogPart::Health(one) = part {
            found.push(one.clone());
        }
    })
    .unwrap();
    found
}

fn sim() -> SimRig {
    SimRig::new(SimSettings::default())
}

#[test]
fn wall_clock_jump_changes_no_sample_and_is_logged() {
    let folder = tempfile::tempdir().unwrap();
    let fast = TimeScale::Factor(40.0);
    let mut rows = Vec::new();
    for name in ["calm", "jumping"] {
        let start = host_times();
        let is_calm = name == "calm";
        // An hour back after half a second: as if the clock was set.
        let clock: Clock = Box::new(move || {
            let mut times = alike(start);
            if !is_calm && times.awake > start.awake + Duration::from_millis(500) {
                times.wall -= Duration::from_secs(3600);
            }
            times
        });
        let out = folder.path().join(name);
        run(started(Box::new(sim()), fast, clock, &out));
        let session = Session::open(&out).unwrap();
        assert_eq!(session.end.as_ref().unwrap().outcome, "finish");
        rows.push(session.rows);
        let found = health_of(&out);
        let anchors: Vec<(AnchorReason, f64)> = found
            .iter()
            .filter_map(|one| match &one.content {
                HealthContent::Anchor { reason: why, shift_s, .. } => Some((*why, *shift_s)),
                _ => None,
            })
            .collect();
        assert_eq!(anchors.first().unwrap().0, AnchorReason::Start);
        assert_eq!(anchors.last().unwrap().0, AnchorReason::End);
        let jumps: Vec<f64> = anchors[1..anchors.len() - 1].iter().map(|one| one.1).collect();
        match name {
            "calm" => assert_eq!(jumps, Vec::<f64>::new()),
            _ => {
                assert_eq!(jumps.len(), 1, "{jumps:?}");
                assert!((jumps[0] + 3600.0).abs() < 1e-6, "{jumps:?}");
            }
        }
        assert_eq!(session.auxiliary.health.clock_jumps, jumps.len() as u64);
        let worst = session.auxiliary.health.worst.unwrap();
        assert!(worst.free_bytes.is_some_and(|free| free > 0), "{worst:?}");
        assert!(worst.sync_s.is_some_and(|sync_s| sync_s > 0.0), "{worst:?}");
        assert_eq!(worst.missed_readings, 0);
        let times: Vec<Nanos> = found.iter().map(|one| one.now).collect();
        assert!(times.is_sorted(), "{times:?}");
    }
    assert_eq!(rows[0], rows[1]);
}

#[test]
fn a_computer_that_was_suspended_ends_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("session");
    let start = host_times();
    let suspended: Clock = Box::new(move || {
        let mut times = alike(start);
        if times.awake > start.awake + Duration::from_millis(500) {
            times.all += Duration::from_secs(20);
            times.wall += Duration::from_secs(20);
        }
        times
    });
    run(started(Box::new(sim()), TimeScale::Factor(20.0), suspended, &out));
    let session = Session::open(&out).unwrap();
    let end = session.end.as_ref().unwrap();
    assert_eq!(end.outcome, "abort");
    assert!(end.reason.contains("was suspended for 20.0 s"), "{}", end.reason);
    assert_eq!(session.auxiliary.health.clock_jumps, 1);
    assert_eq!(replay(&session, &[]).unwrap().first_difference, None);
}

struct PanickingEstimator(u32);

impl Estimator for PanickingEstimator {
    fn push(&mut self, _: Seconds, _: Depth, _: Newtons, _: Newtons) {
        self.0 += 1;
        assert!(self.0 < 700, "as if a matrix had no inverse");
    }

    fn estimate(&self) -> Option<LiveEstimate> {
        None
    }
}

#[test]
fn a_live_fit_that_panics_is_off_and_the_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut sessions = Vec::new();
    for name in ["sound", "panicking"] {
        let out = folder.path().join(name);
        let mut main_loop = started(Box::new(sim()), TimeScale::Max, Box::new(host_times), &out);
        let active = main_loop.run.as_mut().unwrap();
        if name == "panicking" {
            let config = active.engine().unwrap().config().clone();
            active.live = LiveFeed::with(&config, |_| Box::new(PanickingEstimator(0)));
        }
        run(main_loop);
        sessions.push(Session::open(&out).unwrap());
    }
    let [sound, panicking] = &sessions[..] else {
        panic!("two sessions");
    };
    assert_eq!(panicking.end.as_ref().unwrap().outcome, "finish");
    assert_eq!(panicking.rows, sound.rows);
    let events = &panicking.auxiliary.health.events;
    assert_eq!(events.len(), 1, "{events:?}");
    let text = &events[0].1;
    assert!(text.contains("as if a matrix had no inverse") && text.contains("is off"), "{text}");
    // At full pace the log does not depend on the computer.
    assert_eq!(panicking.auxiliary.health.messages, 1);
    assert_eq!(sound.auxiliary.health.messages, 0);
}

#[test]
fn rig_is_stopped_by_a_panic_as_soon_as_its_runner_is_started() {
    // Often enough that a thread which registers by itself is caught late.
    for _ in 0..200 {
        let rig = Box::new(SimRig::new(SimSettings::default()));
        let runner = Runner::start(rig, TimeScale::Max, None, || {}).unwrap();
        assert!(is_registered(runner.thread_id().unwrap()));
    }
}

/// Takes every line of the program's log.
#[derive(Clone, Default)]
struct Lines(Arc<std::sync::Mutex<Vec<String>>>);

impl tracing::Subscriber for Lines {
    fn enabled(&self, _: &tracing::Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::span::Id {
        tracing::span::Id::from_u64(1)
    }

    fn event(&self, event: &tracing::Event<'_>) {
        let mut line = String::new();
        event.record(&mut |field: &tracing::field::Field, value: &dyn std::fmt::Debug| {
            line += &format!("{field}={value:?} ");
        });
        self.0.lock().unwrap().push(line);
    }

    fn record(&self, _: &tracing::span::Id, _: &tracing::span::Record<'_>) {}
    fn record_follows_from(&self, _: &tracing::span::Id, _: &tracing::span::Id) {}
    fn enter(&self, _: &tracing::span::Id) {}
    fn exit(&self, _: &tracing::span::Id) {}
}

#[test]
fn program_log_of_a_tripped_interlock_holds_no_force() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tripped");
    let lines = Lines::default();
    tracing::subscriber::with_default(lines.clone(), || {
        let mut main_loop = MainLoop::new(Box::new(sim()), TimeScale::Max, Arc::new(host_times));
        let mut request = request(&out);
        request.limits.force_max = Newtons(0.5);
        main_loop.start_run(&request).unwrap();
        run(main_loop);
    });
    let is_force = |text: &str| {
        text.as_bytes().windows(3).any(|it| it[0].is_ascii_digit() && it.ends_with(b" N"))
    };
    let end = Session::open(&out).unwrap().end.unwrap();
    assert_eq!(end.outcome, "interlock");
    assert!(is_force(&end.reason), "{}", end.reason);
    let lines = lines.0.lock().unwrap();
    assert!(lines.iter().any(|line| line.contains("interlock tripped: force")), "{lines:?}");
    assert!(!lines.iter().any(|line| is_force(line)), "{lines:?}");
}

#[test]
fn faults_in_turn_leave_a_line_a_minute_of_each_kind() {
    let lines = Lines::default();
    tracing::subscriber::with_default(lines.clone(), || {
        let mut faults = FaultLog::default();
        // Ten minutes of two faults in turn, a thousand times a second.
        for ms in 0..600_000 {
            let fault = match ms % 2 {
                0 => Fault::SignalInvalid { tick: ms },
                _ => Fault::CommandRefused { detail: "busy".into() },
            };
            faults.log_fault(Nanos::from_millis(ms), &fault);
        }
    });
    let lines = lines.0.lock().unwrap();
    assert_eq!(lines.len(), 2 * 10, "{lines:?}");
    assert!(lines[2].contains("29999 more"), "{}", lines[2]);
}
