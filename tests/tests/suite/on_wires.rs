//! A whole protocol on an emulated controller behind a pseudo-terminal, at real pace: what is in its session, and a link
//! that is lost and made again. A computer that is busy with other tests may keep samples waiting until an interlock ends
//! the run, as it must: such a run is checked as far as it went and made again.
//! The list of skipped tests names those of which no run was in time.

use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_drivers::{Rig, open_wired};
use palpate_emulators::galil::{EmulatedGalilSettings, GalilEmulator};
use palpate_emulators::serve::{EmulatorAddress, ServeEvent, ServeOptions, serve};
use palpate_haptics::Period;
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_haptics::simulation::SimulationSettings;
use palpate_model::Nanos;
use palpate_model::calibration::Calibration;
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_protocols::plans::{FindContact, Follow, Plan, Step};
use palpate_runner::haptics::slave::{SlaveLeader, SlaveReport, SlaveSettings};
use palpate_runner::replay::replay;
use palpate_runner::{Runner, RunnerRequest, StartedRun, Stopwatch, TimeScale, driver_clock};
use palpate_sessions::Session;
use palpate_test_support::skip::lacks_terminals;
use palpate_test_support::wait::{Deadline, PATIENCE, in_time, until};
use palpate_tests::lab::{retract, set_up};
use palpate_tests::{built_in_plan, recorded_runs};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

/// What a run says that a busy computer has ended.
const LATE: [&str; 3] = ["sample age interlock", "was suspended", "samples arrived"];

/// An emulated controller; unplugged when dropped.
struct Emulator(Arc<AtomicBool>, Option<JoinHandle<()>>);

impl Emulator {
    fn at(path: &Path) -> Result<Self, String> {
        let is_over = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&is_over);
        let (sender, events) = sync_channel(4);
        let options = ServeOptions {
            address: EmulatorAddress::Ptys(vec![Some(path.to_owned())]),
            baud: None,
            latency: Nanos::ZERO,
            faults: Vec::new(),
            seed: 1,
        };
        let thread = std::thread::Builder::new()
            .name("emulator".into())
            .spawn(move || {
                let mut device = GalilEmulator::new(EmulatedGalilSettings {
                    is_serial: true,
                    ..EmulatedGalilSettings::default()
                });
                let (_orders, received) = sync_channel(1);
                let mut tell = |event| drop(sender.try_send(event));
                // The sender falls with the thread, and so tells of a failure.
                let _ = serve(&mut device, &options, &received, &stop, &mut tell);
            })
            .map_err(|err| err.to_string())?;
        match events.recv_timeout(PATIENCE) {
            Ok(ServeEvent::Ready(_)) => Ok(Self(is_over, Some(thread))),
            _ => Err("there is no pseudo-terminal".into()),
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
        if let Some(thread) = self.1.take() {
            let _ = thread.join();
        }
    }
}

/// Waits until a snapshot is as wanted.
fn wait(runner: &Runner, woken: &Receiver<()>, mut is_it: impl FnMut() -> bool) -> bool {
    let end = Deadline::new();
    while !end.is_over() {
        if is_it() {
            return true;
        }
        if woken.recv_timeout(Duration::from_secs(20)).is_err() && !runner.is_alive() {
            return false;
        }
    }
    false
}

/// The rig of an emulated controller, by a rig file, and the calibration of its cell.
fn bench(folder: &Path, port: &Path) -> Result<(Box<dyn Rig>, Calibration), String> {
    let file = folder.join("bench.toml");
    let text = format!(
        "device = \"galil\"\nport = \"{}\"\nmm_per_pulse = 0.015\ntravel_mm = 150\nspeed_max_mm_s = 20\n\
         acceleration_mm_s2 = 61.44\nunseen_mm = 0.5\nconverter = \"16 bit\"\n",
        port.display()
    );
    std::fs::write(&file, text).map_err(|err| err.to_string())?;
    // A computer with much else to do may hear no answer in time: who opens a rig tries again.
    let name = file.display().to_string();
    let rig = until(|| open_wired(&name, &driver_clock()).ok(), || "the rig does not open".into());
    let calibration = SimRig::new(SimSettings::default()).calibration();
    Ok((rig, calibration))
}

/// Why a run ended before its end. Samples that come late end one, as they must; nothing else may.
fn early_end(session: &Session) -> Option<String> {
    let end = session.end.as_ref().expect("the session has an end");
    if end.outcome == "finish" {
        return None;
    }
    let is_late = LATE.iter().any(|words| end.reason.contains(words));
    assert!(is_late, "{}: {}", end.outcome, end.reason);
    Some(format!("{} after {} samples", end.reason, session.rows.len()))
}

#[test]
fn a_slave_on_wires_follows_a_master_in_real_time() {
    if lacks_terminals() {
        return;
    }
    let Some((slaved, session)) = in_time(slave_once) else {
        return;
    };
    println!("{slaved:?}");
    let deepest = deepest_followed(&session);
    assert!(deepest > 1.0, "{deepest}");
    // The controller takes targets on the way: from rest to rest there would be four a second.
    let targets = session.entries.iter().filter(|entry| entry.body["command"] == "track").count();
    assert!(targets > 100, "{targets}");
    let lost = session.entries.iter();
    let lost = lost.filter(|entry| entry.body["record"] == "lead_lost");
    assert_eq!(lost.count(), 0);
    // Its loop is in real time: a tick a millisecond of what followed, missed ones among them.
    let kept = slaved.master_loop.unwrap().timing;
    let ticks = kept.late.count + kept.missed;
    assert!(ticks >= 5_500, "{ticks}");
}

