//! Every step of every protocol that comes with the program, paused in its midst: what can go on does, and the rest of
//! the run is as long and as deep as without; what cannot says why.
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings};
use palpate_model::Nanos;
use palpate_model::rig::Limits;
use palpate_model::units::{MmPerS, Seconds};
use palpate_protocols::engine::{EndingKind, EngineState, Operator, PauseView, Record};
use palpate_protocols::file::{BUILT_IN, built_in};
use palpate_protocols::plans::{ContactPress, Plan, Step, Tare};
use palpate_protocols::preview::preview;
use palpate_tests::lab::{Lab, LabSample};
use std::collections::BTreeMap;

/// Values that make a protocol short and keep each of its steps; for every built-in one.
fn brief(name: &str) -> &'static [(&'static str, &'static str)] {
    match name {
        "daily-check" => &[("distance", "5 mm")],
        "load-cell-calibration" => &[("masses", "500 g"), ("repeats", "1")],
        "zeroing" => &[("thickness", "true")],
        "check-home" => &[("repeats", "1")],
        "stiff-surface" => &[("force", "1 N"), ("repeats", "1")],
        "preconditioning" => {
            &[("speed", "6 mm/s"), ("depth", "10 mm"), ("cycles", "2"), ("rest", "1 s")]
        }
        "preconditioning-force" => {
            &[("speed", "3 mm/s"), ("force", "1 N"), ("cycles", "2"), ("rest", "1 s")]
        }
        "ramp-hold" => {
            &[("speed", "6 mm/s"), ("depth", "12 mm"), ("hold", "1 s"), ("unload", "6 mm/s")]
        }
        "validation-series" => {
            &[("speeds", "3 mm/s, 6 mm/s"), ("depths", "8 mm"), ("hold", "1 s"), ("rest", "1 s")]
        }
        "relaxation-series" => {
            &[("force", "1 N"), ("speed", "3 mm/s"), ("hold", "3 s"), ("repeats", "2")]
        }
        "multi-step-relaxation" => &[
            ("depths", "5 mm, 10 mm"),
            ("speed", "3 mm/s"),
            ("slope", "5 N/min"),
            ("over", "1 s"),
            ("longest", "3 s"),
        ],
        "creep" => &[("force", "1 N"), ("speed", "3 mm/s"), ("duration", "2 s")],
        "sine" => &[("speed", "6 mm/s"), ("settle", "1 s"), ("frequency", "1 Hz"), ("cycles", "2")],
        "frequency-sweep" => &[
            ("speed", "6 mm/s"),
            ("settle", "1 s"),
            ("frequencies", "1 Hz, 1.5 Hz"),
            ("cycles", "2"),
            ("pause", "1 s"),
        ],
        "free-jog" => &[],
        other => panic!("give {other} values that make it short"),
    }
}

fn plan(name: &str) -> Plan {
    let values = brief(name);
    let values = values.iter().map(|(key, value)| ((*key).into(), (*value).into()));
    let values: BTreeMap<String, String> = values.collect();
    let mut plan = built_in(name).unwrap().unwrap().plan(&values).unwrap();
    for planned in &mut plan.steps {
        // Nothing in a file shortens these.
        match &mut planned.step {
            Step::FindContact(search) => {
                search.recovery = Seconds(0.5);
                search.approach_speed = MmPerS(3.0);
                search.press =
                    search.press.map(|press| ContactPress { dwell: Seconds(1.0), ..press });
                search.pass_speed = MmPerS(0.3);
            }
            Step::Tare(Tare { duration }) => *duration = Seconds(1.0),
            _ => {}
        }
    }
    plan
}

fn lab(plan: &Plan) -> Lab<SimRig> {
    // A base is felt by how the rig gives way, and no deeper below the tissue than a sine needs: the search is slow.
    let rig = SimRig::new(SimSettings {
        profile: SimProfile::Ideal,
        seed: 3,
        compliance: "30".parse().unwrap(),
        thickness: "25".parse().unwrap(),
        ..SimSettings::default()
    });
    let curve = rig.calibration().curve().unwrap();
    let mut lab = Lab::new(rig, curve, plan.clone());
    lab.is_answering = false;
    lab
}

