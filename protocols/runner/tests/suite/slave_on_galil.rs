//! A slave on a controller that takes targets on the way: its lag, its bounds and its stops, in simulated time.

use crate::galil_rig::GalilRig;
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_haptics::Period;
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_haptics::simulation::SimulationSettings;
use palpate_model::metadata::SessionLabels;
use palpate_model::rig::{AxisStatus, Limits, Phase};
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_protocols::engine::Operator;
use palpate_protocols::plans::{FindContact, Follow, LEAVE_TISSUE, Plan, Step, approach_steps};
use palpate_runner::haptics::slave::{SlaveLeader, SlaveSettings};
use palpate_runner::replay::replay;
use palpate_runner::{
    AfterStop, LeadSource, PromptResponder, RunRequest, SharedLeadSource, SlaveSample, StartError,
    StartedRun, TimeScale,
};
use palpate_sessions::{SampleRow, Session};
use palpate_test_support::wait::PATIENCE;
use std::fmt;
use std::path::Path;
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex};

/// Way of a pulse in mm.
const PULSE: f64 = 0.015;

fn follow(seconds: f64, speed: f64, depth_max: f64) -> Follow {
    Follow { duration: Seconds(seconds), speed: MmPerS(speed), depth_max: Depth(depth_max) }
}

/// As quickly as contact is found at all: how well is not the question here.
fn plan(follow: Follow) -> Plan {
    let contact = FindContact {
        approach_speed: MmPerS(6.0),
        retreat_mm: 1.0,
        pass_speed: MmPerS(0.6),
        recovery: Seconds(0.5),
        std_error_mm_max: 1.0,
        press: None,
        ..FindContact::default()
    };
    let mut steps = approach_steps(Seconds(1.0), contact);
    steps.extend([Step::Follow(follow), LEAVE_TISSUE]);
    Plan::of("slave", 1, steps)
}

fn begin(
    rig: GalilRig,
    plan: Plan,
    leader: Option<SharedLeadSource>,
    out: &Path,
) -> Result<StartedRun, StartError> {
    let request = RunRequest {
        plan,
        calibration: SimRig::new(SimSettings::default()).calibration(),
        limits: Limits::for_travel(rig.description().travel),
        out: Some(out.to_owned()),
        labels: SessionLabels::default(),
        is_acknowledged: true,
        to_acknowledge: Vec::new(),
        after_stop: AfterStop::Close,
        answers: PromptResponder::Confirm,
        leader,
    };
    let started = StartedRun::start(Box::new(rig), TimeScale::Max, request)?;
    started.wait_for_start()?;
    Ok(started)
}

fn wait_for_end(StartedRun { runner, woken, .. }: &StartedRun) {
    let has_ended = || {
        let snapshot = runner.snapshot();
        snapshot.run.as_ref().is_some_and(|run| run.outcome.is_some())
    };
    while !has_ended() {
        woken.recv_timeout(PATIENCE).expect("the run ends");
    }
}

fn recorded(follow: Follow, leader: SharedLeadSource) -> Session {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("session");
    wait_for_end(&begin(GalilRig::new(), plan(follow), Some(leader), &out).unwrap());
    Session::open(&out).unwrap()
}

/// Leads to where a path says, in s since its first sample.
struct PathLead<F>(F, Option<f64>);

impl<F> fmt::Debug for PathLead<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("PathLead")
    }
}

impl<F: FnMut(f64) -> Option<f64> + Send> LeadSource for PathLead<F> {
    fn lead(&mut self, sample: &SlaveSample) -> Option<f64> {
        let at = 1e-9 * sample.at.0 as f64;
        let begun = *self.1.get_or_insert(at);
        (self.0)(at - begun)
    }
}

fn along(path: impl FnMut(f64) -> Option<f64> + Send + 'static) -> SharedLeadSource {
    Arc::new(Mutex::new(PathLead(path, None)))
}

