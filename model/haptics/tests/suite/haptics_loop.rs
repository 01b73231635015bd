//! Device, hand and loop together: rows L1 to L7, L10 and L11. Figures are printed; run with `--nocapture` to read them.

use crate::renderer::{Rendered, Renderer, RunTick, run};
use palpate_haptics::closed_loop::{HapticPlant, PlantCommand, PlantSettings};
use palpate_haptics::margin::{LoopDevice, MarginSettings};
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_haptics::{
    ControllerSettings, Flags, ForceLaw, GuardSettings, LawSettings, Period, inertia,
};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, MmPerS, Newtons, Seconds};
use palpate_rheology::integrators::{Scheme, SeriesBody};

const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;
/// A count of 1024 lines times four at the rack, in mm, and of the lines alone.
const FINE: f64 = 0.015_339_8;
const COARSE: f64 = 0.061_359_2;

fn period(us: u64) -> Period {
    Period::of_nanos(us * 1000).expect("a period")
}

/// L7 in every run: the energies of all ports and losses add up, and no loss is a gain.
fn balanced(plant: &HapticPlant, started_with: f64) {
    let all = plant.rack.energies;
    let put_in = all.motor + all.hand + started_with;
    let gone = all.damping + all.friction + plant.rack.kinetic();
    let size = all.motor.abs() + all.hand.abs() + all.damping + gone.abs() + started_with;
    assert!((put_in - gone).abs() <= 1e-11 * size, "residual {:e} of {size:e} N mm", put_in - gone);
    assert!(all.damping >= 0.0 && all.friction >= -1e-9 * size, "{all:?}");
}

/// Runs `seconds` and gives back the plant and what `seen` kept.
fn play(
    settings: &PlantSettings,
    mut renderer: Renderer,
    seconds: f64,
    seen: impl FnMut(&RunTick) -> bool,
) -> HapticPlant {
    let mut plant = HapticPlant::new(settings);
    let ticks = (seconds / settings.period.seconds().0).round() as u64;
    run(&mut plant, &mut renderer, ticks, seen);
    let mass = inertia(settings.mass_kg + settings.hand.mass_kg);
    balanced(&plant, 0.5 * mass * settings.v * settings.v);
    plant
}

/// Whether a spring calms down: its energy in the last quarter of the time below that in the second.
fn calms(settings: &PlantSettings, stiffness: f64, seconds: f64) -> bool {
    let spring = Rendered::Spring { stiffness };
    let renderer = Renderer::new(spring, settings, None, None);
    let (mut early, mut late, mut is_bounded) = (0.0, 0.0, true);
    let mass = inertia(settings.mass_kg);
    play(settings, renderer, seconds, |one| {
        let energy = stiffness * one.x * one.x + mass * one.v * one.v;
        let share = one.t.0 / seconds;
        if (0.25..0.5).contains(&share) {
            early += energy;
        } else if share > 0.75 {
            late += energy;
        }
        is_bounded = energy < 1e9;
        is_bounded
    });
    is_bounded && late < early
}

/// The stiffest spring that calms down, in N/mm.
fn stiffest(settings: &PlantSettings, guess: f64) -> f64 {
    let (mut low, mut high) = (0.5 * guess, 2.0 * guess);
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        if calms(settings, middle, 2.0) { low = middle } else { high = middle }
    }
    low
}

fn struck(us: u64, damping: f64, delay: usize) -> PlantSettings {
    PlantSettings { mass_kg: 0.115, damping, delay, v: 10.0, ..PlantSettings::bare(period(us)) }
}

/// L1: a spring is calm up to `2 b / T`, times little more: the passivity bound is on the safe side.
#[test]
fn the_stiffest_spring_is_twice_damping_over_tick() {
    for (us, most) in [(500, 1.02), (1000, 1.03), (2000, 1.06), (5000, 1.15)] {
        for damping in [0.5e-3, 2e-3, 17.6e-3] {
            let bound = 2.0 * damping / (us as f64 * 1e-6);
            let ratio = stiffest(&struck(us, damping, 0), bound) / bound;
            println!("L1: {us} us, {} N s/m: {ratio:.4} of 2 b / T", damping * 1e3);
            assert!((1.0..most).contains(&ratio), "{us} {damping}: {ratio}");
        }
    }
}

