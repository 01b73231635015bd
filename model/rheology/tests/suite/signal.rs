//! Fits of what the load cell reported: a zero that wanders is measured, and what the caller fixed stays fixed.
use palpate_model::calibration::{Calibration, ForceUncertainty, HysteresisLoop, WeightStep};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds, Volts};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::expected::{Measurement, ProtocolPath};
use palpate_rheology::fit::{
    FitOptions, FitReport, FitSample, FitSolution, Signal, SignalRecord, TracedRecord,
    UnloadedMean, fit,
};
use palpate_test_support::record::{Noise, ramp_hold, respond};

const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;
/// White noise of one sample in V.
const NOISE_V: f64 = 1e-3;
/// Drift in V/s, three times the lab rig's largest.
const DRIFT: f64 = 1e-5;

/// A ramp and hold on a straight cell of 0.15 V/N whose zero drifts, with half a minute out of contact before and after.
fn record(seed: u64) -> (Vec<FitSample>, Signal) {
    record_read_with(seed, &straight())
}

fn straight() -> Calibration {
    Calibration::linear("straight", Volts(1.28), 0.15, Newtons(10.0))
}

/// The same cell, its forces read with another document.
fn record_read_with(seed: u64, document: &Calibration) -> (Vec<FitSample>, Signal) {
    let mut random = Noise::seeded(seed);
    let curve = straight().curve().unwrap();
    let zero = |t: f64| DRIFT * (t + 30.0);
    let mut samples = respond(&THESIS, &ramp_hold(0.75, 20.0, 0.01));
    let volts: Vec<f64> = samples
        .iter()
        .map(|one| {
            curve.volts_from_newtons(one.force).0 + zero(one.t.0) + NOISE_V * random.normal()
        })
        .collect();
    let curve = document.curve().unwrap();
    for (sample, volts) in samples.iter_mut().zip(&volts) {
        sample.force = curve.newtons_from_volts(Volts(*volts));
        sample.sigma = Newtons(NOISE_V / 0.15);
    }
    let end = samples[samples.len() - 1].t.0;
    let times = (0..120).map(|k| 0.25 * f64::from(k));
    let times = times.clone().map(|t| t - 30.0).chain(times.map(|t| end + 1.0 + t));
    let unloaded = times
        .map(|t| UnloadedMean {
            t: Seconds(t),
            volts: Volts(1.28 + zero(t) + NOISE_V / 5.0 * random.normal()),
            count: 25,
        })
        .collect();
    (
        samples,
        Signal {
            volts,
            unloaded,
            curve,
            hysteresis: None,
            contact_shift_mm: 0.0,
            contact_error_mm: 1e-3,
            search_secs: 20.0,
        },
    )
}

fn fitted(samples: &[FitSample], signal: &Signal, options: &FitOptions) -> FitReport {
    let record = SignalRecord { name: "one", samples, signal: Some(signal) };
    FitSolution::fit_signals(&[record], options, &[]).unwrap().report()
}

#[test]
fn steady_drift_bends_the_fit_of_forces_and_not_that_of_volts() {
    let (mut by_volts, mut by_forces) = (0.0, 0.0);
    for seed in 0..8 {
        let (samples, signal) = record(seed);
        let options = FitOptions::default();
        let error = |report: &FitReport| report.value("tau_eps").unwrap() / THESIS.tau_eps - 1.0;
        let report = fitted(&samples, &signal, &options);
        by_volts += error(&report).powi(2);
        by_forces += error(&fit(&samples, &options).unwrap()).powi(2);
        let z = (report.value("tau_eps").unwrap() - THESIS.tau_eps)
            / report.parameter("tau_eps").unwrap().std_error.unwrap();
        // Once in 30 000 by chance.
        assert!(z.abs() < 4.2, "seed {seed}: {z}");
    }
    assert!(by_volts < 0.5 * by_forces, "{by_volts} {by_forces}");
}

