//! What plans can ask for beside a ramp and hold, on the simulated rig.
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimCompliance, SimProfile, SimRig, SimSettings, SimThickness};
use palpate_model::rig::{HandAction, Limits, Phase};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_protocols::engine::{EndingKind, Operator, PauseView, Record};
use palpate_protocols::plans::{
    CheckHome, FindBase, FindContact, Hold, HoldForce, HoldRate, LoadTo, Monitor, MonitorAction,
    MonitorSource, OnFailure, OnTimeout, Plan, PlannedStep, Prompt, Ramp, Rest, SettleLimits, Sine,
    Step, ThresholdSide, Unload, Weigh,
};
use palpate_protocols::preview::preview;
use palpate_tests::lab::{Lab, retract, set_up};

fn rig(profile: SimProfile) -> SimRig {
    SimRig::new(SimSettings { profile, seed: 3, ..SimSettings::default() })
}

/// A set-up, steps, and a retract.
fn plan(steps: Vec<Step>) -> Plan {
    let all =
        set_up(Seconds(1.0), FindContact::default()).into_iter().chain(steps).chain([retract()]);
    Plan::of("test", 1, all.collect())
}

fn lab(profile: SimProfile, plan: Plan) -> Lab<SimRig> {
    let rig = rig(profile);
    let curve = rig.calibration().curve().unwrap();
    Lab::new(rig, curve, plan)
}

fn finished(mut lab: Lab<SimRig>) -> Lab<SimRig> {
    lab.run();
    let outcome = lab.outcome.clone();
    let outcome = outcome.unwrap_or_else(|| panic!("{:?}", lab.state().holding()));
    assert_eq!(outcome.ending, EndingKind::Finish, "{}", outcome.reason);
    lab
}

/// Cycles of preconditioning to a depth, as their file writes them out.
fn cycles(count: u32, rest: f64) -> Plan {
    let mut plan = plan(Vec::new());
    let last = plan.steps.pop().unwrap();
    for cycle in 1..=count {
        let steps = [
            Step::Ramp(Ramp { speed: MmPerS(1.5), depth: Depth(12.0) }),
            Step::Unload(Unload { speed: MmPerS(1.5), clearance_mm: 0.0 }),
            Step::Rest(Rest { duration: Seconds(rest) }),
        ];
        plan.steps.extend(steps.map(|step| PlannedStep {
            cycle,
            checkpoint: matches!(step, Step::Rest(_)).then(|| format!("after cycle {cycle}")),
            ..step.into()
        }));
    }
    plan.steps.push(last);
    plan
}

#[test]
fn cycles_last_as_long_as_the_preview_says() {
    let plan = cycles(10, 20.0);
    let rig = rig(SimProfile::Ideal);
    let curve = rig.calibration().curve().unwrap();
    let limits = Limits::for_travel(rig.description().travel);
    let expected = preview(&plan, rig.description(), &limits, &curve, false);
    let tick = rig.description().tick().0;
    let lab = finished(Lab::new(rig, curve, plan.clone()));
    let first = lab.ticks_of(4).unwrap().0;
    let last = lab.ticks_of(plan.steps.len() - 1).unwrap().0;
    // From the first indentation to the begin of the retract.
    let known: f64 = expected.steps[4..plan.steps.len() - 1]
        .iter()
        .map(|step| {
            assert!(step.is_exact, "{step:?}");
            step.expected.0
        })
        .sum();
    let took = (last - first) as f64;
    assert!((took - known / tick).abs() <= 1.0, "{took} {}", known / tick);
    for cycle in 1..=10 {
        let own = |phase| {
            let own = lab.seen.iter().filter(|seen| (seen.cycle, seen.phase) == (cycle, phase));
            own.count()
        };
        // 12 mm at 1.5 mm/s are 8 s and the ramps of the profile.
        assert!((8000..8040).contains(&own(Phase::Ramp)), "{}", own(Phase::Ramp));
        assert!((8000..8040).contains(&own(Phase::Unload)));
        assert_eq!(own(Phase::Rest), 20_000);
    }
}

