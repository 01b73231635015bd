//! The virtual scene: its device against closed forms, its tick against its parts, and the same hands give the same bits.

use palpate_haptics::rig::Rack;
use palpate_haptics::scene::{
    DeviceSettings, HandLedScene, HandPose, NoForceReason, Pose, Scene, SceneError, ScenePath,
    SceneSettings, SceneTick, SimulatedDevice,
};
use palpate_haptics::{Flags, Period};
use palpate_model::random::SplitMix;
use palpate_model::units::Depth;
use palpate_test_support::naive_surface as naive;

fn run(settings: SceneSettings, path: ScenePath, mut seen: impl FnMut(&Scene, SceneTick)) -> Scene {
    let mut led = HandLedScene::new(settings).expect("a scene");
    let ticks = settings.period.hz() * path.seconds();
    for _ in 0..ticks as u64 {
        let t = settings.period.time_of(led.scene.ticks() + 1).seconds();
        let tick = led.tick(path.at(t.0, &settings));
        seen(&led.scene, tick);
    }
    led.scene
}

/// A place, and no turn.
fn at(x: f64, y: f64, z: f64) -> HandPose {
    HandPose { at: [x, y, z], turn: [0.0; 3] }
}

fn pose(x: f64, y: f64, z: f64) -> Pose {
    let HandPose { at, turn } = at(x, y, z);
    Pose { at, turn }
}

/// No hand, and nothing of friction.
fn loose() -> DeviceSettings {
    DeviceSettings {
        friction_n: 0.0,
        hand_mass_kg: 0.0,
        hand_stiffness_n_per_mm: 0.0,
        hand_damping_n_s_per_mm: 0.0,
        ..DeviceSettings::default()
    }
}

#[test]
fn a_device_under_a_constant_force_moves_as_mass_and_damping_say() {
    let settings = loose();
    let mut device =
        SimulatedDevice::new(settings, Period::MILLISECOND, [0.0; 3], [0.0; 3]).unwrap();
    let (m, b, force) = (1e-3 * settings.mass_kg, settings.damping_n_s_per_mm, 0.02);
    for tick in 1..=300_u32 {
        device.follow(HandPose::default(), [force, 0.0, -2.0 * force], 1);
        let t = f64::from(tick) * 1e-3;
        let decayed = 1.0 - (-b * t / m).exp();
        let place = force / b * (t - m / b * decayed);
        let x = device.axes().map(|axis| axis.x);
        assert!((x[0] - place).abs() < 1e-4 * place.abs().max(1e-3), "{t}: {x:?} {place}");
        assert!((x[2] + 2.0 * place).abs() < 2e-4 * place.abs().max(1e-3), "{t}");
        assert_eq!(x[1], 0.0);
        // Sensed within half a step, in whole steps.
        let sensed = device.pose().at[0];
        assert!((sensed - x[0]).abs() <= 0.5 * settings.step_mm + 1e-12);
        let steps = sensed / settings.step_mm;
        assert!((steps - steps.round()).abs() < 1e-9, "{steps}");
    }
}

#[test]
fn a_hand_settles_where_its_spring_balances_the_force_and_friction_holds() {
    let settings = DeviceSettings { friction_n: 0.0, ..DeviceSettings::default() };
    let settled = |settings: DeviceSettings| {
        let mut device =
            SimulatedDevice::new(settings, Period::MILLISECOND, [0.0; 3], [0.0; 3]).unwrap();
        device.follow(at(10.0, 0.0, 0.0), [0.0, 0.0, 1.0], 5000);
        device.axes().map(|axis| axis.x)
    };
    let [x, y, z] = settled(settings);
    let lifted = 1.0 / settings.hand_stiffness_n_per_mm;
    assert!((x - 10.0).abs() < 1e-6 && y == 0.0 && (z - lifted).abs() < 1e-6, "{x} {z}");
    // With friction it stays short by no more than what friction holds.
    let rough = DeviceSettings::default();
    let [x, _, z] = settled(rough);
    let short = rough.friction_n / rough.hand_stiffness_n_per_mm;
    assert!((x - 10.0).abs() <= short + 1e-9 && (z - lifted).abs() <= short + 1e-9, "{x} {z}");
    assert!((z - lifted).abs() > 1e-3, "{z}");
}

#[test]
fn energy_never_comes_out_of_a_device_whatever_the_hand_and_the_force() {
    let mut random = SplitMix::seeded(5);
    let settings = DeviceSettings::default();
    let mut device =
        SimulatedDevice::new(settings, Period::MILLISECOND, [0.0; 3], [0.0; 3]).unwrap();
    let mut taken = 0.0;
    for _ in 0..20_000 {
        let [x, y, z] = [0; 3].map(|_| 20.0 * random.normal());
        let force = [0; 3].map(|_| 2.0 * random.normal());
        device.follow(at(x, y, z), force, 1);
        let sum = |of: fn(&Rack) -> f64| device.axes().iter().map(of).sum::<f64>();
        // What went in and was not taken is motion.
        let put_in = sum(|axis| axis.energies.hand + axis.energies.motor);
        let lost = sum(|axis| axis.energies.damping + axis.energies.friction);
        let missing = put_in - lost - sum(Rack::kinetic);
        assert!(missing.abs() < 1e-9 * lost.max(1.0), "{missing:e}");
        assert!(lost >= taken);
        taken = lost;
    }
    assert!(taken > 100.0);
}

