//! The dialogue with a hAPI board in simulated time: no port, no thread, no clock. A seed gives the same faults at the same
//! nanosecond.

use palpate_drivers::sim::{Random, RandomStream};
use palpate_drivers::wire::DeviceAddress;
use palpate_emulators::hapi::{HapiBoard, HapiBoardSettings, HapiFault, HapiLie};
use palpate_haptic_devices::hapi::{Exchange, HapiOptions, LineState, TORQUE_MAX_N_M, write_setup};
use palpate_haptic_devices::{ForceLimits, ForceStop};
use palpate_haptics::Period;
use palpate_model::Nanos;
use std::collections::VecDeque;

/// Grain of simulated time.
const GRAIN: u64 = 20_000;
const TICK: u64 = 1_000_000;
/// Longest rest of the device's thread, as in `hapi/device.rs`, to which a late wake-up is added.
const REST: u64 = 200_000;
/// Limit of the time from a fault to zero torque.
const ZERO_WITHIN: Nanos = Nanos::from_millis(5);
/// Shorter than in use, so that a thousand cases take little time.
const RAMP: Nanos = Nanos::from_millis(20);
const CASES: u64 = 1000;
/// A little aside and out of the tissue, in N along the scene's axes: the board has two of them.
const FORCE: [f64; 3] = [0.2, 0.5, 0.8];

/// A fault of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The scene's loop does not tick any more.
    SceneStops,
    /// The scene's force is no number.
    SceneNotANumber,
    /// The device is closed.
    Closed,
    Board(HapiFault),
}

fn all_faults() -> Vec<Fault> {
    let mut all = vec![
        Fault::SceneStops,
        Fault::SceneNotANumber,
        Fault::Closed,
        Fault::Board(HapiFault::Mute),
        Fault::Board(HapiFault::Cut),
    ];
    all.extend((1..=10).map(|lost| Fault::Board(HapiFault::CutPacket(lost))));
    all.extend(HapiLie::ALL.map(|lie| Fault::Board(HapiFault::Lie(lie))));
    all
}

/// A scene, the device's thread and the board with a wire between them.
struct Bench {
    now: Nanos,
    board: HapiBoard,
    exchange: Exchange,
    random: Random,
    /// Bytes under way, with their arrival.
    to_board: VecDeque<(u64, Vec<u8>)>,
    to_device: VecDeque<(u64, Vec<u8>)>,
    next_tick: u64,
    last_tick: u64,
    wake: u64,
    ticks: bool,
    force: [f64; 3],
}

fn options() -> HapiOptions {
    let nowhere = DeviceAddress::Tcp(String::new());
    HapiOptions::new(nowhere, [30.0, 30.0, 0.0], Period::MILLISECOND)
}

impl Bench {
    /// Set up, in dialogue, the hand at the surface.
    fn new(seed: u64, settings: HapiBoardSettings) -> Self {
        let mut board = HapiBoard::new(settings).unwrap();
        let options = options();
        let limits = ForceLimits { ramp: RAMP, ..options.limits };
        let kind = (options.linkage, options.setup);
        let mut exchange = Exchange::new(kind, options.fit, options.middle, limits);
        let mut setup = Vec::new();
        write_setup(&mut setup, &options.setup);
        board.receive(Nanos::ZERO, &setup);
        exchange.begin(Nanos::ZERO);
        let mut random = Random::new(seed, RandomStream::Link);
        let next_tick = (random.unit() * TICK as f64) as u64;
        Self {
            now: Nanos::ZERO,
            board,
            exchange,
            random,
            to_board: VecDeque::new(),
            to_device: VecDeque::new(),
            next_tick,
            last_tick: 0,
            wake: 0,
            ticks: true,
            force: FORCE,
        }
    }

    fn usual(seed: u64) -> Self {
        Self::new(seed, HapiBoardSettings::default())
    }

