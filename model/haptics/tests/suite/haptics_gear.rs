//! Master to slave: rows G1 to G4. The ratio itself (G1) is tested in `model/haptics/src/rig/gear.rs`.

use palpate_haptics::Flags;
use palpate_haptics::Period;
use palpate_haptics::rig::{Encoder, EncoderCounter, Gear, GearRatio, Pinion, SlaveDrive};
use palpate_model::random::SplitMix;

const TICKS: u32 = 10_000_000;

fn encoder(edges_per_line: u32) -> Encoder {
    Encoder { edges_per_line, ..Encoder::default() }
}

fn ratio(encoder: &Encoder) -> GearRatio {
    GearRatio::one_to_one(&Pinion::default(), encoder, 0.015).expect("a ratio")
}

/// The farthest that a slave is from its master in mm over a random walk, and how far it is once the master is back at
/// its start; `pulses` turns counts moved into pulses.
fn walk(count_mm: f64, ticks: u32, mut pulses: impl FnMut(i64, i64) -> i64) -> (f64, f64) {
    let mut random = SplitMix::seeded(17);
    let (mut counts, mut made, mut worst) = (0i64, 0i64, 0.0f64);
    for i in 0..ticks {
        // Long ways, too: the walk leans one way for a while, then the other.
        let lean = if i / 100_000 % 2 == 0 { 2 } else { 1 };
        let moved = random.below(4) as i64 - lean;
        counts += moved;
        made += pulses(counts, moved);
        worst = worst.max((made as f64 * 0.015 - counts as f64 * count_mm).abs());
    }
    while counts != 0 {
        let moved = -counts.signum();
        counts += moved;
        made += pulses(counts, moved);
    }
    (worst, made as f64 * 0.015)
}

/// G2: never farther than half a pulse, and home is home.
#[test]
fn the_slave_is_never_half_a_pulse_away_and_never_drifts() {
    for edges in [1, 4] {
        let encoder = encoder(edges);
        let mut gear = Gear::new(ratio(&encoder), &SlaveDrive::default(), Period::MILLISECOND);
        gear.tick(0);
        let count_mm = encoder.count_mm(&Pinion::default());
        let (worst, home) = walk(count_mm, TICKS, |counts, _| gear.tick(counts).pulses);
        println!("{edges} edges a line: at most {:.4} um away in {TICKS} ticks", 1e3 * worst);
        // Half a pulse, and the rounding of positions of up to a few metres to a double.
        assert!(worst <= 0.0075 + 1e-11 && worst > 0.0074 && home == 0.0, "{worst} {home}");
    }
}

/// The mutant: rounding each tick's pulses drifts away.
#[test]
fn rounding_every_tick_drifts() {
    for edges in [1, 4] {
        let encoder = encoder(edges);
        let per_count = ratio(&encoder).pulses_per_count();
        let count_mm = encoder.count_mm(&Pinion::default());
        let (worst, _) =
            walk(count_mm, 100_000, |_, moved| (moved as f64 * per_count).round() as i64);
        println!("{edges} edges a line: rounded tick by tick, {worst:.3} mm away");
        assert!(worst > 0.0075 * 10.0, "{worst}");
    }
}

/// G3: turning round at every count loses nothing; faster than the drive, pulses wait and it is said.
#[test]
fn reversals_lose_nothing_and_the_drive_s_limit_is_reported() {
    let encoder = encoder(4);
    let drive = SlaveDrive { pulses_per_s_max: 10e3, ..SlaveDrive::default() };
    let ratio = ratio(&encoder);
    let mut gear = Gear::new(ratio, &drive, Period::MILLISECOND);
    gear.tick(5);
    let mut made = 0;
    for i in 0..100_001i64 {
        let tick = gear.tick(5 + i % 2);
        made += tick.pulses;
        assert!(tick.behind == 0 && tick.flags == Flags::NONE);
        assert_eq!(made, ratio.pulses(i % 2));
    }
    // 100 counts a tick are 102 pulses; 10 a tick may go.
    let (mut late, mut counts) = (0, 5);
    for _ in 0..20 {
        counts += 100;
        let tick = gear.tick(counts);
        assert!(tick.pulses == 10 && tick.flags == Flags::PULSE_RATE);
        assert!(tick.behind > late);
        late = tick.behind;
    }
    assert_eq!(late, ratio.pulses(2000) - 200);
    let mut ticks = 0;
    while gear.tick(counts).behind > 0 {
        ticks += 1;
    }
    assert_eq!((gear.tick(counts).made, ticks), (ratio.pulses(2000), (late - 1) / 10));
    // The encoder has a limit of its own: 100 kHz of lines are 6.1 m/s, which no hand reaches; it is reported all the same.
    let mut counter = EncoderCounter::new(&encoder, Period::MILLISECOND);
    counter.tick(0, 1);
    assert_eq!(counter.tick(401, 1).1, Flags::COUNT_RATE);
}
