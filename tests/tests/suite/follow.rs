//! A slave that goes where it is led, on the simulated rig: its bounds, its lag, its stops, and the whole with a master.
use palpate_analysis::fidelity::of_session;
use palpate_analysis::source::{RecordStretch, fit_samples};
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings};
use palpate_haptics::Period;
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_haptics::simulation::SimulationSettings;
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, Limits, Phase, Reading, RigCommand};
use palpate_model::signal::MovingMean;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds, Volts};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_protocols::engine::{EndingKind, EngineInput, Interlock, Operator, Record};
use palpate_protocols::plans::Follow;
use palpate_runner::haptics::slave::{SlaveLeader, SlaveReport, SlaveSettings};
use palpate_runner::replay::replay;
use palpate_runner::{LeadSource, SlaveSample, TimeScale};
use palpate_sessions::{EntryKind, Session};
use palpate_tests::lab::{Lab, LabSample};
use palpate_tests::recorded_runs;
use std::sync::{Arc, Mutex};

/// Way of a pulse of the simulated rig.
const PULSE: f64 = 0.015;

fn rig() -> SimRig {
    SimRig::new(SimSettings { profile: SimProfile::Ideal, seed: 3, ..SimSettings::default() })
}

fn follow(seconds: f64, speed: f64, depth_max: f64) -> Follow {
    Follow { duration: Seconds(seconds), speed: MmPerS(speed), depth_max: Depth(depth_max) }
}

/// A run that has come to the step that follows.
fn following(follow: Follow) -> Lab<SimRig> {
    let rig = rig();
    let curve = rig.calibration().curve().unwrap();
    let mut lab = Lab::new(rig, curve, follow.plan());
    lab.operator(Operator::Start);
    assert!(lab.run_until(Seconds(600.0), |state| state.phase() == Phase::Follow));
    assert_eq!(lab.state().holding(), None);
    lab
}

/// Leads every 5 ms to where a path says, in s since the call; ends where the step does or the run holds, or after `most` s.
fn lead(lab: &mut Lab<SimRig>, most: f64, path: impl Fn(f64) -> Option<f64>) {
    let begun = lab.now;
    let mut led = begun;
    let is_following = |lab: &Lab<SimRig>| {
        lab.state().phase() == Phase::Follow && lab.now.since(begun).seconds().0 < most
    };
    while is_following(lab) {
        lab.advance();
        if lab.now.since(led) >= Nanos::from_millis(5) {
            led = lab.now;
            if let Some(depth) = path(lab.now.since(begun).seconds().0) {
                let depth = Some(Depth(depth));
                lab.give(EngineInput::Lead { depth });
            }
        }
    }
}

/// The samples of the step that follows.
fn followed(lab: &Lab<SimRig>) -> Vec<LabSample> {
    let own = |seen: &&LabSample| seen.phase == Phase::Follow;
    lab.seen.iter().filter(own).copied().collect()
}

fn depth(lab: &Lab<SimRig>) -> f64 {
    lab.state().derived().depth.unwrap().0
}

fn is_at_rest(lab: &Lab<SimRig>) -> bool {
    !lab.seen.last().unwrap().reading.status.has(AxisStatus::MOVING)
}

fn moves(lab: &Lab<SimRig>, from: Nanos) -> Vec<(Nanos, f64)> {
    let of = |(at, command): &(Nanos, RigCommand)| match command {
        RigCommand::MoveTo(command) if *at >= from => Some((*at, command.speed.0)),
        _ => None,
    };
    lab.commands.iter().filter_map(of).collect()
}