#[test]
fn a_force_is_reached_and_not_passed() {
    // The way of braking grows with the square of the speed: without it in mind the fast one goes too far.
    for (speed, brake, most) in
        [(1.5, None, 0.06), (1.5, Some(Newtons(0.5)), 0.03), (4.5, None, 0.12)]
    {
        let load =
            LoadTo { speed: MmPerS(speed), force: Newtons(2.0), depth_max: Depth(35.0), brake };
        let lab = finished(lab(SimProfile::Ideal, plan(vec![Step::LoadTo(load)])));
        let reached = lab.records.iter().find_map(|(_, record)| match record {
            Record::ForceReached { force, .. } => Some(*force),
            _ => None,
        });
        // At rest the tissue already relaxes, so the force may be a little below the target.
        let miss = reached.unwrap().0 - 2.0;
        assert!(miss.abs() < most, "{speed} {brake:?}: {miss}");
    }
}

#[test]
fn a_force_that_is_not_there_ends_the_run() {
    let load =
        LoadTo { speed: MmPerS(3.0), force: Newtons(5.0), depth_max: Depth(8.0), brake: None };
    let mut lab = lab(SimProfile::Ideal, plan(vec![Step::LoadTo(load)]));
    lab.run();
    let reason = &lab.state().holding().unwrap().reason;
    assert!(reason.contains("the force is only"), "{reason}");
}

#[test]
fn force_is_kept_while_the_tissue_creeps() {
    let load =
        LoadTo { speed: MmPerS(1.5), force: Newtons(1.5), depth_max: Depth(35.0), brake: None };
    let creep = HoldForce {
        force: Newtons(1.5),
        duration: Seconds(20.0),
        speed: MmPerS(3.0),
        depth_max: Depth(40.0),
    };
    let steps = vec![Step::LoadTo(load), Step::HoldForce(creep)];
    let lab = finished(lab(SimProfile::Ideal, plan(steps)));
    let creep: Vec<_> = lab.seen.iter().filter(|seen| seen.phase == Phase::Creep).collect();
    let mean = |part: &[&palpate_tests::lab::LabSample],
                of: fn(&palpate_tests::lab::LabSample) -> f64| {
        part.iter().map(|seen| of(seen)).sum::<f64>() / part.len() as f64
    };
    let force = |seen: &palpate_tests::lab::LabSample| seen.derived.force.unwrap().0;
    let depth = |seen: &palpate_tests::lab::LabSample| seen.derived.depth.unwrap().0;
    // While the tissue relaxes fast, corrections come a little late; then a pulse of 0.015 mm in tissue of up to
    // 0.8 N/mm is the grain.
    for (index, second) in creep[2000..].chunks(1000).enumerate() {
        let miss = mean(second, force) - 1.5;
        assert!(miss.abs() < if index < 8 { 0.1 } else { 0.02 }, "second {index}: {miss}");
    }
    let crept = mean(&creep[19_000..], depth) - mean(&creep[..1000], depth);
    assert!(crept > 0.3, "{crept}");
}

#[test]
fn a_hold_ends_when_the_force_is_steady() {
    let steps = vec![
        Step::Ramp(Ramp { speed: MmPerS(3.0), depth: Depth(15.0) }),
        Step::Hold(Hold {
            duration: Seconds(300.0),
            until: None,
            // 0.01 N/min over 10 s, as Mach-1 ends its holds.
            rate: Some(HoldRate { below_n_per_s: 0.01 / 60.0, over: Seconds(10.0) }),
        }),
    ];
    let lab = finished(lab(SimProfile::Ideal, plan(steps)));
    let held = lab.records.iter().find_map(|(_, record)| match record {
        Record::HoldSteady { held, .. } => Some(held.0),
        _ => None,
    });
    assert!((10.0..120.0).contains(&held.unwrap()), "{held:?}");
    // The force itself, by least squares over the rule's window: steady at the end, not yet 5 s before.
    let forces: Vec<f64> = lab
        .seen
        .iter()
        .filter(|seen| seen.phase == Phase::Hold)
        .map(|seen| seen.derived.force.unwrap().0)
        .collect();
    let slope = |end: usize| {
        let window = &forces[end - 10_000..end];
        let (mut top, mut bottom) = (0.0, 0.0);
        for (i, force) in window.iter().enumerate() {
            let t = (i as f64 - 4999.5) * 1e-3;
            (top, bottom) = (top + t * force, bottom + t * t);
        }
        top / bottom
    };
    let (at_end, before) = (slope(forces.len()).abs(), slope(forces.len() - 5000).abs());
    let limit = 0.01 / 60.0;
    assert!(at_end < 1.1 * limit, "{at_end}");
    assert!(before > limit, "{before}");
}

