//! Random plans, faults and operators: however a run goes, it ends with the axis stopped, its limits kept but for
//! the way of the brake, and a reason. A few hundred here; `scripts/soak runs` for a hundred thousand.
use palpate_doubles::{FaultKind, FaultyRig, Rail, ScriptedFault};
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings, SimTruth};
use palpate_model::Nanos;
use palpate_model::random::SplitMix;
use palpate_model::rig::{HandAction, Limits, RigCommand};
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds, Volts};
use palpate_protocols::engine::{EndingKind, EngineInput, Operator};
use palpate_protocols::plans::{
    CheckHome, ContactPress, FindBase, FindContact, Follow, Hold, HoldForce, HoldRate, HoldUntil,
    Home, Jog, LoadTo, Monitor, MonitorAction, MonitorSource, OnFailure, OnTimeout, Plan,
    PlannedStep, Prompt, Ramp, Rest, Retract, SelfTest, SettleLimits, Sine, Step, Tare,
    ThresholdSide, Unload, Weigh,
};
use palpate_runner::StartError;
use palpate_runner::replay::replay;
use palpate_tests::lab::Lab;
use palpate_tests::recorded_runs;
use std::collections::VecDeque;

/// Runs in the test suite: about ten seconds.
const RUNS: u64 = 300;

fn share(random: &mut SplitMix) -> f64 {
    random.below(1 << 20) as f64 / f64::from(1 << 20)
}

fn between(random: &mut SplitMix, low: f64, high: f64) -> f64 {
    low + (high - low) * share(random)
}

/// A speed the rig can make.
fn speed(random: &mut SplitMix, most: f64) -> MmPerS {
    MmPerS(((between(random, 0.3, most) / 0.03).round()) * 0.03)
}

fn any_step(random: &mut SplitMix) -> Step {
    match random.below(16) {
        0 => {
            Step::Jog(Jog { distance_mm: between(random, -30.0, 30.0), speed: speed(random, 20.0) })
        }
        1 => Step::Rest(Rest { duration: Seconds(between(random, 0.0, 0.5)) }),
        2 => Step::Prompt(Prompt {
            message: "do something".into(),
            timeout: Seconds(between(random, 0.0, 1.0)),
            on_timeout: [OnTimeout::Stop, OnTimeout::Continue][random.below(2)],
            hand: [
                None,
                Some(HandAction::Unmount),
                Some(HandAction::Mount { specimen: 5 }),
                Some(HandAction::LoadCell { mass_g: 240.0 }),
            ][random.below(4)],
        }),
        3 => Step::Weigh(Weigh {
            mass_g: 0.0,
            is_loading: true,
            repeat: 1,
            settle: SettleLimits { window: Seconds(0.1), timeout: Seconds(0.5) },
        }),
        4 => Step::CheckHome(CheckHome { speed: MmPerS(9.0), touch_speed: MmPerS(0.9) }),
        5 | 6 => Step::Ramp(Ramp {
            speed: speed(random, 20.0),
            depth: Depth(between(random, 0.5, 30.0)),
        }),
        7 => Step::Hold(Hold {
            duration: Seconds(between(random, 0.0, 1.0)),
            until: Some(HoldUntil::parse("tau=50%").unwrap()),
            rate: Some(HoldRate { below_n_per_s: 1.0, over: Seconds(0.3) }),
        }),
        8 => Step::Unload(Unload {
            speed: speed(random, 10.0),
            clearance_mm: between(random, 0.0, 2.0),
        }),
        9 | 10 => Step::LoadTo(LoadTo {
            speed: speed(random, 10.0),
            force: Newtons(between(random, 0.2, 3.0)),
            depth_max: Depth(between(random, 5.0, 40.0)),
            brake: [None, Some(Newtons(0.1))][random.below(2)],
        }),
        11 => Step::HoldForce(HoldForce {
            force: Newtons(between(random, 0.2, 2.0)),
            duration: Seconds(1.0),
            speed: MmPerS(3.0),
            depth_max: Depth(40.0),
        }),
        // Whatever lies before the probe, tissue or base, it is felt for slowly and at the slowest speed of the rig.
        13 => Step::FindBase(FindBase::default()),
        12 => Step::Sine(Sine {
            amplitude_mm: between(random, 0.1, 5.0),
            frequency_hz: between(random, 0.2, 5.0),
            cycles: 2,
        }),
        14 => Step::Follow(Follow {
            duration: Seconds(between(random, 0.5, 5.0)),
            speed: speed(random, 20.0),
            depth_max: Depth(between(random, 0.5, 40.0)),
        }),
        _ => Step::Retract(Retract {
            speed: speed(random, 20.0),
            clearance_mm: between(random, 0.0, 10.0),
        }),
    }
}