#[test]
fn it_goes_where_it_is_led_and_never_deeper_or_faster_than_the_plan_says() {
    let mut lab = following(follow(20.0, 6.0, 8.0));
    let begun = lab.now;
    lead(&mut lab, 3.0, |_| Some(4.0));
    assert!((depth(&lab) - 4.0).abs() <= 0.5 * PULSE + 1e-9);
    // Deeper than it may, by a little and by far.
    for wanted in [8.004, 12.0, 1e9] {
        lead(&mut lab, 3.0, |_| Some(wanted));
        assert!((8.0 - PULSE..=8.0 + 1e-9).contains(&depth(&lab)), "{wanted}");
    }
    lead(&mut lab, 3.0, |_| Some(1.0));
    assert!((depth(&lab) - 1.0).abs() <= 0.5 * PULSE + 1e-9);
    // Home is the end of the way out.
    lead(&mut lab, 60.0, |_| Some(-1e9));
    let deepest =
        followed(&lab).iter().map(|seen| seen.derived.depth.unwrap().0).fold(0.0, f64::max);
    assert!(deepest <= 8.0 + 1e-9, "{deepest}");
    let sent = moves(&lab, begun);
    assert!(sent.len() >= 4 && sent.iter().all(|(_, speed)| *speed <= 6.0), "{sent:?}");
    let fastest =
        followed(&lab).iter().map(|seen| seen.derived.velocity.0.abs()).fold(0.0, f64::max);
    assert!(fastest > 5.9 && fastest <= 6.0 + 1e-9, "{fastest}");
    assert!(lab.run_until(Seconds(60.0), |_| false));
    assert_eq!(lab.outcome.unwrap().ending, EndingKind::Finish);
}

/// From rest to rest a move over `d` takes `2 sqrt(d / a)`, then the axis answers; a slave that goes on by moves of what
/// came meanwhile has `d = v T`, and on the mean over a move it is `v T` behind.
#[test]
fn on_a_ramp_it_is_behind_by_the_speed_times_the_duration_of_a_move() {
    for v in [1.0, 2.0] {
        let mut lab = following(follow(7.0, 9.0, 30.0));
        let begun = lab.now;
        lead(&mut lab, 60.0, |t| Some(v * t));
        // Once it goes on steadily, and before the end.
        let late = begun + Nanos::from_millis(3000);
        let sent = moves(&lab, late);
        let steady: Vec<&(Nanos, f64)> =
            sent.iter().take_while(|(at, _)| at.since(begun).seconds().0 < 6.8).collect();
        let span = steady[steady.len() - 1].0.since(steady[0].0).seconds().0;
        let apart = span / (steady.len() - 1) as f64;
        // The answer is 2 to 4 ms; a lead comes every 5 ms.
        let acceleration = 61.44;
        let of_answer = |answer: f64| {
            // T = 2 sqrt(v T / a) + answer.
            let root = (v / acceleration).sqrt();
            (root + (root * root + answer).sqrt()).powi(2)
        };
        assert!(
            (of_answer(0.001)..of_answer(0.008)).contains(&apart),
            "{v}: {apart} {}",
            of_answer(0.0)
        );
        let (mut sum, mut count) = (0.0, 0_u32);
        let tick = lab.state().config().rig.tick().0;
        let first = followed(&lab)[0].reading.tick;
        for seen in followed(&lab) {
            let t = (seen.reading.tick - first) as f64 * tick;
            // Whole moves only.
            let from = steady[0].0.since(begun).seconds().0;
            if (from..from + span).contains(&t) {
                sum += v * t - seen.derived.depth.unwrap().0;
                count += 1;
            }
        }
        let lag = sum / f64::from(count);
        // A lead is 2.5 ms old on the mean when the axis takes it, and its target up to half a pulse off.
        assert!((lag - v * apart).abs() < v * 0.008 + 0.5 * PULSE, "{v}: {lag} {apart}");
    }
}

#[test]
fn a_lead_that_stops_coming_stops_the_slave_and_then_leaves_the_tissue() {
    let mut lab = following(follow(60.0, 3.0, 30.0));
    lead(&mut lab, 1.0, |_| Some(20.0));
    let silent = lab.now;
    assert!(!is_at_rest(&lab));
    lead(&mut lab, 0.49, |_| None);
    assert!(!is_at_rest(&lab));
    // 3 mm/s brake within 0.05 s.
    lead(&mut lab, 0.07, |_| None);
    assert!(is_at_rest(&lab));
    let stopped = depth(&lab);
    assert!(stopped > 2.0 && stopped < 6.0, "{stopped}");
    lead(&mut lab, 1.0, |_| None);
    assert_eq!(depth(&lab), stopped);
    // A lead that comes again is followed again.
    lead(&mut lab, 1.0, |_| Some(stopped + 1.0));
    assert!((depth(&lab) - stopped - 1.0).abs() <= PULSE);
    let again = lab.now;
    lead(&mut lab, 60.0, |_| None);
    let left = lab.now.since(again).seconds().0;
    assert!((4.9..5.1).contains(&left), "{left}");
    assert_eq!(lab.state().phase(), Phase::Retract);
    let lost =
        |(at, record): &&(Nanos, Record)| matches!(record, Record::LeadLost { .. }) && *at > silent;
    assert_eq!(lab.records.iter().filter(lost).count(), 2);
    assert!(lab.run_until(Seconds(60.0), |_| false));
    assert_eq!(lab.outcome.as_ref().unwrap().ending, EndingKind::Finish);
    assert!(depth(&lab) < -5.0);
}

