//! The whole tick: contact (L8), calibration (L9), transparency (G4), replay, snapshots, allocations, and the two
//! demonstrations.

use palpate_haptics::check::{FeedbackCheckSettings, calibration_points, check};
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_haptics::simulation::{Simulation, SimulationSettings};
use palpate_haptics::{
    BiasCalibration, BiasPoint, ContactDetector, ContactSettings, DriveKind, Flags, ForceGuard,
    GuardSettings, LawSettings, MasterSlave, MasterSlaveInput, MasterSlaveSettings, Period,
    TorqueSettings,
};
use palpate_model::random::SplitMix;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, Newtons, Seconds, Volts};

const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;

fn input(counts: i64, cell: f64) -> MasterSlaveInput {
    MasterSlaveInput { counts, elapsed: 1, cell: Newtons(cell), slave_pulses: None, is_on: true }
}

/// L8: a force at the threshold with noise: contact comes and goes hundreds of times a second without hysteresis and not
/// at all with one as wide as the noise; the force never steps by more than the limit.
#[test]
fn hysteresis_as_wide_as_the_noise_keeps_contact() {
    let sigma = 0.01;
    let mut random = SplitMix::seeded(23);
    let noise: Vec<f64> = (0..20_000).map(|_| sigma * random.normal()).collect();
    let peak_to_peak = noise.iter().fold(f64::MIN, |a, b| a.max(*b))
        - noise.iter().fold(f64::MAX, |a, b| a.min(*b));
    let mut rates = Vec::new();
    for width in [0.0, sigma, 2.0 * sigma, 3.0 * sigma, peak_to_peak] {
        let settings =
            ContactSettings { on: Newtons(0.2 + 0.5 * width), off: Newtons(0.2 - 0.5 * width) };
        let mut contact = ContactDetector::new(settings.checked().expect("thresholds"));
        let mut guard = ForceGuard::new(&GuardSettings::default(), Period::MILLISECOND);
        let (mut last, mut changes) = (0.0, 0u32);
        for one in &noise {
            let before = contact.is_touching();
            contact.tick(Newtons(0.2 + one));
            changes += u32::from(contact.is_touching() != before);
            let force = guard.tick(Newtons(3.0), contact.is_touching(), 1).force.0;
            assert!((force - last).abs() <= 0.5 + 1e-12);
            last = force;
        }
        let rate = f64::from(changes) / 20.0;
        rates.push(rate);
        println!("L8: hysteresis of {:.1} sigma: {rate:.2} changes a second", width / sigma);
    }
    assert!(rates[0] > 100.0 && rates.windows(2).all(|pair| pair[1] < pair[0]) && rates[4] < 2.0);
    assert!(ContactSettings { on: Newtons(0.1), off: Newtons(0.2) }.checked().is_err());
    let mut contact = ContactDetector::new(ContactSettings::above_noise(Newtons(sigma)));
    contact.tick(Newtons(1.0));
    assert!(contact.tick(Newtons(f64::NAN)) == Flags::CELL && contact.is_touching());
}

/// A motor that is straight but for friction, a ceiling and noise, measured up and down.
fn measured(
    slope: f64,
    offset: f64,
    friction: f64,
    ceiling: f64,
    noise: f64,
    seed: u64,
) -> Vec<BiasPoint> {
    let mut random = SplitMix::seeded(seed);
    let mut points = Vec::new();
    for is_rising in [true, false] {
        for i in 0..=60 {
            let bias = 0.05 * f64::from(i);
            let against = if is_rising { friction } else { -friction };
            let force = (offset + slope * bias - against).max(0.0).min(ceiling);
            points.push(BiasPoint {
                bias: Volts(bias),
                force: Newtons(force + noise * random.normal()),
                is_rising,
            });
        }
    }
    points
}