fn any_plan(random: &mut SplitMix) -> Plan {
    let mut steps = vec![
        Step::SelfTest(SelfTest { duration: Seconds(0.1) }),
        Step::Home(Home { speed: MmPerS(9.0), touch_speed: MmPerS(0.9) }),
        Step::Tare(Tare { duration: Seconds(0.1) }),
    ];
    if random.below(4) > 0 {
        let short = FindContact { recovery: Seconds(0.3), ..FindContact::default() };
        steps.push(Step::FindContact(match random.below(3) {
            0 => FindContact {
                press: short.press.map(|press| ContactPress { dwell: Seconds(0.5), ..press }),
                ..short
            },
            _ => FindContact {
                approach_speed: MmPerS(6.0),
                retreat_mm: 1.0,
                pass_speed: MmPerS(0.6),
                // At this speed a press would overshoot what contact finding may exert.
                press: None,
                ..short
            },
        }));
    }
    let count = 1 + random.below(5);
    steps.extend((0..count).map(|_| any_step(random)));
    let mut plan = Plan::of("random", 1, steps);
    for planned in &mut plan.steps {
        let on_failure = [OnFailure::Abort, OnFailure::Retry(2), OnFailure::Skip][random.below(3)];
        *planned = PlannedStep { cycle: random.below(3) as u32, on_failure, ..planned.clone() };
    }
    let actions = [
        MonitorAction::Note,
        MonitorAction::Pause,
        MonitorAction::Stop,
        MonitorAction::Retract,
        MonitorAction::Halt,
    ];
    plan.monitors = (0..random.below(3))
        .map(|_| {
            let threshold = between(random, 0.1, 3.0);
            Monitor {
                source: [
                    MonitorSource::Force,
                    MonitorSource::Depth,
                    MonitorSource::Volts,
                    MonitorSource::Position,
                ][random.below(4)]
                .clone(),
                side: ThresholdSide::Above,
                threshold,
                resume: 0.8 * threshold,
                settle: Seconds(0.1),
                action: actions[random.below(actions.len())],
                message: "tripped".into(),
            }
        })
        .collect();
    plan
}

fn any_fault(random: &mut SplitMix) -> ScriptedFault {
    let kinds = [
        FaultKind::Silent,
        FaultKind::Late(Nanos::from_millis(30)),
        FaultKind::NotANumber,
        FaultKind::Stuck,
        FaultKind::Saturated(Rail::High),
        FaultKind::Saturated(Rail::Low),
        FaultKind::Noisy(Volts(0.05)),
        FaultKind::SignalJump(Volts(0.4)),
        FaultKind::SignalJump(Volts(-0.3)),
        FaultKind::LostSteps(200),
        FaultKind::RefuseCommands,
        FaultKind::Disconnect,
        FaultKind::Reset,
        FaultKind::UnannouncedReset,
    ];
    let kind = kinds[random.below(kinds.len())];
    let at = Nanos::from_seconds(Seconds(between(random, 0.0, 20.0)));
    let lasts = Nanos::from_seconds(Seconds(between(random, 0.001, 1.0)));
    match random.below(2) {
        0 => ScriptedFault::from(at, kind),
        _ => ScriptedFault::during(at, lasts, kind),
    }
}