/// What a plan expects of a run like one that was fitted is what the fit of that run states, and how fits of other runs
/// scatter.
#[test]
fn expected_precision_is_what_a_fit_states_and_how_fits_scatter() {
    let options = FitOptions::default();
    let (samples, signal) = record(0);
    let run = SignalRecord { name: "known", samples: &samples, signal: Some(&signal) };
    let known = FitSolution::fit_signals(&[run], &options, &[]).unwrap();
    let expected_signal = known.expected_signal().unwrap();
    // The ramp and hold of `record`: 30 mm and 20 s.
    let path = ProtocolPath::ramp_hold(MmPerS(0.75), Depth(30.0), Seconds(20.0), 100.0);
    let expected = Measurement::Signal(&expected_signal).precision(&THESIS, &path).unwrap();
    let report = known.report();
    let mut squares = [0.0; 5];
    const RUNS: u64 = 40;
    for seed in 1..=RUNS {
        let (samples, signal) = record(seed);
        let found = fitted(&samples, &signal, &options);
        for (square, one) in squares.iter_mut().zip(&expected.parameters) {
            let error = found.value(one.name).unwrap() - one.value;
            *square += (error / one.std_error).powi(2);
        }
    }
    for (square, one) in squares.into_iter().zip(&expected.parameters) {
        // The noise of 6000 samples is known to 1 %, and samples are thinned.
        let stated = report.parameter(one.name).unwrap().std_error.unwrap();
        assert!((one.std_error / stated - 1.0).abs() < 0.03, "{}: {stated} {one:?}", one.name);
        // Chi-square of 40 degrees of freedom, once in 2000 by chance on each side.
        assert!((16.0..76.1).contains(&square), "{}: {square}", one.name);
    }
}

/// Samples are averaged before they are fitted, and the mean of a bent curve is not the curve of the mean.
#[test]
fn bends_of_the_curve_within_a_mean_move_no_parameter() {
    let curve = Calibration::thesis().curve().unwrap();
    let mut samples = respond(&THESIS, &ramp_hold(1.5, 20.0, 0.01));
    // So quiet that nothing but the averaging moves a parameter.
    let quiet = 1e-7;
    let mut random = Noise::seeded(1);
    let signal_of = |force: Newtons| curve.volts_from_newtons(force).0;
    let volts: Vec<f64> =
        samples.iter().map(|one| signal_of(one.force) + quiet * random.normal()).collect();
    for sample in &mut samples {
        sample.sigma = Newtons(quiet);
    }
    let unloaded = (0..120).map(|k| UnloadedMean {
        t: Seconds(0.25 * f64::from(k) - 31.0),
        volts: Volts(signal_of(Newtons(0.0)) + quiet / 5.0 * random.normal()),
        count: 25,
    });
    let signal = Signal {
        volts,
        unloaded: unloaded.collect(),
        curve: curve.clone(),
        hysteresis: None,
        contact_shift_mm: 0.0,
        contact_error_mm: 1e-3,
        search_secs: 20.0,
    };
    let found = fitted(&samples, &signal, &FitOptions::default());
    for (name, truth) in [("tau_eps", THESIS.tau_eps), ("tau_sig", THESIS.tau_sig)] {
        let error = found.value(name).unwrap() / truth - 1.0;
        println!("{name}: {error:e}");
        // A tenth of the standard uncertainty of two runs at two speeds, the best that is measured: 0.02 %.
        assert!(error.abs() < 2e-5, "{name}: {error:e}");
    }
}

#[test]
fn fixed_contact_position_stays_and_fixed_offset_fits_forces() {
    let (samples, signal) = record(3);
    let found = fitted(&samples, &signal, &FitOptions::default());
    let contact = found.parameter("x_contact").unwrap();
    assert!(!contact.is_fixed && contact.std_error.is_some_and(|error| error > 0.0));

    let mut fixed = FitOptions::default();
    fixed.fix("x_contact", 0.02).unwrap();
    let contact = fitted(&samples, &signal, &fixed).parameter("x_contact").unwrap().clone();
    assert!(contact.is_fixed, "{contact:?}");
    assert_eq!(contact.value, 0.02);

    let mut offset = FitOptions::default();
    offset.fix("f_offset", 0.003).unwrap();
    let of_forces = fit(&samples, &offset).unwrap();
    assert_eq!(fitted(&samples, &signal, &offset), of_forces);
}