#[test]
fn a_sine_comes_back_to_where_it_began() {
    let sine = Sine { amplitude_mm: 1.5, frequency_hz: 0.5, cycles: 4 };
    let steps = vec![Step::Ramp(Ramp { speed: MmPerS(3.0), depth: Depth(8.0) }), Step::Sine(sine)];
    let lab = finished(lab(SimProfile::Ideal, plan(steps)));
    let depths: Vec<f64> = lab
        .seen
        .iter()
        .filter(|seen| seen.phase == Phase::Sine)
        .map(|seen| seen.derived.depth.unwrap().0)
        .collect();
    let deepest = depths.iter().copied().fold(0.0, f64::max);
    assert!((deepest - depths[0] - 3.0).abs() < 0.016, "{deepest} {}", depths[0]);
    assert!((depths[depths.len() - 1] - depths[0]).abs() < 0.016);
}

#[test]
fn home_is_where_it_was() {
    let check = Step::CheckHome(CheckHome { speed: MmPerS(9.0), touch_speed: MmPerS(0.3) });
    let mut plan = plan(Vec::new());
    plan.steps.push(check.into());
    let lab = finished(lab(SimProfile::Lab, plan));
    let missed = lab.records.iter().find_map(|(_, record)| match record {
        Record::HomeChecked { missed_pulses } => Some(*missed_pulses),
        _ => None,
    });
    assert!(missed.unwrap().abs() <= 1, "{missed:?}");
}

#[test]
fn a_pause_asked_for_comes_at_its_checkpoint() {
    let plan = cycles(3, 3.0);
    let mut lab = lab(SimProfile::Ideal, plan.clone());
    lab.operator(Operator::Start);
    assert!(lab.run_until(Seconds(1e3), |state| state.phase() == Phase::Unload));
    let (index, name) = plan.checkpoints_from(lab.state().step_progress().0).next().unwrap();
    assert_eq!(name, "after cycle 1");
    lab.operator(Operator::PauseAfter { step_index: index });
    assert!(lab.run_until(Seconds(60.0), |state| state.phase() == Phase::Paused));
    assert_eq!(lab.state().step_progress().0, index);
    let at = lab.state().derived().depth.unwrap();
    assert!(at.0.abs() < 0.02, "{at}");
    lab.operator(Operator::Resume);
    assert!(lab.run_until(Seconds(1e4), |_| false));
    assert_eq!(lab.outcome.unwrap().ending, EndingKind::Finish);
}

#[test]
fn the_base_tells_how_thick_the_specimen_is() {
    for (thickness, compliance) in [("30", "30"), ("45", "60")] {
        let settings = SimSettings {
            profile: SimProfile::Ideal,
            seed: 4,
            thickness: thickness.parse::<SimThickness>().unwrap(),
            compliance: compliance.parse::<SimCompliance>().unwrap(),
            ..SimSettings::default()
        };
        let rig = SimRig::new(settings);
        let curve = rig.calibration().curve().unwrap();
        let mut plan = plan(vec![retract()]);
        let last = plan.steps.pop().unwrap();
        let unmount = Step::Prompt(Prompt {
            message: "Take the specimen out".into(),
            timeout: Seconds(60.0),
            on_timeout: OnTimeout::Stop,
            hand: Some(HandAction::Unmount),
        });
        plan.steps.push(unmount.into());
        plan.steps.push(Step::FindBase(FindBase::default()).into());
        plan.steps.push(last);
        let lab = finished(Lab::new(rig, curve, plan));
        let found = lab.records.iter().find_map(|(_, record)| match record {
            Record::BaseFound {
                thickness_mm, thickness_std_error_mm, compliance_mm_per_n, ..
            } => {
                Some((thickness_mm.unwrap(), thickness_std_error_mm.unwrap(), *compliance_mm_per_n))
            }
            _ => None,
        });
        let (mm, error, gave) = found.unwrap();
        let truth: f64 = thickness.parse().unwrap();
        // The contact's standard error, mostly; four of them, and a pulse for the rig that gives way at the contact.
        assert!((mm - truth).abs() < 4.0 * error + 0.015, "{mm} ± {error}, {truth}");
        // The rig's own and a thousandth of a millimetre a newton of the base, known to a fifth from 0.4 N.
        let wanted = compliance.parse::<f64>().unwrap() * 1e-3 + 1e-3;
        assert!((gave / wanted - 1.0).abs() < 0.2, "{gave} {wanted}");
        let felt = lab.seen.iter().filter(|seen| seen.phase == Phase::Contact);
        let most = felt.filter_map(|seen| seen.derived.force).map(|force| force.0);
        // A touch ends at 0.4 N; stopping on a whole pulse adds up to half of one.
        assert!(most.fold(0.0, f64::max) < 0.75);
    }
}