#[test]
fn a_force_beyond_the_device_keeps_its_direction_and_is_reported() {
    let settings = DeviceSettings::default();
    let (force, is_less) = settings.limit_force([3.0, 4.0, 12.0]);
    assert!(is_less);
    for (part, of) in force.iter().zip([3.0, 4.0, 12.0]) {
        assert!((part - of * 3.3 / 13.0).abs() < 1e-12);
    }
    assert_eq!(settings.limit_force([1.0, -2.0, 2.0]), ([1.0, -2.0, 2.0], false));
    assert_eq!(settings.limit_force([f64::NAN; 3]), ([0.0; 3], true));
}

#[test]
fn the_same_hands_give_the_same_bits_and_one_bit_more_does_not() {
    let settings = SceneSettings::default();
    for path in ScenePath::ALL {
        let mut all = Vec::new();
        let first = run(settings, path, |_, tick| all.push(tick));
        let mut index = 0;
        let again = run(settings, path, |_, tick| {
            assert_eq!(tick, all[index], "{path:?}");
            index += 1;
        });
        assert_eq!(first.hash(), again.hash());
        assert!(all.iter().any(SceneTick::is_contact), "{path:?}");
        let last = first.last();
        let end = settings.start();
        assert!(!last.is_contact() && (last.device[2] - end[2]).abs() < 1.0, "{path:?} {last:?}");
    }
    let other = SceneSettings {
        max_shear_mm: f64::from_bits(settings.max_shear_mm.to_bits() + 1),
        ..settings
    };
    let [one, two] = [settings, other].map(|one| run(one, ScenePath::Poke, |_, _| {}).hash());
    assert_ne!(one, two);
}

#[test]
fn the_force_of_a_long_hold_is_the_bodys_own() {
    let settings = SceneSettings { controller: None, ..SceneSettings::default() };
    let mut scene = Scene::new(settings).unwrap();
    let mut last = scene.last();
    for _ in 0..25_000 {
        last = scene.render(pose(30.0, 30.0, -20.0), 1);
    }
    let elastic = settings.body.elastic(Depth(20.0)).0;
    assert!((last.depth - 20.0).abs() < 1e-12 && elastic > 1.0);
    assert!((last.force[2] - elastic).abs() < 1e-6, "{last:?} {elastic}");
    assert_eq!([last.force[0], last.force[1]], [0.0; 2]);
    assert_eq!(last.no_force_reason, NoForceReason::None);
}

#[test]
fn the_surface_follows_the_stylus_within_its_limits_and_returns() {
    let settings = SceneSettings { recovery_s: 0.1, ..SceneSettings::default() };
    let mut scene = Scene::new(settings).unwrap();
    let flat = scene.hash();
    for tick in 0..200 {
        let x = 20.0 + 0.1 * f64::from(tick);
        let report = scene.render(pose(x, 31.2, -3.0), 1);
        let node = scene.field().grid().nearest(report.proxy[0], report.proxy[1]).unwrap();
        let height = scene.field().heights()[scene.field().grid().index(node)];
        assert!((height - (report.proxy[2] - report.depth)).abs() < 1e-12, "{report:?} {height}");
        assert!(report.moved > 0, "{report:?}");
        let (heights, settings) = (scene.field().heights(), scene.settings());
        // Every link of the mesh is looked at, so not in every tick.
        let worst = |z| naive::worst_excess(z, settings.nodes, |_, _| settings.max_shear_mm);
        assert!(tick % 20 != 0 || worst(heights) < 1e-9);
    }
    assert_ne!(scene.hash(), flat);
    for _ in 0..2000 {
        scene.render(pose(30.0, 30.0, 5.0), 1);
    }
    assert_eq!(scene.hash(), flat);
    assert!(scene.dirty().is_empty());
}

#[test]
fn a_fast_poke_never_pops_through() {
    let mut random = SplitMix::seeded(6);
    for _ in 0..50 {
        let mut scene = Scene::new(SceneSettings::default()).unwrap();
        let [x, y] = [0; 2].map(|_| 5.0 + random.below(500) as f64 * 0.1);
        let speed = 0.01 * 10_f64.powf(random.below(4) as f64);
        let mut depth = 0.0;
        for tick in 0..200 {
            let z = 1.0 - speed * f64::from(tick);
            let report = scene.render(pose(x, y, z), 1);
            assert!(
                report.depth >= depth && (report.depth - (-z).max(0.0)).abs() < 1e-9,
                "{report:?}"
            );
            depth = report.depth;
        }
    }
}