/// Time in s since the first sample that follows, and the depth.
fn followed(session: &Session) -> Vec<(f64, f64)> {
    let tick = session.manifest.tick().0;
    let rows: Vec<&SampleRow> =
        session.rows.iter().filter(|row| row.phase == Phase::Follow).collect();
    let first = rows[0].tick;
    rows.iter().map(|row| ((row.tick - first) as f64 * tick, row.depth.unwrap())).collect()
}

fn commands(session: &Session, name: &str) -> usize {
    session.entries.iter().filter(|entry| entry.body["command"] == name).count()
}

fn check_end(session: &Session, outcome: &str) {
    let end = session.end.as_ref().unwrap();
    assert_eq!(end.outcome, outcome, "{}", end.reason);
    assert_eq!(replay(session, &[]).unwrap().first_difference, None);
}

/// The hand of the guide: 10 mm at up to 2 mm/s for 30 s. A slave that goes at v and can brake at a from v to its target is
/// `v^2 / (2 a)` behind it, `v / (2 a)` in time: 16 ms at 2 mm/s and 61.44 mm/s^2. It is sent ahead by so much, and what is
/// left is the age of a lead, 5 ms at most, the command, the filter of the pulses, and a whole pulse.
#[test]
fn slave_of_the_guide_is_no_further_from_its_master_than_30_ms_at_full_speed() {
    let rig = GalilRig::new();
    let description = rig.description().clone();
    assert!(description.takes_targets);
    let body = ModifiedKelvin::THESIS;
    let depth_max = Depth(10.0);
    let follow = Follow::of_hand(&description, MmPerS(2.0), depth_max, Seconds(30.0));
    let hz = 2.0 / (std::f64::consts::TAU * 5.0);
    let hand = SimulatedHand::firm(HandPath::Sine { middle: 5.0, amplitude: 5.0, hz });
    let leader = SlaveLeader::new(SlaveSettings {
        master: SimulationSettings::of(body, Period::MILLISECOND, hand),
        body,
        depth_max,
        rig: description,
        is_virtual: true,
    });
    let leader = Arc::new(Mutex::new(leader.unwrap()));
    let session = recorded(follow, Arc::clone(&leader) as _);
    check_end(&session, "finish");
    let report = leader.lock().unwrap().report().unwrap();
    println!("{report:?}");
    // At a turn the hand accelerates by v^2 over its amplitude of 5 mm: a pulse from there takes it sqrt(2 pulse / 0.8 mm/s^2).
    let turn_ms = 1e3 * (2.0 * PULSE / 0.8).sqrt();
    let lag = report.lag_ms.unwrap();
    assert!(lag.median < 30.0 && lag.worst < turn_ms, "{report:?}");
    // In mm, ahead or behind, wherever it is: 30 ms at the 2 mm/s of the hand.
    assert!(report.lag_mm.median < 0.03 && report.lag_mm.worst < 0.06, "{report:?}");
    // It went to where the tissue let the hand go, and more than a target in ten milliseconds came.
    assert!(report.depth_max_mm > 7.0 && report.depth_max_mm <= 10.0, "{report:?}");
    // In 30 s the master passes 2500 pulses: there is a target for most of them.
    assert!(commands(&session, "track") > 2000, "{}", commands(&session, "track"));
}

#[test]
fn lead_that_jumps_moves_the_slave_no_faster_and_no_deeper_than_planned() {
    // Jumps far and near, and back and forth on the way.
    let leader = along(|t| {
        let wanted = match t {
            ..2.0 => 20.0,
            2.0..4.0 => -1e9,
            4.0..5.0 => 1e9,
            _ => [1.0, 6.0][(t / 0.013) as usize % 2],
        };
        Some(wanted)
    });
    let session = recorded(follow(8.0, 6.0, 4.0), leader);
    check_end(&session, "finish");
    let places = followed(&session);
    let deepest = places.iter().map(|(_, depth)| *depth).fold(0.0, f64::max);
    assert!((4.0 - PULSE..=4.0 + 1e-9).contains(&deepest), "{deepest}");
    for pair in places.windows(2) {
        let [(before, from), (at, to)] = [pair[0], pair[1]];
        // Two samples of the controller between pulses and clock, and a pulse.
        let way = 6.0 * (at - before + 0.002) + PULSE;
        assert!((to - from).abs() <= way + 1e-9, "{pair:?}");
    }
}