fn any_choice(random: &mut SplitMix, plan: &Plan) -> Operator {
    let step_index = random.below(plan.steps.len() + 1);
    [
        Operator::Pause,
        Operator::Pause,
        Operator::PauseAfter { step_index },
        Operator::Resume,
        Operator::Resume,
        Operator::Resume,
        Operator::Finish,
        Operator::Confirm,
        Operator::Decline,
        Operator::Start,
        Operator::Retract,
        Operator::Close,
        Operator::Stop,
        Operator::Abort,
        Operator::Halt,
    ][random.below(15)]
}

/// What cannot be known while a fault lasts, so that no limit can be kept by it.
#[derive(Clone, Copy)]
struct Hidden {
    force: bool,
    position: bool,
}

impl Hidden {
    /// By a fault, with the times at which the run was homed and tared.
    fn by(fault: Option<&ScriptedFault>, homed: Option<Nanos>, tared: Option<Nanos>) -> Self {
        let Some(fault) = fault else {
            return Self { force: false, position: false };
        };
        // No command gets through: the axis goes where it was sent.
        let is_deaf = matches!(fault.kind, FaultKind::RefuseCommands | FaultKind::Disconnect);
        let is_before = |time: Option<Nanos>| time.is_none_or(|time| fault.at <= time);
        Self {
            force: is_deaf
                || match fault.kind {
                    // What reads too low, and a zero taken of a wrong signal.
                    FaultKind::SignalJump(by) => by.0 < 0.0 || is_before(tared),
                    FaultKind::Noisy(_) | FaultKind::Stuck => is_before(tared),
                    _ => false,
                },
            position: is_deaf || matches!(fault.kind, FaultKind::LostSteps(_)) && is_before(homed),
        }
    }
}

/// Longest time for which a signal may stand still unnoticed, beside the way of the brake: 100 samples.
const STUCK_SECS: f64 = 0.1;

/// A brake from 20 mm/s takes 0.33 s; while it lasts, the way it needs is that of the speed it began with.
const RECENT: Nanos = Nanos::from_millis(350);

/// How far the rig gives way.
const COMPLIANCE_UM_PER_N: f64 = 30.0;

/// Where the axis is; the probe is behind it by what the rig gives way.
fn axis(truth: &SimTruth) -> f64 {
    truth.position.0 + 1e-3 * COMPLIANCE_UM_PER_N * truth.force.0
}