#[test]
fn a_lead_that_is_no_number_is_refused_once_and_is_no_lead() {
    let mut lab = following(follow(60.0, 3.0, 30.0));
    lead(&mut lab, 2.0, |_| Some(1.0));
    let before = lab.records.len();
    for depth in [None, Some(Depth(f64::NAN)), Some(Depth(f64::INFINITY)), None] {
        lab.give(EngineInput::Lead { depth });
    }
    let count_notes = |lab: &Lab<SimRig>| {
        let own = lab.records[before..].iter();
        own.filter(|(_, record)| matches!(record, Record::Refused { .. })).count()
    };
    assert_eq!(count_notes(&lab), 1);
    let at = lab.now;
    lead(&mut lab, 0.4, |_| Some(f64::NAN));
    assert_eq!(moves(&lab, at), []);
    assert!((depth(&lab) - 1.0).abs() <= PULSE);
    // Nothing but such leads is silence.
    lead(&mut lab, 60.0, |_| Some(f64::NAN));
    assert!((4.9..5.2).contains(&lab.now.since(at).seconds().0));
    assert_eq!(count_notes(&lab), 1);
}

#[test]
fn the_operator_and_every_interlock_end_it_as_any_step() {
    let led = || {
        let mut lab = following(follow(60.0, 3.0, 30.0));
        lead(&mut lab, 1.0, |_| Some(20.0));
        assert!(!is_at_rest(&lab));
        lab
    };
    // After each of these, leads move nothing.
    let check = |lab: &mut Lab<SimRig>, expected: EndingKind| {
        let at = lab.now + Nanos(1);
        for _ in 0..2000 {
            lab.advance();
            let depth = Some(Depth(25.0));
            lab.give(EngineInput::Lead { depth });
        }
        assert_eq!(lab.state().holding().unwrap().ending, expected);
        assert!(is_at_rest(lab));
        assert_eq!(moves(lab, at), []);
    };
    for (choice, ending) in [
        (Operator::Stop, EndingKind::Stop),
        (Operator::Abort, EndingKind::Abort),
        (Operator::Halt, EndingKind::Halt),
    ] {
        let mut lab = led();
        lab.operator(choice);
        check(&mut lab, ending);
    }
    type Change = fn(&mut Reading);
    let changes: [(Interlock, Change); 7] = [
        (Interlock::Signal, |one| one.volts = Volts(f64::NAN)),
        (Interlock::Travel, |one| one.status = one.status | AxisStatus::FORWARD_LIMIT),
        (Interlock::Force, |one| one.volts = Volts(1e3)),
        (Interlock::Motor, |one| one.status = AxisStatus::MOVING),
        (Interlock::Path, |one| one.pulses += 100),
        (Interlock::Link, |one| one.tick = 0),
        (Interlock::SampleAge, |_| ()),
    ];
    for (interlock, change) in changes {
        let mut lab = led();
        let mut reading = lab.seen.last().unwrap().reading;
        reading.tick += 1;
        change(&mut reading);
        if interlock == Interlock::SampleAge {
            lab.now = lab.now + Nanos::from_millis(100);
        }
        lab.give(EngineInput::Reading(reading));
        let tripped = |(_, record): &(Nanos, Record)| matches!(record, Record::InterlockTripped { interlock: found, .. } if *found == interlock);
        assert!(lab.records.iter().any(tripped), "{interlock}");
        assert_eq!(lab.commands.last().unwrap().1, RigCommand::Stop);
    }
    let mut lab = led();
    let detail = "full".into();
    lab.give(EngineInput::Fault(Fault::LogFailed { detail }));
    check(&mut lab, EndingKind::Abort);
    // By the tissue itself: a force that the slave is led into.
    let mut lab = following(follow(60.0, 3.0, 60.0));
    lead(&mut lab, 60.0, |_| Some(60.0));
    let tripped = lab.records.iter().any(|(_, record)| {
        matches!(record, Record::InterlockTripped { interlock: Interlock::Force, .. })
    });
    assert!(tripped, "{:?}", lab.records.last());
    check(&mut lab, EndingKind::Interlock);
}