/// L9: slope within its interval, dead band, ceiling and hysteresis found.
#[test]
fn a_calibration_finds_slope_dead_band_ceiling_and_hysteresis() {
    let (slope, friction, ceiling) = (5.25, 0.81, 12.0);
    let (mut within, mut count) = (0, 0);
    for seed in 0..100 {
        let fit = BiasCalibration::fit(&measured(slope, 0.0, friction, ceiling, 0.05, seed))
            .expect("a line");
        within += u32::from((fit.slope - slope).abs() < 2.0 * fit.slope_error);
        count += 1;
        assert!((fit.slope - slope).abs() < 5.0 * fit.slope_error, "{seed}: {fit:?}");
        assert!((fit.residual / 0.05 - 1.0).abs() < 0.35, "{seed}: {}", fit.residual);
        assert!(
            fit.rising.dead.is_some()
                && (fit.rising.ceiling.expect("a ceiling").0 - ceiling).abs() < 0.05
        );
        let falling = fit.falling.expect("the way down");
        assert!(falling.dead.is_none() && falling.ceiling.is_some());
        // Up and down are apart by twice the friction, and the dead band ends at 0.81 N over 5.25 N/V.
        assert!(
            (falling.offset - fit.rising.offset - 2.0 * friction).abs() < 0.08,
            "{seed}: {fit:?}"
        );
        assert!(
            (-fit.rising.offset / fit.slope - friction / slope).abs() < 0.03,
            "{seed}: {fit:?}"
        );
    }
    // 95 of 100 within two standard errors; 88 is three and a half standard deviations fewer.
    println!("L9: slope within two standard errors in {within} of {count}");
    assert!(within >= 88);
}

#[test]
fn a_calibration_that_tells_nothing_is_refused() {
    let refusal =
        |points: &[BiasPoint]| BiasCalibration::fit(points).expect_err("no line").to_string();
    assert!(refusal(&measured(0.0, 1.0, 0.0, 9.0, 0.05, 1)).contains("does not rise"));
    assert!(refusal(&measured(5.0, 0.0, 0.0, 99.0, 0.0, 1)[..4]).contains("4 points"));
    let mut bad = measured(5.0, 0.0, 0.0, 99.0, 0.0, 1);
    bad[7].force = Newtons(f64::NAN);
    assert!(refusal(&bad).contains("point 8"));
    // Straight throughout: no dead band, no ceiling, exact.
    let fit = BiasCalibration::fit(&measured(5.0, 0.3, 0.0, 99.0, 0.0, 1)).expect("a line");
    assert!(
        (fit.slope - 5.0).abs() < 1e-9 && fit.rising.dead.is_none() && fit.rising.ceiling.is_none()
    );
    let falling = fit.falling.expect("the way down");
    assert!((falling.offset - fit.rising.offset).abs() < 1e-9 && fit.rising.offset > 0.0);
}

/// The thesis's figure: a slider pushes the rack at 0.75 mm/s to 30 mm and holds; commanded torque and measured force
/// follow each other, apart by the motor's friction and, on a voltage drive, by its damping.
#[test]
fn commanded_torque_and_measured_force_follow_each_other() {
    for (drive, share, apart) in [
        (DriveKind::Voltage { gain: 1.0 }, 0.0, 0.81 + 0.0132),
        (DriveKind::Current { amps_per_volt: 1.0 }, 0.0, 0.81),
        (DriveKind::Current { amps_per_volt: 1.0 }, 1.0, 0.0),
    ] {
        let settings = FeedbackCheckSettings {
            drive,
            friction_share: share,
            ..FeedbackCheckSettings::source(THESIS)
        };
        let mut samples = Vec::new();
        let mut done = 0.0;
        check(&settings, |one| samples.push(*one), |share| done = share).expect("a check");
        assert!(samples.len() == 1800 && done > 0.999);
        let peak = samples.iter().map(|one| one.commanded.0).fold(0.0, f64::max);
        let last = samples[samples.len() - 1];
        // 6.396 N at the end of the ramp, 5.591 N at the end of the hold; the slider gives way by a few hundredths of a mm
        // of 30, the slave counts 15 um.
        println!(
            "{drive:?}, {share} of friction taken off: peak {peak:.3} N, end {:.3} N",
            last.commanded.0
        );
        assert!(
            (peak - 6.396).abs() < 0.1 && (last.commanded.0 - 5.591).abs() < 0.1,
            "{peak} {last:?}"
        );
        // On the ramp, beyond the first millimetres.
        let ramp = samples.iter().filter(|one| (10.0..39.9).contains(&one.t.0));
        let gaps: Vec<f64> = ramp.map(|one| one.measured.0 - one.commanded.0).collect();
        let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
        assert!((mean - apart).abs() < 0.03, "{drive:?} {share}: apart by {mean}, not {apart}");
        let spread =
            (gaps.iter().map(|gap| (gap - mean).powi(2)).sum::<f64>() / gaps.len() as f64).sqrt();
        assert!(spread < 0.15, "{spread}");
        // Torque is force times the radius of 10 mm, up to what compensation takes off.
        assert!((last.torque / 10.0 - last.commanded.0).abs() < 0.82);
        let fit =
            BiasCalibration::fit(&calibration_points(&samples, Seconds(40.0))).expect("a line");
        let newtons_per_volt = match drive {
            DriveKind::Voltage { .. } => 5.25,
            DriveKind::Current { .. } => 3.36,
        };
        println!(
            "  {:.3} N/V, {:.3} by the catalogue, residual {:.3} N",
            fit.slope, newtons_per_volt, fit.residual
        );
        assert!((fit.slope / newtons_per_volt - 1.0).abs() < 0.03, "{fit:?}");
    }
}