#[test]
fn loop_of_a_load_cell_is_taken_out_of_its_signal() {
    let known = HysteresisLoop { half: Newtons(0.01), std_error: Newtons(0.0), range: (0.0, 10.0) };
    let (mut without, mut with) = (0.0, 0.0);
    for seed in 0..4 {
        let (samples, mut signal) = record(seed);
        // The force that a straight cell of 0.15 V/N feels, without noise and drift; it rises, then relaxes.
        let body = respond(&THESIS, &ramp_hold(0.75, 20.0, 0.01));
        let (mut before, mut side) = (0.0, 0.0f64);
        for (volts, one) in signal.volts.iter_mut().zip(&body) {
            let force = one.force.0;
            side = (side + (force - before) / 0.1).clamp(-1.0, 1.0);
            before = force;
            let share = 4.0 * (force / 10.0) * (1.0 - force / 10.0);
            *volts -= 0.15 * 0.01 * share * side;
        }
        let error = |signal: &Signal| {
            let report = fitted(&samples, signal, &FitOptions::default());
            report.value("tau_eps").unwrap() / THESIS.tau_eps - 1.0
        };
        without += error(&signal).powi(2);
        signal.hysteresis = Some(known);
        with += error(&signal).powi(2);
    }
    assert!(with < 0.1 * without, "{with} {without}");
}

/// Readings of a straight cell, written down with this digit in V, each wrong by up to a half of it.
fn coarse_document(seed: u64, digit: f64) -> Calibration {
    let mut random = Noise::seeded(1000 + seed);
    let steps = (0..=10).map(|k| {
        let mass_g = 102.0 * f64::from(k);
        let volts = 1.28 + 0.15 * 9.80665e-3 * mass_g;
        // Evenly spread, by the normal distribution's own rank.
        let error = digit * (random.normal().tanh() * 0.5);
        WeightStep { mass_g, volts: Volts(volts + error) }
    });
    Calibration {
        name: "coarse".into(),
        steps: steps.collect(),
        resolution: Some(Volts(digit)),
        ..Calibration::default()
    }
}

#[test]
fn total_interval_holds_the_truth_of_a_cell_whose_curve_is_known_badly() {
    let options = FitOptions::default();
    let (mut taken, mut found, mut held) = (0.0, 0.0, 0);
    for seed in 0..8 {
        let document = coarse_document(seed, 4e-3);
        let known = ForceUncertainty::of(&document).unwrap();
        let (samples, signal) = record_read_with(seed, &document);
        let record = SignalRecord { name: "one", samples: &samples, signal: Some(&signal) };
        let solution = FitSolution::fit_signals(&[record], &options, &[]).unwrap();
        let traced = TracedRecord {
            name: "one",
            samples: &samples,
            calibration: Some(("coarse", &known)),
            compliance: None,
        };
        let systematic = solution.systematic(&[traced]).unwrap().remove(0);
        let report = solution.report().with_systematic(&systematic);
        let tau = report.parameter("tau_eps").unwrap();
        let error = |value: f64| value / THESIS.tau_eps - 1.0;
        let holds = |[low, high]: [f64; 2]| low <= THESIS.tau_eps && THESIS.tau_eps <= high;
        let [low, high] = tau.total95.unwrap();
        assert!(holds([low, high]), "seed {seed}: {tau:?}");
        taken += error(tau.value).powi(2);
        found += error(0.5 * (low + high)).powi(2);
        held += usize::from(holds(tau.ci95.unwrap()));
        // The sources are those of the total interval.
        let budget: f64 = tau.budget.iter().map(|one| one.error.powi(2)).sum();
        let half = 0.5 * (high - low) / 1.96;
        assert!((budget.sqrt() / half - 1.0).abs() < 0.1, "{budget} {half} {tau:?}");
    }
    // The record knows more of the curve than the document does.
    assert!(found < 0.25 * taken && held < 8, "{found} {taken} {held}");
}