    /// Time over USB in one direction: 50 to 250 microseconds, and one in a hundred half a millisecond more.
    fn arrival(&mut self, last: Option<u64>) -> u64 {
        let late = if self.random.unit() < 0.01 { 500_000 } else { 0 };
        let transit = 50_000 + (self.random.unit() * 200_000.0) as u64 + late;
        (self.now.0 + transit).max(last.unwrap_or(0))
    }

    fn run_until(&mut self, end: Nanos) {
        while self.now < end {
            self.now = Nanos(self.now.0 + GRAIN);
            self.deliver();
            self.tick();
            self.device_turn();
        }
    }

    fn deliver(&mut self) {
        while self.to_board.front().is_some_and(|(due, _)| *due <= self.now.0) {
            let (_, bytes) = self.to_board.pop_front().unwrap();
            self.board.receive(self.now, &bytes);
        }
        self.board.advance(self.now);
        let answer = self.board.transmit();
        if !answer.is_empty() {
            let due = self.arrival(self.to_device.back().map(|(due, _)| *due));
            self.to_device.push_back((due, answer));
            // Bytes wake the thread, a little late.
            self.wake = self.wake.min(due + 20_000);
        }
    }

    fn tick(&mut self) {
        if self.ticks && self.now.0 >= self.next_tick {
            self.next_tick += TICK;
            self.last_tick = self.now.0;
            self.exchange.set_order(self.now, self.force);
        }
    }

    fn device_turn(&mut self) {
        if self.now.0 < self.wake {
            return;
        }
        let mut bytes = Vec::new();
        while self.to_device.front().is_some_and(|(due, _)| *due <= self.now.0) {
            bytes.append(&mut self.to_device.pop_front().unwrap().1);
        }
        self.exchange.receive(self.now, &bytes);
        if self.exchange.is_hopeless(self.now) {
            self.connect_again();
        }
        if self.exchange.is_due(self.now) {
            let packet = self.exchange.message(self.now).to_vec();
            let due = self.arrival(self.to_board.back().map(|(due, _)| *due));
            self.to_board.push_back((due, packet));
        }
        // A system wakes a thread up to a twentieth of a millisecond late.
        self.wake = self.now.0 + REST + (self.random.unit() * 50_000.0) as u64;
    }

    fn connect_again(&mut self) {
        self.to_device.clear();
        self.to_board.clear();
        self.exchange.begin(self.now);
    }

    /// Begins a fault; from then on the time to zero is counted.
    fn begin(&mut self, fault: Fault) -> Nanos {
        let mut from = self.now;
        match fault {
            Fault::SceneStops => {
                self.ticks = false;
                // The last sign of life was before.
                from = Nanos(self.last_tick);
            }
            Fault::SceneNotANumber => {
                // It is seen from the next tick on.
                from = Nanos(self.next_tick);
                self.force[2] = f64::NAN;
            }
            Fault::Closed => self.exchange.end(),
            Fault::Board(fault) => {
                self.board.set_fault(self.now, Some(fault));
                if fault == HapiFault::Cut {
                    self.exchange.lose_link();
                    self.to_device.clear();
                    self.to_board.clear();
                }
            }
        }
        from
    }

    fn end(&mut self, fault: Fault) {
        self.ticks = true;
        self.next_tick = self.next_tick.max(self.now.0);
        self.force = FORCE;
        self.board.set_fault(self.now, None);
        if fault == Fault::Board(HapiFault::Cut) {
            self.connect_again();
        }
    }

    /// Whether the hand feels the scene's force: steps of the motors are 2 mN at most, an answer is up to some 0.1 mm old.
    fn has_whole_force(&self) -> bool {
        let [x, y] = self.board.force();
        (x + FORCE[0]).abs() < 0.01 && (y + FORCE[2]).abs() < 0.01
    }
}

/// When the hand has left the home position and is at the surface.
const AT_WORK: Nanos = Nanos::from_millis(600);