/// Goes on, prompts answered, until the run ends or `is_reached`.
fn go_on(lab: &mut Lab<SimRig>, is_reached: impl Fn(&EngineState) -> bool) {
    loop {
        let is_stop = |state: &EngineState| is_reached(state) || state.prompt().is_some();
        assert!(lab.run_until(Seconds(1e4), is_stop), "it does not end");
        if is_reached(lab.state()) || lab.outcome.is_some() || lab.state().holding().is_some() {
            return;
        }
        lab.operator(Operator::Confirm);
    }
}

fn undisturbed(plan: &Plan) -> Lab<SimRig> {
    let mut lab = lab(plan);
    lab.operator(Operator::Start);
    go_on(&mut lab, |_| false);
    lab
}

/// A run paused 60 samples after a step began, for 3 s, and whether it could go on; where it could not it was finished
/// early.
fn paused_at(step_index: usize, plan: &Plan) -> (Lab<SimRig>, bool) {
    let mut lab = lab(plan);
    lab.operator(Operator::Start);
    go_on(&mut lab, |state: &EngineState| {
        let (index, started) = state.step_progress();
        index == step_index && started > Nanos::ZERO
    });
    for _ in 0..60 {
        lab.advance();
    }
    assert_eq!(lab.state().step_progress().0, step_index);
    lab.operator(Operator::Pause);
    let is_paused = |state: &EngineState| matches!(state.pause(), PauseView::Paused { .. });
    assert!(lab.run_until(Seconds(100.0), is_paused));
    let PauseView::Paused { no_resume } = lab.state().pause() else {
        panic!("{:?}, {:?}", lab.state().pause(), lab.state().holding());
    };
    lab.run_until(Seconds(3.0), |_| false);
    assert!(is_paused(lab.state()) && lab.outcome.is_none());
    // Only a force that is held goes on being held.
    let is_held = matches!(plan.steps[step_index].step, Step::HoldForce(_));
    assert!(is_held || lab.state().derived().velocity.0 == 0.0);
    lab.operator(Operator::Resume);
    let can_go_on = !is_paused(lab.state());
    assert_eq!(can_go_on, no_resume.is_none());
    if let Some(why) = no_resume {
        let refused = lab.records.iter().rev().find_map(|(_, record)| match record {
            Record::Refused { reason } => Some(reason.clone()),
            _ => None,
        });
        let reason = refused.unwrap();
        assert!(!why.is_empty() && reason.contains(why), "{reason}");
        assert!(reason.contains("finish the run early or stop it"), "{reason}");
        lab.operator(Operator::Finish);
    }
    go_on(&mut lab, |_| false);
    (lab, can_go_on)
}

/// Mean of something over the last samples of a step.
fn at_end(lab: &Lab<SimRig>, step_index: usize, of: fn(&LabSample) -> Option<f64>) -> Option<f64> {
    let own = lab.seen.iter().rev();
    let own = own
        .skip_while(|seen| seen.step_index != step_index)
        .take_while(|seen| seen.step_index == step_index);
    let last: Vec<f64> = own.take(50).filter_map(of).collect();
    (!last.is_empty()).then(|| last.iter().sum::<f64>() / last.len() as f64)
}

fn deepest(lab: &Lab<SimRig>, step_index: usize) -> Option<f64> {
    let own = lab.seen.iter().filter(|seen| seen.step_index == step_index);
    own.filter_map(|seen| seen.derived.depth).map(|depth| depth.0).reduce(f64::max)
}

/// What is measured to a force goes as deep as noise and creep have it: 0.18 mm apart at most in tissue of 0.1 to 0.3 N/mm.
const DEPTH_OF_FORCE: f64 = 0.3;

/// Forces at the ends of steps are 0.035 N apart at most, most of it from where contact is found.
const FORCE: f64 = 0.06;