/// A plan that loads, with a monitor of the force.
fn watched(action: MonitorAction, threshold: f64) -> Plan {
    let ramp = Step::Ramp(Ramp { speed: MmPerS(1.5), depth: Depth(20.0) });
    let rest = Step::Rest(Rest { duration: Seconds(30.0) });
    let mut plan = plan(vec![rest, ramp]);
    plan.monitors = vec![Monitor {
        source: MonitorSource::Force,
        side: ThresholdSide::Above,
        threshold,
        resume: 0.5 * threshold,
        settle: Seconds(0.5),
        action,
        message: "force is high".into(),
    }];
    plan
}

#[test]
fn a_monitor_takes_the_probe_out_also_where_nobody_watches() {
    let rig = rig(SimProfile::Ideal);
    let calibration = rig.calibration();
    let session = palpate_tests::recorded_runs::record_plan(
        Box::new(rig),
        calibration,
        watched(MonitorAction::Retract, 1.0),
    );
    let end = session.end.as_ref().unwrap();
    assert_eq!(end.outcome, "stop", "{}", end.reason);
    let last = session.rows.last().unwrap();
    assert!(last.depth.unwrap() < -5.0, "{:?}", last.depth);
}

#[test]
fn a_monitor_takes_the_probe_out_of_a_search_too() {
    // A search presses to 0.42 N.
    let mut lab = lab(SimProfile::Ideal, watched(MonitorAction::Retract, 0.3));
    lab.run();
    let outcome = lab.outcome.clone().unwrap();
    assert_eq!(outcome.ending, EndingKind::Stop, "{}", outcome.reason);
    assert!(lab.state().contact().is_none());
    let deepest = lab.seen.iter().map(|seen| seen.derived.position.0);
    let deepest = deepest.fold(0.0, f64::max);
    let last = lab.seen.last().unwrap().derived.position.0;
    assert!(deepest - last > 9.0, "{deepest} {last}");
}

#[test]
fn a_condition_that_comes_back_with_its_step_ends_the_run() {
    let mut lab = lab(SimProfile::Ideal, watched(MonitorAction::Pause, 0.3));
    lab.operator(Operator::Start);
    assert!(lab.run_until(Seconds(2000.0), |state| state.holding().is_some()));
    let reason = &lab.state().holding().unwrap().reason;
    assert!(reason.contains("already paused the step 3 times"), "{reason}");
    let searches =
        lab.records.iter().filter(|(_, record)| matches!(record, Record::MonitorTripped { .. }));
    assert_eq!(searches.count(), 4);
}

#[test]
fn a_search_that_presses_beyond_the_limit_is_refused() {
    let mut plan = plan(Vec::new());
    plan.limits.force_max = Some(Newtons(0.2));
    let rig = rig(SimProfile::Ideal);
    let curve = rig.calibration().curve().unwrap();
    let limits = plan.limits.tighten(Limits::for_travel(rig.description().travel));
    let refusals = preview(&plan, rig.description(), &limits, &curve, false).refusals;
    assert!(refusals.iter().any(|one| one.contains("presses to")), "{refusals:?}");
}

#[test]
fn a_pause_that_cannot_go_on_ends_where_nobody_watches() {
    let rig = rig(SimProfile::Ideal);
    let calibration = rig.calibration();
    let session = palpate_tests::recorded_runs::record_plan(
        Box::new(rig),
        calibration,
        watched(MonitorAction::Pause, 1.0),
    );
    let end = session.end.as_ref().unwrap();
    assert_eq!(end.outcome, "stop", "{}", end.reason);
    assert!(end.reason.contains("no operator can decide"), "{}", end.reason);
}