#[test]
fn paused_it_rests_whatever_leads_and_resumed_it_follows_again() {
    let mut lab = following(follow(60.0, 3.0, 30.0));
    lead(&mut lab, 1.0, |_| Some(20.0));
    lab.operator(Operator::Pause);
    assert_eq!(lab.state().phase(), Phase::Paused);
    let at = lab.now;
    for _ in 0..3000 {
        lab.advance();
        let depth = Some(Depth(25.0));
        lab.give(EngineInput::Lead { depth });
    }
    assert!(is_at_rest(&lab));
    assert_eq!(moves(&lab, at), []);
    lab.operator(Operator::Resume);
    assert_eq!(lab.state().phase(), Phase::Follow);
    lead(&mut lab, 3.0, |_| Some(5.0));
    assert!((depth(&lab) - 5.0).abs() <= PULSE);
}

/// A slave led by a simulated master whose hand goes on a path.
fn slaved(path: HandPath, follow: Follow) -> (Session, SlaveReport) {
    let rig = rig();
    let hand = SimulatedHand::firm(path);
    let body = rig.truth().body;
    let leader = SlaveLeader::new(SlaveSettings {
        master: SimulationSettings::of(body, Period::MILLISECOND, hand),
        body,
        depth_max: follow.depth_max,
        rig: rig.description().clone(),
        is_virtual: true,
    });
    let leader = Arc::new(Mutex::new(leader.unwrap()));
    let calibration = rig.calibration();
    let led = recorded_runs::record_led_plan(
        Box::new(rig),
        calibration,
        follow.plan(),
        TimeScale::Max,
        Arc::clone(&leader) as _,
    );
    let slaved = leader.lock().unwrap().report().unwrap();
    (led, slaved)
}

#[test]
fn a_slave_led_by_a_master_measures_the_specimen_and_replays_to_the_bit() {
    let path = HandPath::Sine { middle: 5.0, amplitude: 5.0, hz: 0.1 };
    let (session, summary) = slaved(path, follow(20.0, 9.0, 8.0));
    assert_eq!(session.end.as_ref().unwrap().outcome, "finish");
    // The closed force of the specimen under the depth that the slave had.
    let body: ModifiedKelvin = rig().truth().body;
    let tick = session.manifest.tick().0;
    let rows: Vec<_> = session.rows.iter().filter(|row| row.phase == Phase::Follow).collect();
    let mut state = KelvinState::at_rest();
    let mut means = [(); 2].map(|()| MovingMean::new(50));
    let (mut worst, mut most, mut before) = (0.0_f64, 0.0_f64, rows[0].tick);
    for (index, row) in rows.iter().enumerate() {
        let passed = Seconds((row.tick - before) as f64 * tick);
        before = row.tick;
        let pressed = Depth(row.depth.unwrap().max(0.0));
        let force = state.step(&body, pressed, passed).0.max(0.0);
        let [closed, cell] = [force, row.force.unwrap()];
        let [closed, cell] = [means[0].push(closed), means[1].push(cell)];
        most = most.max(closed);
        if index > 50 {
            worst = worst.max((closed - cell).abs());
        }
    }
    // 20 mN of noise are 3 mN in a mean of 50, and 0.02 mm of contact are as much.
    assert!(most > 0.3 && worst < 0.025, "{most} {worst}");
    // The summary is the same.
    assert!((summary.model_max_n - most).abs() < 1e-9, "{summary:?}");
    assert!(
        summary.model_less_cell.worst_n < 0.025 && summary.model_less_cell.rms_n < 0.01,
        "{summary:?}"
    );
    // The handle feels more than the cell: its place is ahead.
    assert!(summary.handle_less_cell.worst_n > summary.model_less_cell.worst_n);
    assert!(summary.depth_max_mm <= 8.0 + 1e-9);
    assert_eq!(summary.contact_changes, 4, "{summary:?}");
    let lag = summary.lag_ms.unwrap();
    assert!(lag.median > 50.0 && lag.median < 400.0, "{summary:?}");
    assert!(
        summary.damping_through_slave.unwrap() > 4.0 * summary.damping_needed.max(1.0),
        "{summary:?}"
    );
    // Leads are inputs like any other.
    let leads = session
        .entries
        .iter()
        .filter(|entry| entry.kind == EntryKind::Input && entry.body["input"] == "lead");
    assert!((3500..4001).contains(&leads.count()));
    let report = replay(&session, &[]).unwrap();
    assert_eq!(report.first_difference, None);
    assert_eq!(report.force_difference_n, 0.0);
    let (again, same) = slaved(path, follow(20.0, 9.0, 8.0));
    assert_eq!(again.rows, session.rows);
    assert_eq!(same, summary);
    // A fit takes the first way in: the hand is back at 8 mm after 6.5 s, its slave soon after.
    let fitted = fit_samples(&session, RecordStretch::default()).unwrap();
    let measured = fitted.iter().filter(|one| one.is_measured());
    let last = measured.map(|one| one.t.0).fold(0.0, f64::max);
    assert!((6.4..7.5).contains(&last), "{last}");
    // A lead that differs is another run.
    let mut other = session;
    let lead = other.entries.iter_mut().rfind(|entry| {
        entry.body["input"] == "lead"
            && entry.body["depth"].as_f64().is_some_and(|depth| depth > 3.0)
    });
    lead.unwrap().body["depth"] = serde_json::json!(null);
    for entry in &mut other.entries {
        if entry.body["input"] == "lead"
            && entry.body["depth"].as_f64().is_some_and(|depth| depth > 3.0)
        {
            entry.body["depth"] = serde_json::json!(3.0);
        }
    }
    assert!(replay(&other, &[]).unwrap().first_difference.is_some());
}