#[test]
fn a_check_that_cannot_be_is_refused() {
    let right = FeedbackCheckSettings::source(THESIS);
    for (wrong, words) in [
        (FeedbackCheckSettings { speed: palpate_model::MmPerS(0.0), ..right }, "speed = 0"),
        (FeedbackCheckSettings { depth: Depth(f64::NAN), ..right }, "depth = NaN"),
        (FeedbackCheckSettings { hold: Seconds(f64::NAN), ..right }, "hold = NaN"),
        (FeedbackCheckSettings { hold: Seconds(f64::INFINITY), ..right }, "duration = inf"),
        (FeedbackCheckSettings { samples_hz: 0.0, ..right }, "samples = 0"),
        (FeedbackCheckSettings { friction_share: -1.0, ..right }, "share of friction"),
    ] {
        let message = check(&wrong, |_| (), |_| ()).expect_err("no check").to_string();
        assert!(message.contains(words), "{words}: {message}");
    }
}

/// The thesis body as it buzzes, or not: pressed to 25 mm by a firm grip that wants to 30, on a current drive without
/// friction, with an encoder of 15 um, forces two ticks of a millisecond late, and 0.5 N s/m of damping where 3.5 are
/// needed. Unguarded, the force is bounded by nothing but the drive and there is no controller. With the source's
/// voltage drive, which brings 17.6 N s/m and 0.8 N of friction, it is calm at that depth by itself.
fn buzzing(is_guarded: bool) -> SimulationSettings {
    let path = HandPath::RampHold { from: 0.0, to: 30.0, speed: 50.0 };
    // Less damping than a firm grip has when it is asked to calm something.
    let hand = SimulatedHand { damping: 0.002, ..SimulatedHand::firm(path) };
    let mut all = SimulationSettings::of(THESIS, Period::MILLISECOND, hand);
    let (delay, damping) = (2, 0.5e-3);
    all.plant.friction = [0.0; 2];
    all.plant.damping = damping;
    all.plant.delay = delay;
    all.system.damping = damping;
    all.system.delay_ticks = delay as f64;
    all.system.torque =
        TorqueSettings { drive: DriveKind::Current { amps_per_volt: 1.0 }, ..all.system.torque };
    all.system.torque.motor.friction = 0.0;
    if let Some((motor, _)) = &mut all.plant.motor {
        motor.friction = 0.0;
    }
    if is_guarded { all } else { all.unguarded() }
}

