//! The haptic loop as a thread: what it hands over is whole, and a tick neither allocates nor waits; nor does one of the
//! deformable surface.

use palpate_haptics::Period;
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_haptics::simulation::SimulationSettings;
use palpate_haptics::surface::{
    ContactSide, Cut, Grid, GridNode, HeightField, Surface, SurfaceContact, SurfaceMethod,
    SurfaceRecovery,
};
use palpate_model::Seconds;
use palpate_model::units::MmPerS;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_runner::haptics::{GuidedDevice, LoopTask, RealTimeLoop, SimulatedMasterSlave};
use palpate_test_support::wait::{Deadline, until};

fn device(period: Period) -> SimulatedMasterSlave {
    let path = HandPath::RampHold { from: 0.0, to: 30.0, speed: 50.0 };
    let settings =
        SimulationSettings::of(ModifiedKelvin::THESIS, period, SimulatedHand::firm(path));
    SimulatedMasterSlave::new(&settings).expect("a device")
}

#[test]
fn haptic_tick_allocates_nothing() {
    let mut device = device(Period::MILLISECOND);
    let mut seen = *device.last();
    let counted = allocation_counter::measure(|| {
        for tick in 0..20_000_u64 {
            // Stalls too.
            device.tick(1 + u64::from(tick % 997 == 0) * 20);
            device.show(&mut seen);
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert!(seen.snapshot.is_whole());
    // Nor does one whose hand is led from a window.
    let hand = SimulatedHand::firm(HandPath::Still { at: 0.0 });
    let settings = SimulationSettings::of(ModifiedKelvin::THESIS, Period::MILLISECOND, hand);
    let mut led = GuidedDevice::new(&settings, MmPerS(50.0)).expect("a device");
    let (lead, mut live) = (led.hand_target(), led.view().clone());
    let counted = allocation_counter::measure(|| {
        for tick in 0..20_000_u64 {
            lead.set((tick / 1_000) as f64);
            led.tick(1);
            led.show(&mut live);
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert!(live.last.snapshot.is_whole() && live.count() == 5_000);
    // The counter counts.
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![1_u8; 100])));
    assert_eq!(counted.count_total, 1);
}

/// How often the thread that asks gave its processor away of its own accord, as every wait for a lock does.
#[cfg(target_os = "linux")]
fn waits() -> u64 {
    let status = std::fs::read_to_string("/proc/thread-self/status").expect("Linux has it");
    let mut lines = status.lines();
    let count = lines.find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
    count.and_then(|count| count.trim().parse().ok()).expect("a count")
}

#[cfg(target_os = "linux")]
#[test]
fn haptic_tick_never_waits() {
    let mut device = device(Period::MILLISECOND);
    let (mut shown, mut seen) = triple_buffer::triple_buffer(device.last());
    let reader = std::thread::Builder::new().spawn(move || {
        let mut last = 0;
        for _ in 0..100_000 {
            last = seen.read().snapshot.tick;
        }
        last
    });
    let mut ticks = |count| {
        for _ in 0..count {
            device.tick(1);
            device.show(shown.input_buffer_mut());
            shown.publish();
        }
    };
    // The first reading of the count opens the file, and the first ticks read the program from the disk: both may wait.
    waits();
    ticks(100);
    let before = waits();
    ticks(20_000);
    let after = waits();
    // Reading the count itself may wait once.
    assert!(after - before <= 1, "{before} {after}");
    // The count counts.
    std::thread::sleep(std::time::Duration::from_millis(1));
    assert!(waits() > after);
    reader.unwrap().join().unwrap();
}

/// A surface of a method, and tools that press, pull and slide over it, at times more of them than are worked through
/// together.
fn poked(method: SurfaceMethod) -> impl FnMut(usize) {
    let grid = Grid::new(41, 41, 0.5).expect("a grid");
    let field = HeightField::flat(grid, 0.05).expect("a field");
    let recovery = SurfaceRecovery::new(Seconds(0.05), Seconds(1e-3)).expect("a recovery");
    let mut surface = Surface::new(field, method, recovery, Cut::NONE);
    move |tick| {
        let contacts: [SurfaceContact; 20] = std::array::from_fn(|tool| {
            let [column, row] = [7 * tick + 11 * tool, tick / 3 + 31 * tool].map(|at| at % 41);
            let node = GridNode { column: column as u16, row: row as u16 };
            let (z, side) = match tool % 3 {
                0 => (1.5, ContactSide::Pull),
                _ => (-2.0, ContactSide::Push),
            };
            SurfaceContact::at(&grid, node, z, side)
        });
        let effect = surface.tick(&contacts[..[0, 1, 3, 20][tick % 4]]);
        assert!(!effect.dirty.is_empty() || tick % 4 == 0);
    }
}

#[test]
fn surface_tick_allocates_nothing() {
    for method in SurfaceMethod::ALL {
        let mut tick = poked(method);
        // From the first tick on: all there is was made before.
        let counted = allocation_counter::measure(|| (0..400).for_each(&mut tick));
        assert_eq!(counted.count_total, 0, "{method:?}: {counted:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn surface_tick_never_waits() {
    for method in SurfaceMethod::ALL {
        let mut tick = poked(method);
        // The first ones read the program from the disk.
        waits();
        (0..100).for_each(&mut tick);
        let before = waits();
        (100..500).for_each(&mut tick);
        let after = waits();
        // Reading the count itself may wait once.
        assert!(after - before <= 1, "{method:?}: {before} {after}");
    }
}

#[test]
fn shared_view_is_never_torn_and_never_goes_back_in_time() {
    let period = Period::of_rate(10_000.0).unwrap();
    let device = device(period);
    let first = *device.last();
    let mut beat = RealTimeLoop::start(device, period, first).unwrap();
    let (mut newest, mut changes, mut read) = (0, 0, 0_u32);
    let end = Deadline::new();
    // However seldom the loop gets a processor.
    while read < 1_000_000 || changes <= 10 {
        assert!(!end.is_over(), "{changes} changes in {read} reads");
        read += 1;
        let seen = &beat.view().snapshot;
        assert!(seen.is_whole(), "read {read}: {seen:?}");
        assert!(seen.tick >= newest, "read {read}");
        changes += u32::from(seen.tick > newest);
        newest = seen.tick;
    }
    let kept = beat.timing();
    assert!(kept.work.count > 10 && kept.period.p50.0 > 0.0, "{kept:?}");
    let last = beat.end().unwrap();
    assert!(last.last().snapshot.tick >= newest);
}

#[test]
fn overrunning_loop_leaves_the_core_to_other_threads() {
    /// Keeps the core for twice its time, and counts what was due.
    #[derive(Default)]
    struct HeavyTask {
        calls: u64,
        ticks: u64,
    }
    impl LoopTask for HeavyTask {
        type View = u64;
        fn tick(&mut self, elapsed: u64) {
            self.calls += 1;
            // The first ones may follow each other.
            if self.calls > 20 {
                self.ticks += elapsed;
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        fn show(&self, view: &mut u64) {
            *view = self.calls;
        }
    }
    let period = Period::of_rate(250.0).unwrap();
    let mut beat = RealTimeLoop::start(HeavyTask::default(), period, 0).unwrap();
    until(|| (*beat.view() >= 60).then_some(()), || "60 calls".into());
    let task = beat.end().unwrap();
    // 10 ms of work and 4 of rest are three and a half ticks of 4 ms; without the rest two and a half.
    let due = task.ticks as f64 / (task.calls - 20) as f64;
    assert!(due >= 3.25, "{due}");
}

#[test]
fn missed_ticks_are_counted_and_none_is_lost() {
    /// Sleeps through some ticks now and then, which a loop must never do.
    struct SleepyTask {
        calls: u64,
        ticks: u64,
    }
    impl LoopTask for SleepyTask {
        type View = (u64, u64);
        fn tick(&mut self, elapsed: u64) {
            self.calls += 1;
            self.ticks += elapsed;
            if self.calls.is_multiple_of(50) {
                std::thread::sleep(std::time::Duration::from_millis(5));
            }
        }
        fn show(&self, view: &mut (u64, u64)) {
            *view = (self.calls, self.ticks);
        }
    }
    let task = SleepyTask { calls: 0, ticks: 0 };
    let mut beat = RealTimeLoop::start(task, Period::MILLISECOND, (0, 0)).unwrap();
    until(|| (beat.view().0 >= 200).then_some(()), || "200 calls".into());
    let kept = beat.timing();
    assert!(beat.is_alive());
    let task = beat.end().unwrap();
    assert!(kept.overruns >= 4 && kept.missed >= 12, "{kept:?}");
    // A busy computer makes any of them long, and none shorter than it slept.
    assert!(kept.work.max.0 >= 0.005, "{kept:?}");
    // Calls and misses are all ticks that were due.
    assert!(task.ticks >= task.calls + kept.missed, "{} {}", task.ticks, task.calls);
}