#[test]
fn the_force_is_bounded_and_its_part_across_is_within_friction() {
    let settings = SceneSettings::default();
    for path in ScenePath::ALL {
        let mut across_most = 0.0_f64;
        run(settings, path, |_, tick| {
            let [fx, fy, fz] = tick.force;
            let total = fx.hypot(fy).hypot(fz);
            assert!(total <= settings.device.force_max_n * (1.0 + 1e-12), "{tick:?}");
            let across = fx.hypot(fy);
            across_most = across_most.max(across);
            assert!(
                across <= settings.friction * fz.max(0.0) + 1e-9 || tick.injected_damping > 0.0,
                "{tick:?}"
            );
        });
        // Only a drag has something across.
        assert_eq!(across_most > 0.05, path == ScenePath::Drag, "{path:?} {across_most}");
    }
}

#[test]
fn the_reason_for_no_force_is_reported() {
    let settings = SceneSettings::default();
    let mut scene = Scene::new(settings).unwrap();
    let mut why = |x: f64, z: f64, ticks: u32| {
        let mut last = scene.last();
        for _ in 0..ticks {
            last = scene.render(pose(x, 30.0, z), 1);
        }
        assert!(!last.no_force_reason.name().is_empty());
        (last.no_force_reason, last.force[2])
    };
    assert_eq!(why(30.0, 1.0, 1), (NoForceReason::NoContact, 0.0));
    assert_eq!(why(70.0, -1.0, 1), (NoForceReason::Outside, 0.0));
    assert_eq!(why(30.0, 1.0, 2000).0, NoForceReason::NoContact);
    assert_eq!(why(30.0, -4.0, 1).0, NoForceReason::RampingIn);
    // After its ramp and its memory: 0.1 N, which 0.26 N of friction hide.
    assert_eq!(why(30.0, -4.0, 9000).0, NoForceReason::BelowThreshold);
    assert_eq!(why(30.0, -3.0, 3).0, NoForceReason::Leaving);
    assert_eq!(why(30.0, 5.0, 9000).0, NoForceReason::NoContact);
    let (deep, force) = why(30.0, -29.0, 200);
    assert_eq!(deep, NoForceReason::Saturated);
    assert!((force - 3.3).abs() < 1e-9, "{force}");
    assert_eq!(why(30.0, f64::NAN, 1).0, NoForceReason::NotANumber);
}

#[test]
fn a_stall_is_led_through_and_the_force_rises_from_what_was_held() {
    let settings = SceneSettings::default();
    let mut led = HandLedScene::new(settings).unwrap();
    let mut follow = |ticks: u32, depth: f64, stall: u64| {
        let hand = at(30.0, 30.0, -depth);
        let mut report = led.tick_after(hand, stall);
        for _ in 1..ticks {
            report = led.tick(hand);
        }
        report
    };
    let before = follow(3000, 12.0, 1);
    let away = 50;
    // The hand goes on while the loop is away.
    let after = follow(1, 22.0, away);
    assert_eq!(after.tick, before.tick + away);
    assert!(
        after.flags.has(Flags::STALL) && after.no_force_reason == NoForceReason::RampingIn,
        "{after:?}"
    );
    assert!(after.depth > before.depth + 2.0, "{after:?}");
    assert!((after.force[2] - before.force[2]).abs() < 0.05, "{before:?} {after:?}");
    let risen = follow(2000, 22.0, 1);
    assert!(
        risen.force[2] > 1.5 * before.force[2] && !risen.flags.has(Flags::STALL),
        "{before:?} {risen:?}"
    );
}

#[test]
fn scenes_that_cannot_be_are_refused_in_words() {
    let usual = SceneSettings::default();
    let device = |change: fn(&mut DeviceSettings)| {
        let mut device = DeviceSettings::default();
        change(&mut device);
        usual.with_device(device)
    };
    let refused = |settings: SceneSettings| {
        let refused: Option<SceneError> = Scene::new(settings).err();
        refused.expect("refused").to_string()
    };
    for (settings, word) in [
        (SceneSettings { nodes: 1, ..usual }, "not possible"),
        (SceneSettings { side_mm: f64::NAN, ..usual }, "not possible"),
        (SceneSettings { max_shear_mm: -1.0, ..usual }, "neighbouring nodes"),
        (SceneSettings { recovery_s: -1.0, ..usual }, "recovery"),
        (SceneSettings { friction: 11.0, ..usual }, "friction"),
        (device(|one| one.mass_kg = 0.0), "mass_kg"),
        (device(|one| one.friction_n = -1.0), "friction_n"),
        (device(|one| one.workspace_mm[1] = f64::INFINITY), "workspace_mm"),
    ] {
        let message = refused(settings);
        assert!(message.contains(word), "{message}");
    }
    assert!("poke".parse::<ScenePath>().is_ok());
    assert!("pork".parse::<ScenePath>().unwrap_err().contains("taps"));
}
