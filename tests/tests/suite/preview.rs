//! What a preview says is what a run does: the time of every move and wait to one sample, and no refusal at its start
//! that the preview kept quiet about.
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings};
use palpate_model::calibration::CalibrationCurve;
use palpate_model::random::SplitMix;
use palpate_model::rig::Limits;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_protocols::engine::EndingKind;
use palpate_protocols::plans::{
    FindContact, Hold, Jog, LoadTo, Plan, Ramp, Rest, Sine, Step, Unload,
};
use palpate_protocols::preview::{Preview, preview};
use palpate_tests::lab::{Lab, retract, set_up};

/// Random plans in the test suite: about ten seconds.
const PLANS: u64 = 30;

fn bench(seed: u64) -> (SimRig, CalibrationCurve) {
    let rig =
        SimRig::new(SimSettings { profile: SimProfile::Ideal, seed, ..SimSettings::default() });
    let curve = rig.calibration().curve().unwrap();
    (rig, curve)
}

fn plan(steps: Vec<Step>) -> Plan {
    let all = set_up(Seconds(1.0), FindContact::default());
    Plan::of("test", 1, all.into_iter().chain(steps).collect())
}

fn previewed(plan: &Plan) -> Preview {
    let (rig, curve) = bench(3);
    let limits = Limits::for_travel(rig.description().travel);
    preview(plan, rig.description(), &limits, &curve, false)
}

fn ran(plan: &Plan, seed: u64) -> Lab<SimRig> {
    let (rig, curve) = bench(seed);
    let mut lab = Lab::new(rig, curve, plan.clone());
    lab.run();
    lab
}

/// Whether a run finished, or why it ended or holds.
fn ending(lab: &Lab<SimRig>) -> Result<(), String> {
    match (&lab.outcome, lab.state().holding()) {
        (Some(outcome), _) if outcome.ending == EndingKind::Finish => Ok(()),
        (Some(outcome), _) => Err(outcome.reason.clone()),
        (None, holding) => Err(format!("{holding:?}")),
    }
}

/// Tick of the first sample at or behind a step, if the run came that far.
fn begin(lab: &Lab<SimRig>, step_index: usize) -> Option<u64> {
    let mut seen = lab.seen.iter();
    seen.find(|seen| seen.step_index >= step_index).map(|seen| seen.reading.tick)
}

/// Compares every stretch of steps whose time is known with the run; how many steps were compared.
fn compare(lab: &Lab<SimRig>, expected: &Preview, what: &str) -> usize {
    let tick = lab.rig.description().tick().0;
    let mut compared = 0;
    // Behind the last step there is no sample to tell its end.
    let last = lab.seen.last().unwrap().step_index;
    let mut first = 0;
    while first < last {
        let exact = expected.steps[first..last].iter();
        let count = exact.take_while(|step| step.is_exact).count();
        if count == 0 {
            let step = &expected.steps[first];
            if let (Some(from), Some(to)) = (begin(lab, first), begin(lab, first + 1)) {
                let took = (to - from) as f64 * tick;
                assert!(
                    took <= step.longest.0 + 2.0 * tick,
                    "{what}, step {first}: {took} s, {step:?}"
                );
            }
            first += 1;
            continue;
        }
        let known: f64 =
            expected.steps[first..first + count].iter().map(|step| step.expected.0 / tick).sum();
        let took = (begin(lab, first + count).unwrap() - begin(lab, first).unwrap()) as f64;
        assert!(
            (took - known).abs() <= 1.0 + 1e-6,
            "{what}, steps {first} to {}: {took} samples, {known} expected, {:#?}",
            first + count,
            &expected.steps[first..first + count]
        );
        compared += count;
        first += count;
    }
    compared
}

fn jog(distance_mm: f64) -> Step {
    Step::Jog(Jog { distance_mm, speed: MmPerS(1.5) })
}

fn ramp(depth: f64) -> Step {
    Step::Ramp(Ramp { speed: MmPerS(1.5), depth: Depth(depth) })
}

fn unload(clearance_mm: f64) -> Step {
    Step::Unload(Unload { speed: MmPerS(1.5), clearance_mm })
}

fn load(deepest: f64) -> Step {
    Step::LoadTo(LoadTo {
        speed: MmPerS(1.5),
        force: Newtons(0.5),
        depth_max: Depth(deepest),
        brake: None,
    })
}

#[test]
fn a_ramp_after_jogs_lasts_as_long_as_the_preview_says() {
    // 0.1 mm is six pulses and two thirds; a way out from 5 mm before contact leads no further in.
    let plan = plan(vec![
        jog(3.0),
        ramp(6.0),
        jog(-0.1),
        ramp(9.0),
        jog(-14.0),
        unload(0.0),
        jog(1.0),
        ramp(3.0),
        unload(1.5),
        retract(),
    ]);
    let expected = previewed(&plan);
    assert_eq!(expected.refusals, [] as [String; 0]);
    let lab = ran(&plan, 3);
    assert_eq!(ending(&lab), Ok(()));
    assert_eq!(compare(&lab, &expected, "jogs"), 10);
}

#[test]
fn depths_between_pulses_are_not_called_exact() {
    let expected = previewed(&plan(vec![ramp(6.0), ramp(10.0), unload(0.0), retract()]));
    let is_exact: Vec<bool> = expected.steps[4..].iter().map(|step| step.is_exact).collect();
    // 10 mm are 666.67 pulses, and contact is at none.
    assert_eq!(is_exact, [true, false, false, false]);
    // One pulse of 0.015 mm at 1.5 mm/s.
    let step = &expected.steps[5];
    assert!((step.longest.0 - step.expected.0).abs() < 0.011, "{step:?}");
}