/// The hand that loads the cell stands for whoever touches the probe; it does so faster than the interlock on the
/// force's rate lets pass.
fn touchable(plan: Plan) -> Lab<SimRig> {
    let lab = lab(SimProfile::Ideal, plan);
    let limits = Limits { force_rate_max: 1e4, ..lab.state().config().limits };
    lab.within(limits)
}

#[test]
fn what_a_person_paused_only_a_person_resumes() {
    let mut lab = touchable(watched(MonitorAction::Pause, 1.0));
    lab.operator(Operator::Start);
    let is_resting = |state: &palpate_protocols::engine::EngineState| state.step_progress().0 == 4;
    assert!(lab.run_until(Seconds(1e3), is_resting));
    lab.operator(Operator::PauseAfter { step_index: 4 });
    assert!(lab.run_until(Seconds(60.0), |state| state.phase() == Phase::Paused));
    for mass_g in [150.0, 0.0] {
        lab.rig.apply_hand_action(HandAction::LoadCell { mass_g });
        lab.run_until(Seconds(3.0), |_| false);
    }
    assert!(matches!(lab.state().pause(), PauseView::Paused { .. }));
    assert_ne!(lab.state().phase(), Phase::Ramp);
    let moved = lab.state().derived().depth.unwrap();
    assert!(moved.0 < 0.1, "{moved}");
}

#[test]
fn a_pause_of_a_monitor_that_a_person_takes_over_stays() {
    let mut lab = touchable(watched(MonitorAction::Pause, 1.0));
    lab.operator(Operator::Start);
    let is_resting = |state: &palpate_protocols::engine::EngineState| state.step_progress().0 == 4;
    assert!(lab.run_until(Seconds(1e3), is_resting));
    lab.rig.apply_hand_action(HandAction::LoadCell { mass_g: 150.0 });
    lab.run_until(Seconds(3.0), |_| false);
    assert!(matches!(lab.state().pause(), PauseView::Paused { .. }));
    lab.operator(Operator::Pause);
    lab.rig.apply_hand_action(HandAction::LoadCell { mass_g: 0.0 });
    lab.run_until(Seconds(3.0), |_| false);
    assert!(matches!(lab.state().pause(), PauseView::Paused { .. }));
    lab.operator(Operator::Resume);
    assert_eq!(lab.state().pause(), PauseView::None);
}

/// A search for the base without a specimen, on a rig that gives way by so many um/N, with steps behind it.
fn base_search(compliance: &str, behind: Vec<Step>) -> Lab<SimRig> {
    let settings = SimSettings {
        profile: SimProfile::Ideal,
        seed: 5,
        compliance: compliance.parse::<SimCompliance>().unwrap(),
        ..SimSettings::default()
    };
    let rig = SimRig::new(settings);
    let curve = rig.calibration().curve().unwrap();
    let mut steps = set_up(Seconds(1.0), FindContact::default());
    // No tissue is ever touched.
    steps[3] = Step::Prompt(Prompt {
        message: "Take the specimen out".into(),
        timeout: Seconds(60.0),
        on_timeout: OnTimeout::Stop,
        hand: Some(HandAction::Unmount),
    });
    steps.push(Step::FindBase(FindBase::default()));
    steps.extend(behind);
    Lab::new(rig, curve, Plan::of("base", 1, steps))
}

#[test]
fn a_base_that_hardly_gives_way_trips_with_what_to_do() {
    let mut lab = base_search("0", vec![retract()]);
    lab.run();
    let ended = lab.outcome.as_ref().or(lab.state().holding());
    let reason = &ended.unwrap().reason;
    assert!(reason.contains("50 N/s") && reason.contains("find-base"), "{reason}");
}