/// L2: with a delay of `d` ticks up to `b / (T/2 + d T)`.
#[test]
fn a_delay_takes_its_part() {
    for delay in [0, 1, 2, 5usize] {
        for damping in [0.5e-3, 2e-3] {
            let bound = damping / (1e-3 * (0.5 + delay as f64));
            let ratio = stiffest(&struck(1000, damping, delay), bound) / bound;
            println!("L2: {delay} ticks late, {} N s/m: {ratio:.4}", damping * 1e3);
            assert!((1.0..1.02).contains(&ratio), "{delay}: {ratio}");
        }
    }
}

/// Swing in mm at the end, and whether it was ever called a buzz, of a wall that a hand without damping leans on.
fn leaned_on(stiffness: f64, damping: f64, friction: f64, count_mm: f64) -> (f64, bool) {
    let path = HandPath::RampHold { from: 0.0, to: 10.0, speed: 50.0 };
    let hand = SimulatedHand { mass_kg: 0.05, stiffness: 0.2, damping: 0.0, path };
    let settings = PlantSettings {
        mass_kg: 0.115,
        damping,
        friction: [friction; 2],
        count_mm,
        x: -1.0,
        hand,
        ..PlantSettings::bare(Period::MILLISECOND)
    };
    let renderer = Renderer::new(Rendered::Wall { stiffness }, &settings, None, None);
    let (mut low, mut high, mut is_buzz) = (f64::MAX, f64::MIN, false);
    play(&settings, renderer, 4.0, |one| {
        if one.t.0 > 3.0 {
            (low, high) = (low.min(one.x), high.max(one.x));
            is_buzz |= one.rendered.flags.has(Flags::BUZZ);
        }
        true
    });
    (high - low, is_buzz)
}

/// L3 and the first half of L10: below `min(2 b / T, 2 f / D)` nothing swings; without friction a stiff wall swings by a
/// few counts, which from two counts on is heard as a buzz.
#[test]
fn counts_swing_where_friction_is_below_half_a_count_of_stiffness() {
    let damping = 17.6e-3;
    let (mut swings, mut heard) = (0, 0);
    for count in [FINE, COARSE] {
        for friction in [0.0, 0.05, 0.81] {
            for stiffness in [1.0, 5.0, 20.0, 30.0, 34.0] {
                let bound = f64::min(2.0 * damping / 1e-3, 2.0 * friction / count);
                let (swing, is_buzz) = leaned_on(stiffness, damping, friction, count);
                if stiffness <= bound {
                    assert!(swing < 1e-9, "{count} {friction} {stiffness}: {swing}");
                }
                if friction == 0.0 && stiffness >= 20.0 {
                    println!(
                        "L3: {stiffness} N/mm, count {:.1} um, no friction: {:.1} um",
                        1e3 * count,
                        1e3 * swing
                    );
                    assert!((0.5 * count..6.0 * count).contains(&swing), "{swing}");
                    swings += 1;
                }
                // Two counts must be passed, so that three are surely heard.
                heard += usize::from(is_buzz);
                assert!(is_buzz || swing < 3.0 * count, "{count} {friction} {stiffness}: {swing}");
                assert!(!is_buzz || stiffness > bound);
            }
        }
    }
    // An encoder without steps has no counts to swing by.
    assert!(leaned_on(30.0, damping, 0.0, 0.0).0 < 1e-6);
    println!("L3: {swings} swings, {heard} heard as a buzz");
    assert!(swings == 6 && heard > 1);
}