#[test]
fn what_the_engine_refuses_at_its_start_the_preview_refuses_in_its_words() {
    let set_up = set_up(Seconds(1.0), FindContact::default());
    let bare = |steps: &[Step]| Plan::of("test", 1, steps.to_vec());
    let without = |left_out: usize| {
        let mut steps = set_up.clone();
        steps.remove(left_out);
        bare(&steps)
    };
    for (plan, wanted) in [
        (plan(vec![ramp(12.0), load(9.0)]), "9.00 mm"),
        (plan(vec![jog(8.4), load(7.5)]), "7.50 mm"),
        (without(1), "not homed"),
        (without(2), "tare"),
    ] {
        let refusals = previewed(&plan).refusals;
        assert!(refusals.len() == 1 && refusals[0].contains(wanted), "{refusals:?}");
        let (rig, curve) = bench(3);
        let mut lab = Lab::new(rig, curve, plan);
        lab.run();
        let reason = ending(&lab).unwrap_err();
        assert!(reason.contains(wanted), "{reason} {wanted}");
    }
    // The contact point is not known beforehand: what is beyond the travel even if it were at home is refused.
    let far = Sine { amplitude_mm: 90.0, frequency_hz: 0.005, cycles: 1 };
    for (step, wanted) in [(Step::Sine(far), "a sine to "), (jog(150.0), "a jog to ")] {
        let refusals = previewed(&plan(vec![ramp(12.0), step])).refusals;
        assert!(
            refusals.len() == 1
                && refusals[0].contains(wanted)
                && refusals[0].contains("travel of 0 to "),
            "{refusals:?}"
        );
    }
    // A load may bring the probe anywhere, so what follows is not refused for where it might be.
    let after_load = plan(vec![load(12.0), load(9.0)]);
    assert_eq!(previewed(&after_load).refusals, [] as [String; 0]);
}

fn between(random: &mut SplitMix, low: f64, high: f64) -> f64 {
    low + (high - low) * random.below(1 << 20) as f64 / f64::from(1 << 20)
}

/// A step of the kind whose time is known, at a place that no interlock minds, or one that ends by force.
fn any_step(random: &mut SplitMix) -> Step {
    // Half of all ways are whole pulses.
    let mut way = |low, high| {
        let mm = between(random, low, high);
        match random.below(2) {
            0 => (mm / 0.015).round() * 0.015,
            _ => mm,
        }
    };
    let (depth, aside, clearance) = (way(0.5, 12.0), way(-4.0, 3.0), way(0.0, 2.0));
    let speed = MmPerS((between(random, 0.6, 4.0) / 0.03).round() * 0.03);
    let span = Seconds(between(random, 0.0, 0.7));
    match random.below(9) {
        0 | 1 => Step::Jog(Jog { distance_mm: aside, speed }),
        2 | 3 => Step::Ramp(Ramp { speed, depth: Depth(depth) }),
        4 => Step::Unload(Unload { speed, clearance_mm: clearance }),
        5 => Step::Rest(Rest { duration: span }),
        6 => Step::Hold(Hold { duration: span, until: None, rate: None }),
        7 => Step::Sine(Sine {
            amplitude_mm: between(random, 0.1, 1.0),
            frequency_hz: between(random, 0.4, 1.0),
            cycles: 2,
        }),
        _ => load(between(random, 6.0, 25.0)),
    }
}

#[test]
fn random_plans_last_as_long_as_previewed_and_begin() {
    let (mut compared, mut refused, mut ended) = (0, 0, 0);
    for seed in 0..PLANS {
        let mut random = SplitMix::seeded(seed);
        let count = 4 + random.below(6);
        let mut steps: Vec<Step> = (0..count).map(|_| any_step(&mut random)).collect();
        steps.push(retract());
        let plan = plan(steps);
        let expected = previewed(&plan);
        if !expected.refusals.is_empty() {
            refused += 1;
            continue;
        }
        let lab = ran(&plan, seed);
        let what = format!("plan {seed}");
        compared += compare(&lab, &expected, &what);
        // Tissue may be softer than a force asks for; nothing else may stop a plan that was previewed as fine.
        if let Err(reason) = ending(&lab) {
            assert!(reason.contains("greater depth"), "{what}: {reason}");
        }
        ended += 1;
    }
    println!("{ended} plans ran, {refused} refused, {compared} steps compared");
    assert!(ended > PLANS / 2 && compared > 60, "{ended} ran, {compared} compared");
}

#[test]
fn storage_counts_samples_not_ticks() {
    let plan = plan(vec![retract()]);
    let (rig, curve) = bench(3);
    let limits = Limits::for_travel(rig.description().travel);
    let of = |tick_nanos, ticks_per_sample| {
        let mut about = rig.description().clone();
        (about.tick_nanos, about.ticks_per_sample) = (tick_nanos, ticks_per_sample);
        preview(&plan, &about, &limits, &curve, false).storage_bytes as f64
    };
    // A board that counts microseconds and samples every millisecond records as much as one that counts milliseconds. How long the
    // moves take differs by less than a tick each.
    let (of_ms, of_us) = (of(1_000_000, 1.0), of(1_000, 1000.0));
    assert!((of_us / of_ms - 1.0).abs() < 0.01, "{of_us} B, {of_ms} B");
}