/// A ramp and hold on the straight cell, without steady drift: its zero takes a random walk of `walk` V per root of a second, and
/// the surface lies at `surface` mm of the depths that were recorded, which a touch found to within `contact_error_mm`.
fn uncertain_record(
    seed: u64,
    walk: f64,
    (surface, contact_error_mm): (f64, f64),
) -> (Vec<FitSample>, Signal) {
    let mut random = Noise::seeded(seed);
    let curve = straight().curve().unwrap();
    let (dt, out, speed, hold) = (0.01, 30.0, 0.75, 20.0);
    // Out of contact, a press that begins half a millimetre above the surface, out of contact again.
    let above = 0.5;
    let press = ((30.0 + above) / speed + hold) / dt;
    let samples_out = (out / dt) as usize;
    let path: Vec<(f64, f64)> = (0..=press as usize)
        .map(|k| (dt * k as f64, (speed * dt * k as f64 - above).min(30.0)))
        .collect();
    let tissue: Vec<(f64, f64)> = path.iter().map(|(t, depth)| (*t, depth.max(0.0))).collect();
    let mut zero = 0.0;
    let mut signal_of = |force: Newtons| {
        zero += walk * f64::sqrt(dt) * random.normal();
        curve.volts_from_newtons(force).0 + zero + NOISE_V * random.normal()
    };
    let mut unloaded = Vec::new();
    let mut see_zero = |start: f64, signal_of: &mut dyn FnMut(Newtons) -> f64| {
        for k in 0..samples_out / 25 {
            let sum: f64 = (0..25).map(|_| signal_of(Newtons(0.0))).sum();
            let t = Seconds(start + 0.25 * k as f64 + 12.0 * dt);
            unloaded.push(UnloadedMean { t, volts: Volts(sum / 25.0), count: 25 });
        }
    };
    see_zero(-out, &mut signal_of);
    let mut samples = respond(&THESIS, &tissue);
    let volts: Vec<f64> = samples.iter().map(|one| signal_of(one.force)).collect();
    let end = samples[samples.len() - 1].t.0;
    see_zero(end + dt, &mut signal_of);
    for ((sample, volts), (_, depth)) in samples.iter_mut().zip(&volts).zip(&path) {
        sample.depth = Depth(depth + surface);
        sample.force = curve.newtons_from_volts(Volts(*volts));
        sample.sigma = Newtons(NOISE_V / 0.15);
    }
    let signal = Signal {
        volts,
        unloaded,
        curve,
        hysteresis: None,
        contact_shift_mm: 0.0,
        contact_error_mm,
        search_secs: 20.0,
    };
    (samples, signal)
}

const RUNS: u64 = 40;
/// Of 40 intervals that each hold the truth with a probability of 95 %, fewer than this do once in 1500 times.
const HELD_MIN: usize = 33;

/// Of each parameter of the body and of the contact position: intervals of 95 % that hold the truth, squares of errors in stated
/// standard errors, and the mean of these.
fn held_of(
    of: impl Fn(u64) -> ((Vec<FitSample>, Signal), f64),
) -> Vec<(&'static str, usize, f64, f64)> {
    let [mu1, mu2, mu3] = THESIS.mu;
    let truth = [
        ("tau_eps", THESIS.tau_eps),
        ("mu1", mu1),
        ("mu2", mu2),
        ("mu3", mu3),
        ("tau_sig", THESIS.tau_sig),
        ("x_contact", 0.0),
    ];
    let mut found: Vec<_> = truth.iter().map(|(name, _)| (*name, 0, 0.0, 0.0)).collect();
    for seed in 0..RUNS {
        let ((samples, signal), surface) = of(seed);
        let report = fitted(&samples, &signal, &FitOptions::default());
        for ((name, value), (_, held, squares, stated)) in truth.into_iter().zip(&mut found) {
            let value = if name == "x_contact" { surface } else { value };
            let one = report.parameter(name).unwrap();
            let ([low, high], error) = (one.ci95.unwrap(), one.std_error.unwrap());
            *held += usize::from((low..=high).contains(&value));
            *squares += ((one.value - value) / error).powi(2);
            *stated += error / RUNS as f64;
        }
    }
    found
}

#[test]
fn intervals_hold_the_truth_under_a_zero_that_wanders() {
    // Over a second about as far as the mean of its hundred samples is uncertain.
    let walk = 1e-4;
    // The surface is where it was found.
    let found = held_of(|seed| (uncertain_record(seed, walk, (0.0, 1e-3)), 0.0));
    println!("{found:?}");
    for (name, held, squares, _) in found.into_iter().take(5) {
        // Chi-square of 40 degrees of freedom, once in 2000 by chance on each side.
        assert!((16.0..76.1).contains(&squares), "{name}: {squares}");
        assert!(held >= HELD_MIN, "{name}: {held} of {RUNS}");
    }
}

#[test]
fn intervals_hold_the_truth_of_a_contact_position_that_is_known_badly() {
    // About as well as the record alone knows it.
    let error = 4e-3;
    let found = held_of(|seed| {
        let surface = error * Noise::seeded(500 + seed).normal();
        (uncertain_record(seed, 0.0, (surface, error)), surface)
    });
    println!("{found:?}");
    for (name, held, squares, _) in &found {
        assert!((16.0..76.1).contains(squares), "{name}: {squares}");
        assert!(*held >= HELD_MIN, "{name}: {held} of {RUNS}");
    }
    // Both together know it better than either.
    let stated = found[5].3;
    assert!((0.6 * error..0.95 * error).contains(&stated), "{stated}");
}
