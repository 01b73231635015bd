//! Cycles and a sine on the simulated rig, analysed as a user's record is.

use palpate_analysis::cycles::CycleSource;
use palpate_analysis::report::cycles::{CycleReport, CycleSettings, cycles_text, picture};
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings};
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::KelvinState;
use palpate_protocols::engine::EndingKind;
use palpate_protocols::plans::{
    FindContact, Hold, Plan, PlannedStep, Ramp, Rest, Sine, Step, Unload,
};
use palpate_rheology::cycles::{CycleSample, fit_sinusoid};
use palpate_tests::lab::{Lab, retract, set_up};
fn rig(percent: u8) -> SimRig {
    SimRig::new(SimSettings {
        profile: SimProfile::Ideal,
        seed: 3,
        preconditioning: percent.to_string().parse().unwrap(),
        ..SimSettings::default()
    })
}

fn plan(steps: impl IntoIterator<Item = PlannedStep>) -> Plan {
    let mut plan = Plan::of("test", 1, set_up(Seconds(1.0), FindContact::default()));
    plan.steps.extend(steps);
    plan.steps.push(retract().into());
    plan
}

fn run(rig: SimRig, plan: Plan) -> Lab<SimRig> {
    let curve = rig.calibration().curve().unwrap();
    let mut lab = Lab::new(rig, curve, plan);
    lab.run();
    let outcome = lab.outcome.clone();
    let outcome = outcome.unwrap_or_else(|| panic!("{:?}", lab.state().holding()));
    assert_eq!(outcome.ending, EndingKind::Finish, "{}", outcome.reason);
    lab
}

fn samples(lab: &Lab<SimRig>) -> Vec<CycleSample> {
    lab.seen
        .iter()
        .filter_map(|seen| {
            Some(CycleSample {
                t: Seconds(seen.reading.tick as f64 * 1e-3),
                depth: seen.derived.depth?,
                force: seen.derived.force?,
                phase: seen.phase,
                cycle: seen.cycle,
                step: seen.step_index as u32,
            })
        })
        .collect()
}

/// Ten cycles to 25 mm at 3 mm/s, each followed by a rest of 20 s.
fn ten_cycles() -> impl Iterator<Item = PlannedStep> {
    let ramp = Step::Ramp(Ramp { speed: MmPerS(3.0), depth: Depth(25.0) });
    let unload = Step::Unload(Unload { speed: MmPerS(3.0), clearance_mm: 0.5 });
    let rest = Step::Rest(Rest { duration: Seconds(20.0) });
    (1..=10).flat_map(move |cycle| {
        [ramp.clone(), unload.clone(), rest.clone()]
            .map(|step| PlannedStep { cycle, ..step.into() })
    })
}

#[test]
fn a_preconditioned_specimen_becomes_steady_and_an_elastic_one_is() {
    let report = |percent: u8| {
        let lab = run(rig(percent), plan(ten_cycles()));
        let source = CycleSource { samples: samples(&lab), ..CycleSource::default() };
        let name = format!("ten cycles, preconditioning {percent} %");
        CycleReport::of(name, source, &CycleSettings::default())
    };
    let (soft, plain) = (report(10), report(0));
    println!("{}\n\n{}", cycles_text(&soft), cycles_text(&plain));
    let to = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("cycles.svg");
    std::fs::write(&to, picture(&soft)).unwrap();
    assert_eq!((soft.cycles.len(), plain.cycles.len()), (10, 10));
    let changes = &soft.steadiness.changes;
    for (index, change) in changes.iter().enumerate() {
        let shift = change.shift.unwrap().0;
        // Later ones drown in the noise of a peak, some 5 mN, and of a place, some 15 um.
        let is_early = index < 4;
        assert!(!is_early || (change.peak_percent < -0.1 && shift > 0.02), "{change:?}");
        assert!(change.peak_percent < 0.5 && shift > -0.08, "{change:?}");
    }
    let first_three: Vec<f64> = changes[..3].iter().map(|one| one.shift.unwrap().0).collect();
    assert!(first_three.is_sorted_by(|one, next| one > next), "{first_three:?}");
    assert!((4..=9).contains(&soft.steadiness.steady_from.unwrap()));
    // Without it only the first loop meets tissue that the search for contact has not just left.
    assert!(plain.steadiness.steady_from.unwrap() <= 2);
    // Loops keep part of the energy, and the first pays for what is rearranged in it.
    assert!(soft.cycles.iter().all(|one| (0.1..1.0).contains(&one.loss_share().unwrap())));
    assert!(soft.cycles[0].work_loop.unwrap() > soft.cycles[9].work_loop.unwrap());
}

#[test]
fn a_sine_finds_the_stiffness_of_the_body() {
    let frequency = 0.5;
    let steps = [
        Step::Ramp(Ramp { speed: MmPerS(3.0), depth: Depth(18.0) }),
        Step::Hold(Hold { duration: Seconds(10.0), until: None, rate: None }),
        Step::Sine(Sine { amplitude_mm: 0.75, frequency_hz: frequency, cycles: 10 }),
    ];
    let lab = run(rig(0), plan(steps.map(PlannedStep::from)));
    let all = samples(&lab);
    let measured: Vec<CycleSample> =
        all.iter().filter(|one| one.phase == Phase::Sine).copied().collect();
    let found = fit_sinusoid(&measured, frequency).unwrap();
    println!("{found:?}");
    // The same body on the same path from the true surface, without noise.
    let (body, surface) = (lab.rig.truth().body, lab.rig.truth().surface_counted());
    let contact = lab.state().contact().unwrap().position;
    let missed = surface.distance_from(contact);
    let mut state = KelvinState::at_rest_from(Depth(-1.0));
    let mut before = all[0].t.0;
    let exact: Vec<CycleSample> = all
        .iter()
        .map(|one| {
            let dt = Seconds(one.t.0 - before);
            before = one.t.0;
            let force = state.step(&body, Depth(one.depth.0 - missed), dt);
            CycleSample { force, ..*one }
        })
        .filter(|one| one.phase == Phase::Sine)
        .collect();
    let exact = fit_sinusoid(&exact, frequency).unwrap();
    assert!(exact.storage.value > 0.1 && exact.loss.value > 0.05, "{exact:?}");
    for (one, other) in [(found.storage, exact.storage), (found.loss, exact.loss)] {
        let miss = (one.value - other.value).abs();
        assert!(miss < 4.0 * one.std_error, "{miss} {one:?}");
        assert!(one.std_error < 0.01 * exact.storage.value);
    }
    assert!((found.force_mean.0 - exact.force_mean.0).abs() < Newtons(0.02).0);
}