/// L4: friction alone holds small motions only. A swing of speed `V` gains `K T V^2 / 4` and loses `f 2 V / pi` a second,
/// so that above `V = 8 f / (pi K T)` it grows, although `K` is far below `2 f / D`.
#[test]
fn without_damping_friction_holds_up_to_an_amplitude() {
    let friction = 0.81;
    for stiffness in [5.0, 10.0, 20.0] {
        assert!(stiffness < 2.0 * friction / FINE);
        let grows = |speed: f64| {
            let settings = PlantSettings {
                friction: [friction; 2],
                count_mm: FINE,
                v: speed,
                ..PlantSettings::bare(Period::MILLISECOND)
            };
            let renderer = Renderer::new(Rendered::Spring { stiffness }, &settings, None, None);
            let mut farthest = 0.0f64;
            play(&settings, renderer, 3.0, |one| {
                farthest = farthest.max(one.x.abs());
                farthest < 1e3
            });
            farthest >= 1e3
        };
        let (mut low, mut high) = (10.0, 2000.0);
        for _ in 0..16 {
            let middle = 0.5 * (low + high);
            if grows(middle) { high = middle } else { low = middle }
        }
        let expected = 8.0 * friction / (std::f64::consts::PI * stiffness * 1e-3);
        println!(
            "L4: {stiffness} N/mm grows from {low:.1} mm/s on, {expected:.1} by the balance of energies"
        );
        // The balance is of a sine; the first quarter of the swing has lost some speed already.
        assert!((low / expected - 1.0).abs() < 0.15, "{stiffness}: {low} {expected}");
    }
}

/// A swing of the thesis body about a depth with a hand of mass and spring alone, and the device's damping. Gives its
/// growth over the run, the least of energy absorbed with damping, and the energy of the start.
fn swing_about(
    depth: f64,
    hand_kg: f64,
    hand_stiffness: f64,
    damping: f64,
    delay: usize,
) -> (f64, f64, f64) {
    let held = THESIS.elastic(Depth(depth)).0;
    let hand = SimulatedHand {
        mass_kg: hand_kg,
        stiffness: hand_stiffness,
        damping: 0.0,
        // The spring holds the force of the body.
        path: HandPath::Still { at: depth + held / hand_stiffness },
    };
    let period = Period::MILLISECOND;
    let settings = PlantSettings {
        damping,
        delay,
        hand,
        x: depth,
        v: 1.0,
        held: Newtons(held),
        ..PlantSettings::bare(period)
    };
    let law = LawSettings { is_pull_allowed: true, ..LawSettings::of::<3>(THESIS, period) };
    let law = ForceLaw::new(law, Depth(depth)).expect("a law");
    let renderer = Renderer::new(Rendered::Law(law), &settings, None, None);
    let (mut early, mut late, mut least, mut taken, mut before) =
        (0.0f64, 0.0f64, 0.0f64, 0.0, depth);
    play(&settings, renderer, 8.0, |one| {
        let away = (one.x - depth).abs();
        if (1.0..3.0).contains(&one.t.0) {
            early = early.max(away);
        } else if one.t.0 > 6.0 {
            late = late.max(away);
        }
        // Work against the force beyond what holds the hand, and what the damping took.
        let moved = one.x - before;
        before = one.x;
        taken += damping * moved * moved / 1e-3;
        least = least.min(one.absorbed - held * (one.x - depth) + taken);
        away < 5.0
    });
    let mass = inertia(0.11 + hand_kg);
    if late == 0.0 {
        late = 5.0;
    }
    // One that leaves at once had no second second.
    (late / early.max(0.01), least, 0.5 * mass)
}