fn one_run(seed: u64) -> EndingKind {
    let mut random = SplitMix::seeded(seed);
    let settings = SimSettings {
        profile: [SimProfile::Lab, SimProfile::Ideal][random.below(2)],
        seed,
        thickness: ["100", "20"][random.below(2)].parse().unwrap(),
        compliance: COMPLIANCE_UM_PER_N.to_string().parse().unwrap(),
        ..SimSettings::default()
    };
    let sim = SimRig::new(settings);
    let curve = sim.calibration().curve().unwrap();
    let plan = any_plan(&mut random);
    let fault = (random.below(2) == 0).then(|| any_fault(&mut random));
    let limits = Limits {
        force_max: Newtons(between(&mut random, 0.6, 3.0)),
        ..Limits::for_travel(Position(between(&mut random, 40.0, 75.0)))
    };
    let about = format!("seed {seed}, {fault:?}, {:?}", plan.steps);
    let rig = FaultyRig::new(sim, fault.into_iter().collect(), seed);
    let mut lab = Lab::new(rig, curve, plan.clone()).within(limits).forgetful();
    lab.is_answering = random.below(4) > 0;
    lab.operator(Operator::Start);
    let acceleration = lab.rig.description().acceleration.0;
    let (mut worst_force, mut worst_travel) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    let end = Nanos::from_seconds(Seconds(60.0));
    let interferes = random.below(2) == 0;
    // The speeds of the last tenth of a second, each with its time, slower ones that are older left out.
    let mut speeds: VecDeque<(Nanos, f64)> = VecDeque::new();
    let (mut homed, mut tared) = (None, None);
    // Tissue is nowhere stiffer than 2 N/mm here; a base is as stiff as the rig.
    let stiffness = if settings.thickness.mm() < 100.0 { 1.0 / 0.03 } else { 2.0 };
    // What leads goes anywhere, even where nothing is.
    let (mut leading, mut place) = (SplitMix::seeded(!seed), 10.0);
    let is_stuck = fault.is_some_and(|fault| matches!(fault.kind, FaultKind::Stuck));
    while lab.outcome.is_none() && lab.state().holding().is_none() && lab.now < end {
        lab.advance();
        if interferes && random.below(4000) == 0 {
            let choice = any_choice(&mut random, &plan);
            lab.operator(choice);
        }
        if leading.below(500) == 0 {
            place = [between(&mut leading, -50.0, 100.0), f64::NAN, 1e300][leading.below(40) / 19];
        }
        if leading.below(20) == 0 {
            let depth = Some(Depth(place));
            lab.give(EngineInput::Lead { depth });
        }
        let truth = lab.rig.inner().truth();
        // What the axis still does when the limit is seen: the way of the brake, the answer, and the 0.1 mm that
        // the age of a sample may cost.
        let own = lab.state().derived().velocity.0.abs();
        while speeds.back().is_some_and(|(_, speed)| *speed <= own) {
            speeds.pop_back();
        }
        speeds.push_back((lab.now, own));
        while speeds.front().is_some_and(|(at, _)| lab.now.since(*at) > RECENT) {
            speeds.pop_front();
        }
        let speed = speeds.front().map_or(0.0, |(_, speed)| *speed);
        let unseen = if is_stuck { STUCK_SECS * speed } else { 0.0 };
        let way = speed * speed / (2.0 * acceleration) + 0.012 * speed + 0.1 + unseen;
        let beyond = axis(&truth) - truth.counter_zero.0 - limits.travel_max.0 - way;
        if lab.state().is_homed() {
            homed = homed.or(Some(lab.now));
            worst_travel = worst_travel.max(beyond);
        }
        // Noise of 0.02 N five times over.
        if lab.state().tare().is_some() {
            tared = tared.or(Some(lab.now));
            let allowed = limits.force_max.0 + stiffness * way + 0.1;
            worst_force = worst_force.max(truth.force.0 - allowed);
        }
    }
    // A pause or a question may wait for ever; the operator is there.
    if lab.outcome.is_none() && lab.state().holding().is_none() {
        lab.operator(Operator::Stop);
        assert!(lab.run_until(Seconds(6.0), |_| false), "does not stop: {about}");
    }
    let hidden = Hidden::by(fault.as_ref(), homed, tared);
    if !hidden.position {
        assert!(worst_travel <= 0.0, "{worst_travel} mm too far: {about}");
    }
    if !hidden.force {
        // A specimen clipped in around the probe presses it at once, whatever the axis does.
        let is_pressed = |planned: &PlannedStep| matches!(&planned.step, Step::Prompt(prompt) if matches!(prompt.hand, Some(HandAction::Mount { .. })));
        let by_hand = plan.steps.iter().any(is_pressed);
        assert!(by_hand || worst_force <= 0.0, "{worst_force} N too much: {about}");
    }
    if lab.outcome.is_none() {
        lab.operator([Operator::Retract, Operator::Close][random.below(2)]);
        assert!(lab.run_until(Seconds(60.0), |_| false), "no end: {about}");
        lab.operator(Operator::Close);
    }
    let outcome = lab.outcome.clone().unwrap_or_else(|| panic!("no outcome: {about}"));
    assert!(!outcome.reason.is_empty(), "{about}");
    let is_deaf = fault.is_some_and(|fault| {
        matches!(fault.kind, FaultKind::Disconnect | FaultKind::RefuseCommands)
    });
    if outcome.ending != EndingKind::Finish {
        let is_stop = |command: &RigCommand| command.is_stopping();
        let stopped = lab.commands.iter().any(|(_, command)| is_stop(command));
        assert!(stopped, "no stop was sent: {about}");
    }
    if !is_deaf {
        let end = lab.now + Nanos::from_millis(400);
        while lab.now < end {
            lab.advance();
        }
        let before = lab.rig.inner().truth();
        let end = lab.now + Nanos::from_millis(200);
        while lab.now < end {
            lab.advance();
        }
        let after = lab.rig.inner().truth();
        // The probe itself creeps where the rig gives way; the axis does not.
        let moved = (axis(&after) - axis(&before)).abs();
        assert!(moved < 1e-6, "still moves by {moved} mm: {about}");
        assert!(!lab.state().is_motion_possible(), "{about}");
    }
    outcome.ending
}