#[test]
fn lead_that_is_lost_stops_the_slave_on_the_way_and_is_followed_again() {
    let leader = along(|t| match t {
        ..1.0 => Some(3.0 * t),
        1.0..3.0 => None,
        3.0..4.0 => Some(1.0),
        _ => None,
    });
    let session = recorded(follow(60.0, 0.6, 8.0), leader);
    check_end(&session, "finish");
    let places = followed(&session);
    let at = |secs: f64| places.iter().find(|(t, _)| *t >= secs).unwrap().1;
    // 0.6 mm/s until half a second after the last lead.
    assert!((at(2.0) - 0.6 * 1.5).abs() < 0.03, "{}", at(2.0));
    assert_eq!(at(2.0), at(2.9));
    assert!((at(3.9) - 1.0).abs() <= PULSE, "{}", at(3.9));
    // Five seconds without a lead end the step.
    let end = places[places.len() - 1].0;
    assert!((8.9..9.2).contains(&end), "{end}");
    let lost = session.entries.iter().filter(|entry| entry.body["record"] == "lead_lost");
    assert_eq!(lost.count(), 2);
    // Once each time.
    assert!(commands(&session, "stop") >= 2);
}

/// A lead without end, and what says that the slave follows it.
fn led_for_ever() -> (SharedLeadSource, Receiver<()>) {
    let (sender, moving) = sync_channel(1);
    let leader = along(move |t| {
        if t > 0.5 {
            let _ = sender.try_send(());
        }
        Some(2.0 - 2.0 * (3.0 * t).cos())
    });
    (leader, moving)
}

#[test]
fn operator_stops_a_slave_on_the_way_and_no_target_follows() {
    for (choice, outcome) in
        [(Operator::Stop, "stop"), (Operator::Abort, "abort"), (Operator::Halt, "halt")]
    {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("session");
        let (leader, moving) = led_for_ever();
        let run = begin(GalilRig::new(), plan(follow(3600.0, 12.0, 8.0)), Some(leader), &out);
        let run = run.unwrap();
        moving.recv_timeout(PATIENCE).unwrap();
        run.runner.send_choice(choice).unwrap();
        wait_for_end(&run);
        let session = Session::open(&out).unwrap();
        check_end(&session, outcome);
        let last = |name: &str| session.entries.iter().rposition(|one| one.body["command"] == name);
        let stop = last(if choice == Operator::Halt { "halt" } else { "stop" });
        assert!(last("track") < stop, "{choice:?}");
        let end = session.rows.last().unwrap();
        assert!(!AxisStatus(end.status).has(AxisStatus::MOVING), "{choice:?}");
    }
}

#[test]
fn force_limit_ends_a_slave_on_the_way() {
    let session = recorded(follow(60.0, 6.0, 60.0), along(|t| Some(6.0 * t)));
    let end = session.end.as_ref().unwrap();
    assert_eq!(end.outcome, "interlock", "{}", end.reason);
    assert!(end.reason.contains("force"), "{}", end.reason);
    assert_eq!(replay(&session, &[]).unwrap().first_difference, None);
}

#[test]
fn plan_that_follows_is_refused_without_a_master() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("session");
    let refused = begin(GalilRig::new(), plan(follow(1.0, 6.0, 4.0)), None, &out);
    let Err(StartError::Refused(reason)) = refused else {
        panic!("it starts");
    };
    assert!(reason.contains("palpate haptics slave"), "{reason}");
    // Nothing was created.
    assert!(!out.exists());
}