/// L5: with the damping of the margin every hand calms down and energy absorbed never falls below zero; with a part of it
/// some hand swings up.
#[test]
fn the_margin_s_damping_is_enough_and_a_part_of_it_is_not() {
    // Shallow the lag asks for it, deep sudden motion does.
    for (depth, delay, part) in [(0.3, 0, 0.01), (12.0, 2, 0.3), (25.0, 2, 0.3)] {
        let watch = MarginSettings {
            body: SeriesBody::from(THESIS).padded(),
            scheme: Scheme::Exact,
            period: Period::MILLISECOND,
            device: LoopDevice {
                damping: 0.0,
                friction: Newtons(0.0),
                count_mm: 0.0,
                delay_ticks: delay as f64,
            },
        };
        let needed = watch.exact_margin_at(Depth(depth), MmPerS(0.0)).needed;
        let mut grown = 0.0f64;
        for (mass, stiffness) in [(0.05, 0.2), (0.2, 0.8), (0.05, 3.0), (2.0, 0.05), (5.0, 0.01)] {
            let (growth, least, start) = swing_about(depth, mass, stiffness, needed, delay);
            assert!(growth < 1.0, "{depth} mm, hand {mass} kg {stiffness} N/mm: {growth}");
            // Swings of 1 mm/s are small compared with most depths, not quite with 0.3 mm.
            assert!(
                least > -0.02 * start,
                "{depth} mm, {mass} kg {stiffness} N/mm: {least:e} of {start:e}"
            );
            grown = grown.max(swing_about(depth, mass, stiffness, part * needed, delay).0);
        }
        println!(
            "L5: {depth} mm: {:.2} N s/m needed; with {part} of it a swing grows {grown:.1} times in 5 s",
            needed * 1e3
        );
        assert!(grown > 1.1, "{depth}: {grown}");
    }
}

/// Farthest place of a spring struck at 10 mm/s, in mm, with a controller or without.
fn controlled(stiffness: f64, is_clamped: Option<bool>) -> (f64, f64) {
    let settings = PlantSettings { count_mm: FINE, ..struck(1000, 2e-3, 0) };
    let controller = is_clamped.map(|is_clamped| ControllerSettings {
        is_clamped,
        force_max: Newtons(f64::MAX),
        ..ControllerSettings::of(0.115)
    });
    let renderer =
        Renderer::new(Rendered::Spring { stiffness }, &settings, None, controller.as_ref());
    let (mut farthest, mut last) = (0.0f64, 0.0f64);
    play(&settings, renderer, 3.0, |one| {
        farthest = farthest.max(one.x.abs());
        if one.t.0 > 2.8 {
            last = last.max(one.x.abs());
        }
        farthest < 1e3
    });
    (farthest, last)
}

/// L6 and its mutant: with its damping clamped at mass over tick the controller holds springs of up to 16 times the
/// stiffest that is calm alone; unclamped it throws the device away, even where nothing was to be guarded.
#[test]
fn the_clamped_controller_holds_and_the_unclamped_does_not() {
    for stiffness in [4.0, 8.0, 16.0, 32.0, 64.0] {
        let (alone, _) = controlled(stiffness, None);
        assert_eq!(alone >= 1e3, stiffness > 4.0, "{stiffness}: {alone}");
        let (farthest, last) = controlled(stiffness, Some(true));
        println!(
            "L6: {stiffness} N/mm: {:.0} um at most, {:.0} um at last",
            1e3 * farthest,
            1e3 * last
        );
        assert!(farthest < 0.085 && last < 2.0 * FINE);
        assert!(controlled(stiffness, Some(false)).0 >= 1e3, "{stiffness} unclamped");
    }
}

/// In the band where the model returns energy in slow pokes the controller takes it back, to what a few counts are worth.
#[test]
fn what_the_model_returns_in_its_band_is_taken_back() {
    let owed = |is_controlled: bool| {
        let path = HandPath::Sine { middle: 0.5, amplitude: 0.55, hz: 0.25 };
        let settings = PlantSettings {
            damping: 0.5e-3,
            count_mm: FINE / 16.0,
            x: -0.05,
            hand: SimulatedHand { stiffness: 3.0, ..SimulatedHand::firm(path) },
            ..PlantSettings::bare(Period::MILLISECOND)
        };
        let law = LawSettings::of::<3>(THESIS, Period::MILLISECOND);
        let law = Rendered::Law(ForceLaw::new(law, Depth(-0.05)).expect("a law"));
        let controller = is_controlled.then(|| ControllerSettings::of(0.11));
        let renderer = Renderer::new(law, &settings, None, controller.as_ref());
        let mut last = 0.0;
        play(&settings, renderer, 20.0, |one| {
            last = one.absorbed;
            true
        });
        last
    };
    let (alone, controlled) = (owed(false), owed(true));
    println!(
        "five pokes to 1 mm absorb {alone:.4} N mm alone, {controlled:.4} with the controller"
    );
    assert!(alone < -0.02 && controlled > 0.1 * alone);
}