/// Without guard the thesis body buzzes on a device with less damping than it needs; with it, it does not. The margin
/// knew before.
#[test]
fn the_thesis_body_buzzes_without_guard_and_not_with_it() {
    let mut swings = Vec::new();
    for is_guarded in [false, true] {
        let settings = buzzing(is_guarded);
        let verdict =
            settings.system.watch().assess_stroke(Depth(30.0), palpate_model::MmPerS(0.0));
        assert!(!verdict.is_calm());
        let there =
            settings.system.watch().exact_margin_at(Depth(25.0), palpate_model::MmPerS(0.0));
        assert!((there.needed * 1e3 - 3.55).abs() < 0.01, "{there:?}");
        let mut simulation = Simulation::new(&settings).expect("a simulation");
        let (mut buzzes, mut low, mut high, mut hz) = (0u32, f64::MAX, f64::MIN, 0.0);
        let mut stepped = 0.0f64;
        let mut last = 0.0;
        for _ in 0..8000 {
            let one = simulation.tick();
            let snapshot = one.snapshot;
            stepped = stepped.max((snapshot.guarded.0 - last).abs());
            last = snapshot.guarded.0;
            if one.t.0 > 6.0 {
                buzzes += u32::from(snapshot.flags.has(Flags::BUZZ));
                (low, high) = (low.min(one.x), high.max(one.x));
                hz = snapshot.buzz.map_or(hz, |buzz| buzz.frequency_hz);
            }
        }
        println!(
            "guarded {is_guarded}: swing {:.2} mm, buzz in {buzzes} of 2000 ticks at {hz:.1} Hz",
            high - low
        );
        if is_guarded {
            assert!(stepped <= 0.5 + 1e-12);
            assert!(buzzes == 0);
        } else {
            assert!(buzzes > 1000);
        }
        swings.push(high - low);
    }
    // What is left with the guard is the tissue's creep under the hand.
    assert!(swings[0] > 5.0 && swings[1] < 0.3, "{swings:?}");
    // The source's own drive, unguarded and as late, damps enough.
    let mut settings = buzzing(false);
    let source = MasterSlaveSettings::of(settings.system.law).torque;
    settings.system.torque = source;
    settings.plant.motor = Some((source.motor, source.pinion));
    settings.plant.friction = [source.friction().0; 2];
    let mut simulation = Simulation::new(&settings).expect("a simulation");
    for _ in 0..8000 {
        assert!(!simulation.tick().output.flags.has(Flags::BUZZ));
    }
}

/// G4: a slave that is late by `tau` follows a ramp `v tau` behind; what the hand feels of a spring turns by `w tau` and
/// half a tick, and keeps its size.
#[test]
fn a_late_slave_lags_and_turns_the_impedance() {
    let stiffness = 0.3;
    let body = ModifiedKelvin { tau_eps: 1e-6, mu: [stiffness, 0.0, 0.0], tau_sig: 0.0 };
    let settings = MasterSlaveSettings {
        guard: GuardSettings::OPEN,
        controller: None,
        ..MasterSlaveSettings::of(LawSettings::of::<3>(body, Period::MILLISECOND))
    };
    let count = settings.count_mm();
    for late in [0usize, 5, 20] {
        let run =
            |place: &dyn Fn(f64) -> f64, ticks: usize, seen: &mut dyn FnMut(f64, f64, f64)| {
                let mut system = MasterSlave::new(&settings).expect("a system");
                let mut sent = vec![0i64];
                let _ = system.tick(&input(0, 1.0));
                for i in 1..ticks {
                    let t = i as f64 * 1e-3;
                    let counts = (place(t) / count).round() as i64;
                    // The slave is where it was sent so many ticks before; with no delay where it is sent now.
                    let reported = (late > 0).then(|| sent[sent.len().saturating_sub(late)]);
                    let one = MasterSlaveInput { slave_pulses: reported, ..input(counts, 1.0) };
                    let output = system.tick(&one);
                    let snapshot = system.snapshot();
                    sent.push(snapshot.pulses);
                    seen(t, snapshot.master_mm - snapshot.depth.0, output.force.0);
                }
            };
        let mut behind = 0.0;
        run(&|t| 20.0 * t, 1000, &mut |_, lag, _| behind = lag);
        // Half a pulse and half a count.
        assert!((behind - 20.0 * late as f64 * 1e-3).abs() < 0.016, "{late}: {behind}");
        for hz in [1.0, 2.0, 5.0, 10.0, 20.0] {
            let w = std::f64::consts::TAU * hz;
            let place = move |t: f64| 8.0 - 4.0 * (w * t).cos();
            let (mut sine, mut cosine) = (0.0, 0.0);
            // Three seconds are whole cycles of all; the first second settles.
            run(&place, 4000, &mut |t, _, force| {
                if t >= 0.9995 {
                    sine += force * (w * t).sin() / 1500.0;
                    cosine += force * (w * t).cos() / 1500.0;
                }
            });
            let size = sine.hypot(cosine) / (4.0 * stiffness);
            let turned = (-sine).atan2(-cosine);
            let expected = w * late as f64 * 1e-3;
            println!(
                "G4: {late} ms late, {hz} Hz: |Zt/Ze| {size:.4}, turned by {:.2} degrees",
                turned.to_degrees()
            );
            assert!((size - 1.0).abs() < 0.01, "{size}");
            let miss = (turned - expected).rem_euclid(std::f64::consts::TAU);
            assert!(
                miss.min(std::f64::consts::TAU - miss) < 0.01,
                "{late} {hz}: {turned} {expected}"
            );
        }
    }
}