/// Whatever was measured beside the step that was paused is as long, as deep and as hard as if there had been none.
fn compare(what: &str, plan: &Plan, paused: usize, now: &Lab<SimRig>, before: &Lab<SimRig>) {
    let rig = before.rig.description();
    let limits = Limits::for_travel(rig.travel);
    let curve = before.rig.calibration().curve().unwrap();
    let previewed = preview(plan, rig, &limits, &curve, false);
    // Tissue goes on relaxing and recovering in a pause.
    let has_rested =
        matches!(plan.steps[paused].step, Step::Hold(_) | Step::HoldForce(_) | Step::Rest(_));
    for (index, (planned, foreseen)) in plan.steps.iter().zip(&previewed.steps).enumerate() {
        // A prompt lasts until the operator answers.
        if index == paused || matches!(planned.step, Step::Prompt(_)) {
            continue;
        }
        let what = format!("{what}, step {} ({})", index + 1, foreseen.phase);
        let length = |lab: &Lab<SimRig>| {
            let (first, last) = lab.ticks_of(index).unwrap();
            assert!(lab.seen.len() as u64 > last - first, "{what}");
            last - first
        };
        let (long, usual) = (length(now), length(before));
        let apart = match foreseen.is_exact {
            true => 1,
            // What waits for a signal or goes from where one was met: 6 % at most.
            false => 100 + usual / 10,
        };
        assert!(long.abs_diff(usual) <= apart, "{what}: {long} {usual}");
        if !planned.step.is_measuring() {
            continue;
        }
        let deep = (deepest(now, index).unwrap() - deepest(before, index).unwrap()).abs();
        let allowed = match foreseen.is_exact {
            true => rig.mm_per_pulse + 1e-9,
            false => DEPTH_OF_FORCE,
        };
        assert!(deep <= allowed, "{what}: {deep} mm");
        let force = |seen: &LabSample| seen.derived.force.map(|force| force.0);
        let [hard, usual] = [now, before].map(|lab| at_end(lab, index, force).unwrap());
        let is_alike = (hard - usual).abs() <= FORCE || has_rested && index > paused;
        assert!(is_alike, "{what}: {hard} {usual} N");
    }
}

fn every_step_of(name: &str) {
    let plan = plan(name);
    let before = undisturbed(&plan);
    let outcome = before.outcome.as_ref();
    let outcome = outcome.unwrap_or_else(|| panic!("{name}: {:?}", before.state().holding()));
    assert_eq!(outcome.ending, EndingKind::Finish, "{name}: {}", outcome.reason);
    for (index, planned) in plan.steps.iter().enumerate() {
        let what = format!("{name} paused at step {} ({})", index + 1, planned.step.phase());
        let (now, can_go_on) = paused_at(index, &plan);
        let outcome = now.outcome.as_ref();
        let outcome = outcome.unwrap_or_else(|| panic!("{what}: {:?}", now.state().holding()));
        assert_eq!(outcome.ending, EndingKind::Finish, "{what}: {}", outcome.reason);
        let is_motion_measured = matches!(
            planned.step,
            Step::Ramp(_) | Step::LoadTo(_) | Step::Unload(_) | Step::Sine(_)
        );
        assert_eq!(can_go_on, !is_motion_measured, "{what}");
        if can_go_on {
            compare(&what, &plan, index, &now, &before);
        } else {
            assert!(outcome.reason.contains("early"), "{what}: {}", outcome.reason);
        }
    }
}

#[test]
fn every_step_of_every_shipped_protocol_can_be_paused() {
    // A dozen seconds of work, on two processors.
    let (even, odd): (Vec<_>, Vec<_>) = BUILT_IN.iter().enumerate().partition(|(i, _)| i % 2 == 0);
    std::thread::scope(|scope| {
        for half in [even, odd] {
            scope.spawn(move || half.iter().for_each(|(_, (name, _))| every_step_of(name)));
        }
    });
}