/// The other half of L10: a hand that moves at 5 Hz is no buzz, on a wall, on a body, in the air.
#[test]
fn a_hand_at_five_hertz_is_no_buzz() {
    for middle in [-5.0, 0.0, 5.0, 15.0] {
        for amplitude in [1.0, 4.0] {
            for is_wall in [true, false] {
                let path = HandPath::Sine { middle, amplitude, hz: 5.0 };
                let settings = PlantSettings {
                    damping: 2e-3,
                    friction: [0.1; 2],
                    count_mm: FINE,
                    x: middle - amplitude,
                    hand: SimulatedHand::firm(path),
                    ..PlantSettings::bare(Period::MILLISECOND)
                };
                let rendered = if is_wall {
                    Rendered::Wall { stiffness: 1.0 }
                } else {
                    let law = LawSettings::of::<3>(THESIS, Period::MILLISECOND);
                    Rendered::Law(ForceLaw::new(law, Depth(settings.x)).expect("a law"))
                };
                let renderer = Renderer::new(rendered, &settings, None, None);
                let mut turns = 0.0f64;
                play(&settings, renderer, 4.0, |one| {
                    assert!(
                        !one.rendered.flags.has(Flags::BUZZ),
                        "{middle} {amplitude} {is_wall} {one:?}"
                    );
                    turns = turns.max(one.v);
                    true
                });
                assert!(turns > 2.0, "the hand did not move");
            }
        }
    }
}

/// L11: the loop stalls while a hand moves in; when it is back the force begins at what the drive holds and never steps by
/// more than the limit.
#[test]
fn after_a_stall_the_force_ramps() {
    for stall_ms in [10, 50, 500u64] {
        for lets_go in [false, true] {
            let guard = GuardSettings {
                soft_start: Seconds(0.0),
                release_after: lets_go.then_some(Seconds(0.005)),
                ..GuardSettings::default()
            };
            let path = HandPath::RampHold { from: 0.0, to: 20.0, speed: 30.0 };
            let settings = PlantSettings {
                damping: 17.6e-3,
                count_mm: FINE,
                hand: SimulatedHand::firm(path),
                ..PlantSettings::bare(Period::MILLISECOND)
            };
            let wall = Rendered::Wall { stiffness: 0.3 };
            let mut renderer =
                Renderer::new(wall, &settings, Some(&guard), Some(&ControllerSettings::of(0.11)));
            let mut plant = HapticPlant::new(&settings);
            let (mut last, mut worst, mut full) = (0.0f64, 0.0f64, 0.0f64);
            let mut tick = 0;
            while tick < 1500 {
                let one = renderer.tick(plant.sense(), 1);
                worst = worst.max((one.force.0 - last).abs());
                last = one.force.0;
                plant.tick(PlantCommand::Force(one.force));
                tick += 1;
                if tick == 200 {
                    for _ in 0..stall_ms {
                        let held = if lets_go { Newtons(0.0) } else { one.force };
                        plant.tick(PlantCommand::Force(held));
                    }
                    last = if lets_go { 0.0 } else { last };
                    let x = plant.sense().place;
                    let back = renderer.tick(plant.sense(), stall_ms + 1);
                    assert!(back.flags.has(Flags::STALL));
                    let without = (0.3 * x - last).abs();
                    println!(
                        "L11: {stall_ms} ms: a step of {without:.2} N without the guard, {:.3} with",
                        (back.force.0 - last).abs()
                    );
                    worst = worst.max((back.force.0 - last).abs());
                    last = back.force.0;
                    plant.tick(PlantCommand::Force(back.force));
                    tick += stall_ms + 1;
                }
                full = full.max(one.force.0);
            }
            assert!(worst <= 0.5 + 1e-12, "{stall_ms} {lets_go}: {worst}");
            assert!(full > 4.0, "the force came back: {full}");
        }
    }
}