/// L11 of the whole: the loop stalls with the hand moving in; back again, the bias begins at what the drive held, rises as
/// the ramp says and never steps by more than the limit. Switched off and on, it starts softly.
#[test]
fn stalls_and_switches_of_the_whole_are_ramped() {
    let hand = SimulatedHand::firm(HandPath::RampHold { from: 0.0, to: 25.0, speed: 50.0 });
    let settings = SimulationSettings::of(THESIS, Period::MILLISECOND, hand);
    let step = 0.5 * settings.system.torque.volts_per_newton() + 20.0 / 4096.0;
    let mut simulation = Simulation::new(&settings).expect("a simulation");
    let mut last = 0.0;
    for i in 0..1500 {
        let one =
            if (300..450).contains(&i) { simulation.tick_stalled() } else { simulation.tick() };
        let bias = one.output.bias.0;
        assert!((bias - last).abs() <= step, "tick {i}: from {last} V to {bias} V");
        assert_eq!(one.snapshot.flags.has(Flags::STALL), (450..699).contains(&i), "{i}");
        last = bias;
    }
    assert!(simulation.system().snapshot().force.0 > 1.0);
    let mut system = *simulation.system();
    let one = MasterSlaveInput { counts: system.snapshot().counts, ..input(0, 1.0) };
    for i in 0..400 {
        let before = system.snapshot().force.0;
        let is_on = i > 100;
        let output = system.tick(&MasterSlaveInput { is_on, ..one });
        assert!((output.force.0 - before).abs() <= 0.5 + 1e-12);
        assert_eq!(output.flags.has(Flags::OFF), !is_on);
        assert_eq!(output.flags.has(Flags::SOFT_START), is_on);
        assert!(i != 100 || output.force.0 == 0.0);
    }
}

/// Calm play is not disturbed: on the source's rig, whose drive damps and rubs, a poke in and out is felt as the model has it
/// and the controller does next to nothing.
#[test]
fn calm_play_is_left_alone() {
    let hand = SimulatedHand::firm(HandPath::Sine { middle: 10.0, amplitude: 12.0, hz: 0.5 });
    let mut settings = SimulationSettings::of(THESIS, Period::MILLISECOND, hand);
    settings.plant.x = -2.0;
    settings.system.surface_mm = 2.0;
    let mut simulation = Simulation::new(&settings).expect("a simulation");
    let (mut acted, mut differ) = (0u32, 0.0f64);
    for _ in 0..8000 {
        let one = simulation.tick();
        acted += u32::from(one.output.flags.has(Flags::PASSIVITY));
        if one.t.0 > 2.0 && one.snapshot.is_touching {
            differ = differ.max((one.snapshot.force.0 - one.snapshot.guarded.0).abs());
        }
        assert!(!one.output.flags.has(Flags::BUZZ), "{one:?}");
    }
    println!("controller in {acted} of 8000 ticks, by {differ:.3} N at most");
    assert!(acted < 80 && differ < 0.1);
}

/// Commands above what the motor may give for long heat it; too hot, it gets no more than that until it has cooled.
#[test]
fn a_hot_winding_gets_what_it_may_have_for_long() {
    let body = ModifiedKelvin { tau_eps: 0.01, mu: [2.0, 0.0, 0.0], tau_sig: 0.0 };
    let mut settings = MasterSlaveSettings {
        guard: GuardSettings { force_max: Newtons(40.0), ..GuardSettings::default() },
        controller: None,
        ..MasterSlaveSettings::of(LawSettings::of::<3>(body, Period::MILLISECOND))
    };
    settings.law.force_max = Newtons(40.0);
    let mut system = MasterSlave::new(&settings).expect("a system");
    let (mut hottest, mut first_hot) = (0.0f64, None);
    let mut last = 0.0;
    // 15 mm of 2 N/mm: 30 N, three times what it may give for long, for ten minutes.
    for i in 0..600_000u64 {
        let counts = (i as i64).min(978);
        let output = system.tick(&input(counts, 1.0));
        let snapshot = system.snapshot();
        hottest = hottest.max(snapshot.winding_c);
        if i > 2000 && first_hot.is_none() {
            assert!(output.flags.has(Flags::CONTINUOUS) && output.force.0 > 29.0);
            first_hot = output.flags.has(Flags::HOT).then_some(i);
            last = output.force.0;
        }
        assert!((output.force.0 - last).abs() <= 0.5 + 1e-12 || i <= 2000);
        last = output.force.0;
    }
    let seconds = first_hot.expect("it got hot") as f64 * 1e-3;
    // 30 N are 8.9 A and 51 W: the winding alone would settle 128 K above its case, with 50 s.
    println!("hot after {seconds:.1} s, {hottest:.2} degrees at most");
    assert!((20.0..80.0).contains(&seconds) && hottest < 126.0);
}