#[test]
fn whatever_happens_the_axis_stops_with_a_reason() {
    let runs = match std::env::var("PALPATE_RANDOM_RUNS") {
        Ok(count) => count.parse().unwrap(),
        Err(_) => RUNS,
    };
    let threads = std::thread::available_parallelism().unwrap().get() as u64;
    let counts: Vec<[u64; 5]> = std::thread::scope(|scope| {
        let works: Vec<_> = (0..threads)
            .map(|own| {
                scope.spawn(move || {
                    let mut counts = [0; 5];
                    for seed in (own..runs).step_by(threads as usize) {
                        counts[one_run(seed) as usize] += 1;
                    }
                    counts
                })
            })
            .collect();
        works.into_iter().map(|work| work.join().unwrap()).collect()
    });
    let total = |kind: EndingKind| counts.iter().map(|own| own[kind as usize]).sum::<u64>();
    let kinds = [
        EndingKind::Finish,
        EndingKind::Stop,
        EndingKind::Abort,
        EndingKind::Halt,
        EndingKind::Interlock,
    ];
    for kind in kinds {
        println!("{kind}: {} of {runs}", total(kind));
        // Every way of ending is tried.
        assert!(total(kind) > 0, "{kind}");
    }
}

/// Runs through the runner and the disk: about ten seconds.
const SESSIONS: u64 = 12;

#[test]
fn whatever_happens_the_session_is_closed_with_its_reason() {
    let mut left = SESSIONS;
    for seed in 0.. {
        // Other seeds than those of the runs in memory.
        let mut random = SplitMix::seeded(1 << 40 | seed);
        let sim = SimRig::new(SimSettings { seed, ..SimSettings::default() });
        let calibration = sim.calibration();
        let plan = any_plan(&mut random);
        let fault = (random.below(2) == 0).then(|| any_fault(&mut random));
        let about = format!("seed {seed}, {fault:?}, {:?}", plan.steps);
        let rig = FaultyRig::new(sim, fault.into_iter().collect(), seed);
        let session = match recorded_runs::try_record_plan(Box::new(rig), calibration, plan) {
            Ok(session) => session,
            // Some plans ask for more than the rig can do, and say so.
            Err(StartError::Refused(reason)) => {
                assert!(!reason.is_empty(), "{about}");
                continue;
            }
            Err(err) => panic!("{err}: {about}"),
        };
        let end = session.end.as_ref().unwrap_or_else(|| panic!("{about}"));
        assert!(!end.reason.is_empty(), "{about}");
        assert_eq!(end.samples, session.rows.len() as u64, "{about}");
        // And decides the same again.
        let again = replay(&session, &[]).unwrap();
        assert_eq!(again.first_difference, None, "{about}");
        left -= 1;
        if left == 0 {
            break;
        }
    }
}