#[test]
fn depth_counts_from_the_base_once_it_is_found() {
    let load =
        LoadTo { speed: MmPerS(1.5), force: Newtons(2.0), depth_max: Depth(1.0), brake: None };
    // A stiff surface is left slowly: the force's rate has an interlock.
    let unload = Step::Unload(Unload { speed: MmPerS(0.3), clearance_mm: 0.0 });
    let lab = finished(base_search("60", vec![Step::LoadTo(load), unload, retract()]));
    let reached = lab.records.iter().find_map(|(_, record)| match record {
        Record::ForceReached { depth, .. } => Some(depth.0),
        _ => None,
    });
    // What is elastic gives no time: without the way of the brake in mind 0.2 N too much.
    let forces: Vec<f64> = lab
        .seen
        .iter()
        .filter(|seen| seen.phase == Phase::Ramp)
        .map(|seen| seen.derived.force.unwrap().0)
        .collect();
    let means = forces.windows(20).map(|part| part.iter().sum::<f64>() / 20.0);
    let peak = means.fold(0.0, f64::max);
    assert!((1.85..2.03).contains(&peak), "{peak}");
    // 0.061 mm/N with the base under 2 N, and a pulse each for the place of the base and for where the load stopped.
    let depth = reached.unwrap();
    assert!((depth - 0.122).abs() < 0.03, "{depth}");
}

#[test]
fn a_search_for_contact_goes_on_from_any_moment_of_it() {
    let plan = plan(Vec::new());
    let undisturbed = finished(lab(SimProfile::Ideal, plan.clone()));
    let contact = |lab: &Lab<SimRig>| lab.state().contact().unwrap();
    let (first, last) = undisturbed.ticks_of(3).unwrap();
    for part in 0..12 {
        let mut lab = lab(SimProfile::Ideal, plan.clone());
        lab.operator(Operator::Start);
        let wanted = first + (last - first) * (2 * part + 1) / 24;
        let mut phase = Phase::Idle;
        while lab.seen.last().is_none_or(|seen| seen.reading.tick < wanted) {
            lab.advance();
            phase = lab.state().phase();
        }
        lab.operator(Operator::Pause);
        lab.run_until(Seconds(3.0), |_| false);
        lab.operator(Operator::Resume);
        assert!(lab.run_until(Seconds(1e3), |_| false));
        let outcome = lab.outcome.clone();
        let outcome =
            outcome.unwrap_or_else(|| panic!("{part}, {phase}: {:?}", lab.state().holding()));
        assert_eq!(outcome.ending, EndingKind::Finish, "{part}: {}", outcome.reason);
        let apart = contact(&lab).position.distance_from(contact(&undisturbed).position);
        // Two searches of one surface, each known to its own standard error.
        let error = contact(&lab).std_error_mm.hypot(contact(&undisturbed).std_error_mm);
        assert!(apart.abs() < 4.0 * error, "{part}: {apart} {error}");
    }
}

#[test]
fn a_calibration_can_be_paused_with_a_weight_beyond_every_limit_on_the_cell() {
    let weigh = |mass_g| {
        Step::Weigh(Weigh {
            mass_g,
            is_loading: true,
            repeat: 1,
            settle: SettleLimits { window: Seconds(1.0), timeout: Seconds(20.0) },
        })
    };
    let load = Step::Prompt(Prompt {
        message: "Load the cell".into(),
        timeout: Seconds(60.0),
        on_timeout: OnTimeout::Stop,
        hand: Some(HandAction::LoadCell { mass_g: 1040.0 }),
    });
    let plan = Plan::of("weights", 1, vec![load, weigh(1040.0), weigh(1040.0)]);
    let mut lab = lab(SimProfile::Lab, plan);
    lab.operator(Operator::Start);
    assert!(lab.run_until(Seconds(60.0), |state| state.phase() == Phase::Weigh));
    lab.operator(Operator::Pause);
    assert!(lab.run_until(Seconds(60.0), |state| state.phase() == Phase::Paused));
    lab.run_until(Seconds(5.0), |_| false);
    lab.operator(Operator::Resume);
    assert!(lab.run_until(Seconds(60.0), |_| false));
    assert_eq!(lab.outcome.unwrap().ending, EndingKind::Finish);
}

#[test]
fn a_measurement_is_not_tried_again() {
    let mut plan = cycles(1, 1.0);
    plan.steps[4].on_failure = OnFailure::Retry(1);
    let rig = rig(SimProfile::Ideal);
    let curve = rig.calibration().curve().unwrap();
    let limits = Limits::for_travel(rig.description().travel);
    let refusals = preview(&plan, rig.description(), &limits, &curve, false).refusals;
    assert_eq!(refusals.len(), 1, "{refusals:?}");
    assert!(refusals[0].starts_with("step 5, ramp:"), "{refusals:?}");
}