/// A voltage drive drags a hand by 1.8 N at 0.1 m/s in free air, a current drive by its friction alone; energies of motor
/// and hand balance to rounding (L7).
#[test]
fn a_voltage_drive_drags_and_a_current_drive_does_not() {
    for (drive, expected) in [
        (DriveKind::Voltage { gain: 1.0 }, 0.81 + 1.764),
        (DriveKind::Current { amps_per_volt: 1.0 }, 0.81),
    ] {
        let hand = SimulatedHand::firm(HandPath::RampHold { from: -100.0, to: 0.0, speed: 100.0 });
        let mut settings = SimulationSettings::of(THESIS, Period::MILLISECOND, hand);
        settings.plant.x = -100.0;
        settings.system.surface_mm = 200.0;
        settings.system.torque.drive = drive;
        let mut simulation = Simulation::new(&settings).expect("a simulation");
        let drag = (0..900).map(|_| simulation.tick().hand.0).last().expect("ticks");
        let plant = simulation.plant();
        let energies = plant.rack.energies;
        let residual = energies.motor + energies.hand
            - energies.damping
            - energies.friction
            - plant.rack.kinetic();
        println!(
            "{drive:?}: {drag:.3} N at 0.1 m/s; L7: residual {residual:.1e} of {:.1} N mm",
            energies.hand
        );
        assert!((drag - expected).abs() < 0.01, "{drag}");
        assert!(residual.abs() < 1e-11 * energies.hand && energies.friction > 0.0);
    }
}