/// Leads nowhere but says so, and then no more.
#[derive(Debug)]
struct Broken(u32);

impl LeadSource for Broken {
    fn lead(&mut self, felt: &SlaveSample) -> Option<f64> {
        assert!(felt.sigma > Newtons(0.0));
        self.0 += 1;
        match self.0 {
            ..100 => Some(2.0),
            100..200 => Some(f64::NAN),
            _ => None,
        }
    }
}

#[test]
fn what_leads_may_fail_and_the_session_says_so() {
    let rig = rig();
    let calibration = rig.calibration();
    let leader = Arc::new(Mutex::new(Broken(0)));
    let plan = follow(60.0, 6.0, 8.0).plan();
    let session =
        recorded_runs::record_led_plan(Box::new(rig), calibration, plan, TimeScale::Max, leader);
    let end = session.end.as_ref().unwrap();
    assert_eq!(end.outcome, "finish");
    let records =
        |name: &str| session.entries.iter().filter(|entry| entry.body["record"] == name).count();
    assert_eq!((records("lead_lost"), records("refused")), (1, 1));
    let remarks = of_session(&session).unwrap().remarks;
    assert!(
        remarks.iter().any(|remark| remark.contains("the master has sent no position")),
        "{remarks:?}"
    );
    let followed = session.rows.iter().filter(|row| row.phase == Phase::Follow).count();
    assert!((5050..5200).contains(&followed), "{followed}");
    assert_eq!(replay(&session, &[]).unwrap().first_difference, None);
}

#[test]
fn limits_of_the_rig_stand_before_the_plan() {
    // The travel ends in the tissue: it goes there and no further, and no interlock trips.
    let rig = rig();
    let limits = Limits::for_travel(palpate_model::units::Position(55.0));
    let curve = rig.calibration().curve().unwrap();
    let surface = rig.truth().surface_counted().0;
    let mut lab = Lab::new(rig, curve, follow(10.0, 6.0, 90.0).plan()).within(limits);
    lab.operator(Operator::Start);
    assert!(lab.run_until(Seconds(600.0), |state| state.phase() == Phase::Follow), "{surface}");
    lead(&mut lab, 60.0, |_| Some(90.0));
    let position = lab.seen.iter().map(|seen| seen.derived.position.0).fold(0.0, f64::max);
    assert!(position <= 55.0 + 1e-9, "{position}");
}