/// Time from a fault to zero torque, of a case with its seed.
fn time_to_zero(fault: Fault, seed: u64) -> Nanos {
    let mut bench = Bench::usual(seed);
    let onset = AT_WORK + Nanos((bench.random.unit() * 5_000_000.0) as u64);
    bench.run_until(onset);
    assert!(bench.has_whole_force(), "{fault:?} {seed}: {:?} N before", bench.board.force());
    let from = bench.begin(fault);
    while bench.board.zero_since().is_none() {
        assert!(bench.now < onset + Nanos::from_millis(50), "{fault:?} {seed}: the torque stays");
        bench.run_until(Nanos(bench.now.0 + GRAIN));
    }
    bench.board.zero_since().unwrap_or_default().since(from)
}

#[test]
fn torque_is_zero_within_five_milliseconds_of_any_fault_in_1000_of_1000() {
    let faults = all_faults();
    let mut worst = vec![Nanos::ZERO; faults.len()];
    let mut in_time = 0;
    for seed in 0..CASES {
        let index = seed as usize % faults.len();
        let time = time_to_zero(faults[index], seed);
        worst[index] = worst[index].max(time);
        in_time += u64::from(time <= ZERO_WITHIN);
    }
    for (fault, worst) in faults.iter().zip(&worst) {
        println!("{fault:?}: {:.2} ms at most", worst.seconds().0 * 1e3);
    }
    assert_eq!(in_time, CASES, "{worst:?}");
}

#[test]
fn force_comes_back_by_a_ramp_after_every_fault_that_keeps_the_home_position() {
    for (seed, fault) in all_faults().into_iter().enumerate() {
        if fault == Fault::Closed || loses_home(fault) {
            continue;
        }
        let mut bench = Bench::usual(seed as u64);
        bench.run_until(AT_WORK);
        bench.begin(fault);
        // A cut packet and a jump are over before.
        bench.run_until(AT_WORK + Nanos::from_millis(30));
        bench.end(fault);
        let size = |bench: &Bench| bench.board.force()[0].hypot(bench.board.force()[1]);
        let (mut before, mut steepest, mut largest) = (size(&bench), 0.0_f64, 0.0_f64);
        for millis in 31..=2000 {
            bench.run_until(AT_WORK + Nanos::from_millis(millis));
            steepest = steepest.max(size(&bench) - before);
            before = size(&bench);
            largest = largest.max(before);
        }
        // 0.82 N in 20 ms are 0.041 N a millisecond; a packet that is late by two makes up to three of it.
        assert!(steepest < 0.13, "{fault:?}: {steepest} N in a millisecond");
        assert!(bench.has_whole_force(), "{fault:?}: {:?} N at the end", bench.board.force());
        assert!(largest < 0.2_f64.hypot(0.8) + 0.02, "{fault:?}: {largest} N");
        assert_eq!(bench.exchange.stop(), ForceStop::None, "{fault:?}");
        assert!(bench.board.is_set_up(), "{fault:?}");
    }
}

/// A board that has lost its power, or whose encoders have lost count, does not know where its arm is.
fn loses_home(fault: Fault) -> bool {
    matches!(fault, Fault::Board(HapiFault::Cut | HapiFault::Lie(HapiLie::Jump)))
}

#[test]
fn board_without_its_home_position_gets_zero_and_no_force_again() {
    for fault in all_faults().into_iter().filter(|fault| loses_home(*fault)) {
        let mut bench = Bench::usual(1);
        bench.run_until(AT_WORK);
        bench.begin(fault);
        bench.run_until(AT_WORK + Nanos::from_millis(30));
        bench.end(fault);
        for millis in 31..=1000 {
            bench.run_until(AT_WORK + Nanos::from_millis(millis));
            assert_eq!(bench.board.torques(), [0.0; 2], "{fault:?}");
        }
        assert!(matches!(bench.exchange.line(), LineState::Lost { .. }), "{fault:?}");
        assert_eq!(bench.exchange.stop(), ForceStop::NotReady, "{fault:?}");
        // It was set up once more, so that it takes zero.
        assert!(bench.board.is_set_up(), "{fault:?}");
    }
}

