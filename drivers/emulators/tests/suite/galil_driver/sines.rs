//! Sines in contour mode.

use super::bench::{Host, thesis, to};
use palpate_drivers::galil::{GalilSettings, Sampling};
use palpate_drivers::wire::Dialogue;
use palpate_model::rig::{AxisStatus, Oscillation, PathTracker, RigCommand};
use palpate_model::units::MmPerS2;

fn sine(amplitude_pulses: i64, period_ticks: u32, cycles: u32) -> Oscillation {
    Oscillation { amplitude_pulses, period_ticks, cycles, acceleration: MmPerS2(61.44) }
}

fn at_forty(settings: &GalilSettings) -> Host {
    let mut host = Host::new(settings);
    host.until("a sample", |host| !host.readings.is_empty());
    host.tell(RigCommand::EnableMotor);
    host.tell(to(40, 4.98));
    host.settle();
    host.pass(0.1);
    host
}

#[test]
fn a_sine_is_made_to_the_tick_and_ends_where_it_began() {
    for sampling in [Sampling::Poll, Sampling::Record] {
        for reversed in [false, true] {
            let settings = GalilSettings { sampling, is_reversed: reversed, ..thesis() };
            for (amplitude, period, cycles) in [(50, 2000, 2), (-20, 513, 5), (90, 1024, 3)] {
                let mut host = at_forty(&settings);
                let wanted = sine(amplitude, period, cycles);
                let mut tracker = PathTracker::new(&host.connected.description);
                for reading in host.readings.drain(..) {
                    // It does not know the way here.
                    if !reading.status.has(AxisStatus::MOVING) && reading.pulses == 40 {
                        tracker.on_reading(&reading).unwrap();
                    }
                }
                tracker.on_oscillate(wanted);
                let made = host.tell(RigCommand::Oscillate(wanted));
                assert!(RigCommand::Oscillate(wanted).is_answered_by(&made));
                host.until("moving", |host| !host.is_at_rest());
                host.settle();
                host.pass(0.1);
                let moving: Vec<u64> = host
                    .readings
                    .iter()
                    .filter(|one| one.status.has(AxisStatus::MOVING))
                    .map(|one| one.tick)
                    .collect();
                let ticks = moving[moving.len() - 1] - moving[0];
                assert!(
                    ticks.abs_diff(u64::from(period * cycles)) < 12,
                    "{ticks} of {period} * {cycles}"
                );
                for reading in &host.readings {
                    tracker.on_reading(reading).unwrap();
                }
                assert!(tracker.is_at_rest());
                assert_eq!(host.newest().pulses, 40);
                let far = host.readings.iter().map(|one| one.pulses - 40);
                let far = far.max_by_key(|way| way.abs()).unwrap();
                assert!((far - 2 * amplitude).abs() <= 1, "{far}");
                assert_eq!(host.faults, []);
                // The mode is over: a move is possible.
                host.tell(to(50, 4.98));
                host.settle();
            }
        }
    }
}

#[test]
fn a_stop_in_the_middle_ends_it() {
    for stop in [RigCommand::Stop, RigCommand::Halt] {
        let mut host = at_forty(&thesis());
        host.tell(RigCommand::Oscillate(sine(50, 1000, 20)));
        host.pass(1.3);
        assert_eq!(host.tell(stop), stop);
        host.settle();
        let rest = host.newest().pulses;
        host.pass(1.0);
        assert_eq!(host.newest().pulses, rest);
        assert_eq!(host.faults, []);
        host.tell(to(40, 4.98));
        host.settle();
        assert_eq!(host.newest().pulses, 40);
    }
}

#[test]
fn a_dead_link_lets_the_axis_stand_within_the_lead() {
    use palpate_emulators::EmulatedDevice;
    let mut host = at_forty(&thesis());
    host.tell(RigCommand::Oscillate(sine(50, 1000, 20)));
    host.pass(1.3);
    let mut wire = host.wire.lock();
    let place = |wire: &mut super::bench::Wire, now| {
        wire.emulator.transmit(0);
        wire.emulator.receive(now, 0, b"MG _TDA\r");
        String::from_utf8(wire.emulator.transmit(0)).unwrap()
    };
    let mut now = wire.now + palpate_model::Nanos::from_millis(600);
    wire.emulator.advance(now);
    let rest = place(&mut wire, now);
    for _ in 0..10 {
        now = now + palpate_model::Nanos::from_millis(100);
        wire.emulator.advance(now);
        assert_eq!(place(&mut wire, now), rest);
    }
    assert!(!wire.emulator.is_running(0));
}

#[test]
fn a_computer_that_is_late_breaks_the_sine_off() {
    let mut host = at_forty(&thesis());
    host.tell(RigCommand::Oscillate(sine(50, 1000, 20)));
    host.pass(1.3);
    // For 450 ms nothing is sent, and nothing is read: the buffer is empty, and the watchdog may have stopped the axis.
    {
        use palpate_emulators::EmulatedDevice;
        let mut wire = host.wire.lock();
        wire.now = wire.now + palpate_model::Nanos::from_millis(450);
        let now = wire.now;
        wire.emulator.advance(now);
    }
    host.until("printed", |host| !host.faults.is_empty());
    assert!(host.faults[0].to_string().contains("was aborted"), "{:?}", host.faults);
    host.settle();
    host.tell(to(40, 4.98));
    host.settle();
    assert_eq!(host.newest().pulses, 40);
}

#[test]
fn what_the_axis_cannot_follow_is_refused() {
    let mut host = at_forty(&thesis());
    for (command, why) in [
        (sine(2000, 1000, 1), "needs a speed"),
        (sine(100, 100, 1), "needs a speed"),
        (sine(0, 100, 1), "zero"),
    ] {
        let before = host.faults.len();
        let now = host.now();
        host.session.command(now, RigCommand::Oscillate(command));
        host.until("refused", |host| host.faults.len() > before);
        let printed = host.faults[before].to_string();
        assert!(printed.contains(why), "{printed}");
    }
    assert!(host.is_at_rest());
}