/// The deepest that a slave was led.
fn deepest_followed(session: &Session) -> f64 {
    let followed = session.rows.iter().filter(|row| row.phase == Phase::Follow);
    followed.filter_map(|row| row.depth).fold(0.0, f64::max)
}

/// One run of a slave, checked however it ended; what was followed, or why it ended early.
fn slave_once() -> Result<(SlaveReport, Session), String> {
    let folder = tempfile::tempdir().unwrap();
    let port = folder.path().join("galil");
    let _emulator = Emulator::at(&port).unwrap();
    let (rig, calibration) = bench(folder.path(), &port).unwrap();
    let follow = Follow { duration: Seconds(6.0), speed: MmPerS(6.0), depth_max: Depth(4.0) };
    // As quickly as contact is found at all: how well is not the question here.
    let contact = FindContact {
        approach_speed: MmPerS(6.0),
        retreat_mm: 1.0,
        pass_speed: MmPerS(0.6),
        recovery: Seconds(0.5),
        std_error_mm_max: 1.0,
        press: None,
        ..FindContact::default()
    };
    let mut steps = set_up(Seconds(1.0), contact);
    steps.extend([Step::Follow(follow), retract()]);
    let hand = SimulatedHand::firm(HandPath::Sine { middle: 3.0, amplitude: 3.0, hz: 0.2 });
    let body = ModifiedKelvin::THESIS;
    let leader = SlaveLeader::new(SlaveSettings {
        master: SimulationSettings::of(body, Period::MILLISECOND, hand),
        body,
        depth_max: follow.depth_max,
        rig: rig.description().clone(),
        is_virtual: false,
    });
    let leader = Arc::new(Mutex::new(leader.unwrap()));
    let plan = Plan::of("slave", 1, steps);
    let scale = TimeScale::Factor(1.0);
    let session =
        recorded_runs::record_led_plan(rig, calibration, plan, scale, Arc::clone(&leader) as _);
    let deepest = deepest_followed(&session);
    assert!(deepest <= 4.0 + 1e-9, "{deepest}");
    assert_eq!(replay(&session, &[]).unwrap().first_difference, None);
    let slaved = leader.lock().unwrap().report();
    match early_end(&session) {
        None => Ok((slaved.unwrap(), session)),
        Some(why) => Err(why),
    }
}

#[test]
fn a_protocol_runs_over_a_pseudo_terminal_and_the_link_is_made_again() {
    if lacks_terminals() {
        return;
    }
    let _ = in_time(protocol_once);
}

/// Far longer than an attempt to reconnect lasts, in s.
const RETRY_S: f64 = 10.0;

/// One run of a protocol and its link, checked however it ended; an error says why it ended early.
fn protocol_once() -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    let port = folder.path().join("galil");
    let emulator = Emulator::at(&port).unwrap();
    let (rig, calibration) = bench(folder.path(), &port).unwrap();
    let plan = built_in_plan("check-home", &[]);
    let out = folder.path().join("session");
    let StartedRun { runner, woken, .. } =
        recorded_runs::start(rig, calibration, plan, TimeScale::Factor(1.0), &out);
    let has_ended = || {
        let snapshot = runner.snapshot();
        snapshot.run.as_ref().is_some_and(|run| run.outcome.is_some())
    };
    assert!(wait(&runner, &woken, has_ended), "the run does not end");

    let session = Session::open(&out).unwrap();
    let early_end = early_end(&session);
    let rig = session.manifest.rig.as_ref().unwrap();
    assert!(rig.identity.contains("watchdog"), "{}", rig.identity);
    // What was ended late may be short.
    if early_end.is_none() {
        assert!(session.rows.len() > 100, "{}", session.rows.len());
        assert!(session.auxiliary.raw_bytes > 1000);
    }
    // A sample is never younger than nothing, and its age is known to some ten milliseconds on any computer.
    let ages = session.rows.iter().map(|row| row.age);
    assert!(ages.clone().all(|age| age.is_some()), "an age is missing");
    assert!(ages.flatten().all(|age| age.within > Nanos::ZERO));
    assert!(session.rows.windows(2).all(|two| two[0].tick < two[1].tick));
    let report = replay(&session, &[]).unwrap();
    assert_eq!(report.first_difference, None);
    assert!(report.decisions > 10 || early_end.is_some(), "{report:?}");

    // The plug is pulled, and put back.
    drop(emulator);
    let is_lost = || runner.snapshot().rig.link_error.is_some();
    assert!(wait(&runner, &woken, is_lost), "the loss is not noticed");
    let _emulator = Emulator::at(&port).unwrap();
    runner.request(RunnerRequest::Reconnect).unwrap();
    let mut since = Stopwatch::start();
    let is_back = || {
        let rig = &runner.snapshot().rig;
        // A computer with much else to do may hear no answer in time: who reconnects tries again.
        if rig.link_error.is_some() && since.seconds() > RETRY_S {
            runner.request(RunnerRequest::Reconnect).unwrap();
            since = Stopwatch::start();
        }
        rig.link_error.is_none() && rig.reading.is_some() && !rig.is_homed
    };
    assert!(wait(&runner, &woken, is_back), "{:?}", runner.snapshot().rig.link_error);
    early_end.map_or(Ok(()), Err)
}
