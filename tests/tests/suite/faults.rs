//! Whatever fails, the run ends with its reason, the axis stopped and the session closed.

use palpate_doubles::{FaultKind, FaultyRig, Rail, ScriptedFault};
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Phase};
use palpate_model::units::{Depth, MmPerS, Seconds, Volts};
use palpate_protocols::plans::RampHold;
use palpate_runner::replay::replay;
use palpate_runner::{Runner, StartedRun, TimeScale};
use palpate_sessions::Session;
use palpate_test_support::wait::PATIENCE;
use palpate_tests::recorded_runs;

fn params() -> RampHold {
    RampHold { speed: MmPerS(3.0), depth: Depth(12.0), hold: Seconds(2.0), ..RampHold::default() }
}

/// Runs with one scripted fault and returns the session.
fn run_with(kind: FaultKind, at: Nanos) -> Session {
    let rig = SimRig::new(SimSettings::default());
    let calibration = rig.calibration();
    let faulty = FaultyRig::new(rig, vec![ScriptedFault::from(at, kind)], 5);
    recorded_runs::record_ramp_hold(Box::new(faulty), calibration, params())
}

/// Half a minute into the run the probe is in the contact search, most of the time moving.
const MID_RUN: Nanos = Nanos::from_millis(30_000);

#[test]
fn every_fault_ends_the_run_with_its_reason_and_replays() {
    for (kind, ending, word) in [
        (FaultKind::Silent, "interlock", "no sample"),
        (FaultKind::Late(Nanos::from_millis(400)), "interlock", "no sample"),
        (FaultKind::NotANumber, "interlock", "not a number"),
        (FaultKind::Saturated(Rail::High), "interlock", ""),
        (FaultKind::Saturated(Rail::Low), "interlock", "tension"),
        (FaultKind::Stuck, "interlock", "has not changed"),
        (FaultKind::Disconnect, "interlock", "link"),
        (FaultKind::Reset, "interlock", "restarted"),
        (FaultKind::UnannouncedReset, "interlock", "restarted"),
        (FaultKind::LostSteps(4), "interlock", "path"),
        (FaultKind::SignalJump(Volts(1.0)), "interlock", "force"),
        (FaultKind::RefuseCommands, "abort", "refused"),
    ] {
        let name = format!("{kind:?}");
        let session = run_with(kind, MID_RUN);
        let end = session.end.as_ref().unwrap_or_else(|| panic!("{name}: no end record"));
        assert_eq!(end.outcome, ending, "{name}: {}", end.reason);
        assert!(end.reason.contains(word), "{name}: {}", end.reason);
        let report = replay(&session, &[]).unwrap();
        assert_eq!(report.first_difference, None, "{name}");
        if let Some(last) = session.rows.last() {
            let is_moving = AxisStatus(last.status).has(AxisStatus::MOVING);
            let is_seen =
                !matches!(name.as_str(), "Silent" | "Disconnect" | "NotANumber" | "RefuseCommands");
            assert!(!is_moving || !is_seen, "{name}: still moving at the last sample");
        }
    }
}

#[test]
fn a_noisy_cell_is_refused_before_anything_moves() {
    let session = run_with(FaultKind::Noisy(Volts(0.02)), Nanos::ZERO);
    let end = session.end.unwrap();
    assert_eq!(end.outcome, "abort");
    assert!(end.reason.contains("noise"), "{}", end.reason);
    assert!(session.rows.iter().all(|row| !AxisStatus(row.status).has(AxisStatus::MOVING)));
}

#[test]
fn who_watches_a_run_may_panic_and_the_axis_stops_and_the_session_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("session");
    let place = out.clone();
    // The window draws on a thread of its own, which also owns the runner.
    let watcher = std::thread::Builder::new()
        .name("watcher".into())
        .spawn(move || {
            let rig = SimRig::new(SimSettings::default());
            // The hold outlasts the report of the panic, however long that takes to write.
            let plan = RampHold { hold: Seconds(3600.0), ..params() }.plan();
            let calibration = rig.calibration();
            let scale = TimeScale::Factor(50.0);
            let StartedRun { runner, woken, .. } =
                recorded_runs::start(Box::new(rig), calibration, plan, scale, &place);
            let is_pressing = |runner: &Runner| {
                let snapshot = runner.snapshot();
                let run = snapshot.run.as_ref();
                run.is_some_and(|run| run.phase == Phase::Ramp)
            };
            while !is_pressing(&runner) {
                woken.recv_timeout(PATIENCE).unwrap();
            }
            panic!("as if drawing had failed");
        })
        .unwrap();
    assert!(watcher.join().is_err());
    let session = Session::open(&out).unwrap();
    assert_eq!(session.rows.last().map(|row| row.phase), Some(Phase::Stopped));
    let last = session.rows.last().unwrap();
    assert!(!AxisStatus(last.status).has(AxisStatus::MOVING));
    let end = session.end.as_ref().expect("the session is closed");
    assert_eq!(end.outcome, "stop", "{}", end.reason);
    assert_eq!(replay(&session, &[]).unwrap().first_difference, None);
}