#[test]
fn settings_that_make_no_system_are_refused_in_words() {
    let right = MasterSlaveSettings::of(LawSettings::of::<3>(THESIS, Period::MILLISECOND));
    let message = |change: &dyn Fn(&mut MasterSlaveSettings)| {
        let mut wrong = right;
        change(&mut wrong);
        MasterSlave::new(&wrong).expect_err("no system").to_string()
    };
    for (text, words) in [
        (message(&|one| one.law.body.tau_eps = f64::NAN), "tau_eps"),
        (message(&|one| one.law.force_max = Newtons(-1.0)), "largest force"),
        (message(&|one| one.contact.off = Newtons(1.0)), "no hysteresis"),
        (message(&|one| one.encoder.lines = 0), "lines = 0"),
        (message(&|one| one.slave.mm_per_pulse = 0.0), "pulses per master count"),
        (message(&|one| one.torque.motor.resistance = 0.0), "resistance = 0"),
        (message(&|one| one.torque.motor.thermal.case_s = f64::NAN), "time constant of the case"),
        (message(&|one| one.torque.friction_share = 2.0), "share of friction"),
        (message(&|one| one.damping = f64::INFINITY), "damping = inf"),
        (message(&|one| one.delay_ticks = 33.0), "delay = 33 ticks"),
        (message(&|one| one.surface_mm = f64::NAN), "surface"),
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

/// Nothing that a tick holds can allocate, lock or wait: all of it is plain numbers that are copied.
#[test]
fn states_are_plain_numbers() {
    fn is_copy<T: Copy + Send + Sync + 'static>(_: &T) {}
    let settings = MasterSlaveSettings::of(LawSettings::of::<3>(THESIS, Period::MILLISECOND));
    let system = MasterSlave::new(&settings).expect("a system");
    is_copy(&system);
    is_copy(&system.snapshot());
    // A page at most, and a snapshot, which is handed over every tick, a quarter of one.
    let sizes = [size_of_val(&system), size_of_val(&system.snapshot())];
    assert!(sizes[0] <= 4096 && sizes[1] <= 1024, "{sizes:?}");
}

/// T4: the same inputs give the same bits, from the start and from a copy in the middle; wild ones are survived, and the
/// snapshot's checksum is of every field.
#[test]
fn replay_is_equal_to_the_bit_and_wild_input_is_survived() {
    let settings = MasterSlaveSettings::of(LawSettings::of::<3>(THESIS, Period::MILLISECOND));
    let wild =
        [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -f64::MAX, f64::MIN_POSITIVE, -0.0];
    let mut random = SplitMix::seeded(29);
    let mut counts = 0i64;
    let inputs: Vec<MasterSlaveInput> = (0..50_000)
        .map(|i| {
            counts = match random.below(500) {
                0 => i64::MAX,
                1 => i64::MIN,
                2 => 0,
                _ => counts.saturating_add(random.below(9) as i64 - 3),
            };
            MasterSlaveInput {
                elapsed: [1, 1, 1, 1, 1, 1, 0, 7, 5000, u64::MAX][random.below(10)],
                cell: Newtons(if i % 17 == 0 {
                    wild[random.below(wild.len())]
                } else {
                    random.normal()
                }),
                slave_pulses: match random.below(50) {
                    0 => Some(i64::MAX),
                    1 => Some(-5),
                    _ => None,
                },
                is_on: random.below(100) > 0,
                counts,
            }
        })
        .collect();
    // As a record would store them.
    let stored = serde_json::to_string(&settings).expect("text");
    let again: MasterSlaveSettings = serde_json::from_str(&stored).expect("settings");
    assert_eq!(again, settings);
    let begun = MasterSlave::new(&again).expect("a system");
    let mut first = begun;
    let mut sums = Vec::new();
    let mut middle = None;
    for (i, one) in inputs.iter().enumerate() {
        if i == 20_000 {
            middle = Some(first);
        }
        let output = first.tick(one);
        let snapshot = first.snapshot();
        assert!(
            output.bias.is_finite() && output.force.abs() <= Newtons(10.0),
            "{one:?} {output:?}"
        );
        assert!(output.pulses.abs() <= 40 && snapshot.is_whole());
        for number in [
            snapshot.depth.0,
            snapshot.speed.0,
            snapshot.master_mm,
            snapshot.energy,
            snapshot.damping,
            snapshot.torque,
        ] {
            assert!(number.is_finite(), "{one:?} {snapshot:?}");
        }
        sums.push(snapshot.checksum);
    }
    let mut again = begun;
    let mut later = middle.expect("20 000 ticks");
    for (i, one) in inputs.iter().enumerate() {
        let _ = again.tick(one);
        assert_eq!(again.snapshot().checksum, sums[i]);
        if i >= 20_000 {
            let _ = later.tick(one);
            assert_eq!(later.snapshot().checksum, sums[i]);
        }
    }
    let whole = again.snapshot();
    let torn = palpate_haptics::MasterSlaveSnapshot { tick: whole.tick ^ 1, ..whole };
    assert!(!torn.is_whole());
}

/// T5 in small; `examples/haptic_soak.rs` does 1e8 ticks: after a million ticks in and out the system stands where it
/// stood after the first ten thousand, to the bit where that can be.
#[test]
fn a_million_ticks_do_not_drift() {
    let settings = MasterSlaveSettings::of(LawSettings::of::<3>(THESIS, Period::MILLISECOND));
    let mut system = MasterSlave::new(&settings).expect("a system");
    let mut seen = Vec::new();
    for i in 0..1_000_000u64 {
        // In and out over 1000 counts, 15 mm, in 10 s, with the cell touching inside.
        let phase = i % 10_000;
        let counts = (phase.min(10_000 - phase) / 5) as i64;
        let _ = system.tick(&input(counts, if counts > 20 { 1.0 } else { 0.0 }));
        if phase == 4000 {
            let one = system.snapshot();
            seen.push([one.depth.0, one.model.0, one.guarded.0, one.pulses as f64]);
        }
    }
    // The first time it starts softly; the memory of that fades by e^-10 a round, so that from the sixth on nothing may
    // change but rounding.
    for one in &seen[6..] {
        let close = one.iter().zip(&seen[5]).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs());
        assert!(close, "{one:?} {:?}", seen[5]);
    }
    let last = system.snapshot();
    assert_eq!((last.tick, last.time.0), (1_000_000, 1_000_000_000_000));
    assert!(last.energy.is_finite() && last.energy > 0.0);
}