#[test]
fn board_that_runs_on_without_its_cable_keeps_its_torque_until_it_is_back() {
    let settings = HapiBoardSettings { has_own_power: true, ..HapiBoardSettings::default() };
    let mut bench = Bench::new(1, settings);
    bench.run_until(AT_WORK);
    bench.begin(Fault::Board(HapiFault::Cut));
    bench.run_until(AT_WORK + Nanos::from_millis(500));
    // Nothing can be sent: this is what the guide warns of.
    assert_ne!(bench.board.torques(), [0.0; 2]);
    bench.end(Fault::Board(HapiFault::Cut));
    bench.run_until(AT_WORK + Nanos::from_millis(520));
    let first = bench.board.force();
    assert!(first[1].abs() < 0.5, "the force comes back by a ramp: {first:?}");
    bench.run_until(AT_WORK + Nanos::from_millis(800));
    assert!(bench.has_whole_force() && bench.board.is_set_up());
}

#[test]
fn firmware_that_stands_still_keeps_its_torque() {
    // No packet can end it. The emulator shows it, so that the limit is not forgotten.
    let mut bench = Bench::usual(1);
    bench.run_until(AT_WORK);
    bench.begin(Fault::Board(HapiFault::Hung));
    bench.run_until(AT_WORK + Nanos::from_millis(100));
    assert_ne!(bench.board.torques(), [0.0; 2]);
    assert_eq!(bench.exchange.stop(), ForceStop::NoReply);
}

#[test]
fn no_force_asks_a_motor_for_more_than_it_has_or_turns_another_way() {
    let mut bench = Bench::usual(1);
    for force in [[5.0, 0.0, 0.0], [-1.0, 3.0, 9.0], [0.0, 0.0, -1e300], [1e-9, 0.0, 0.0]] {
        bench.force = force;
        bench.run_until(bench.now + AT_WORK);
        let [one, two] = bench.board.torques();
        assert!(one.abs().max(two.abs()) <= TORQUE_MAX_N_M, "{force:?}: {one} {two}");
        let [x, y] = bench.board.force();
        // The plane's axes are against those of the scene; the force along the missing one is not felt.
        let length = force[0].hypot(force[2]);
        let (along, down) = (-force[0] / length, -force[2] / length);
        // A degree: whole steps of the motors, and counts of the encoders.
        let across = (x * down - y * along).abs();
        assert!(across <= 0.02 * x.hypot(y), "{force:?}: {x} {y}");
        assert!(x * along + y * down >= 0.0, "{force:?}: {x} {y}");
    }
}

#[test]
fn figures_are_those_of_linkage_and_firmware() {
    let options = options();
    let (mut lever, mut step) = (0.0_f64, 0.0_f64);
    // The firmware halves the counts of the set-up.
    let count = std::f64::consts::TAU / (0.5 * options.setup.counts);
    for i in 0..=50 {
        for j in 0..=50 {
            let place = [-31.0 + 2.0 * f64::from(i), 40.0 + 2.0 * f64::from(j)];
            let angles = options.linkage.angles(place).unwrap();
            let [[a, b], [c, d]] = options.linkage.jacobian(angles).unwrap();
            lever = lever.max(a.hypot(b)).max(c.hypot(d));
            step = step.max(count * (a + c).hypot(b + d)).max(count * (a - c).hypot(b - d));
        }
    }
    let device = options.figures.device;
    assert!((lever - 75.4).abs() < 0.1 && (step - 0.343).abs() < 0.001, "{lever} {step}");
    assert!(device.force_max_n <= 1e3 * TORQUE_MAX_N_M / lever);
    assert!(device.step_mm >= step);
}
