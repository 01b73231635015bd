//! What goes wrong in mid-move.

use super::bench::{Host, to};
use palpate_drivers::wire::Dialogue;
use palpate_emulators::{DeviceFault, EmulatedDevice};
use palpate_model::rig::{Fault, RigCommand};

#[test]
fn silence_in_mid_move_ends_at_the_target_at_the_latest() {
    let mut host = Host::new();
    host.tell(to(600, 2.0));
    host.pass(1.0);
    assert!(host.is_moving());
    host.wire.lock().spoil = Box::new(|_| Vec::new());
    host.wire.lock().is_deaf = true;
    let start = host.now();
    while host.session.is_dead(host.now()).is_none() {
        host.turn().expect("the wire is whole");
    }
    assert!(host.now().since(start).0 < 2_000_000_000);
    // Stops were sent and did not arrive; the stand's own limit holds.
    assert!(host.sent().contains('s'));
    host.pass(5.0);
    assert!(!host.wire.lock().emulator.is_moving());
    assert!((host.travel() + 6.0).abs() < 0.006, "{}", host.travel());
}

#[test]
fn a_mute_line_stops_it_before() {
    let mut host = Host::new();
    host.tell(to(6_000, 2.0));
    host.pass(1.0);
    host.wire.lock().spoil = Box::new(|_| Vec::new());
    host.pass(1.0);
    assert!(!host.wire.lock().emulator.is_moving());
    assert!(host.travel() > -4.0, "{}", host.travel());
}

#[test]
fn a_palpate_that_hangs_stops_it() {
    let mut host = Host::new();
    host.tell(to(6_000, 2.0));
    host.pass(1.0);
    host.is_attended = false;
    host.pass(1.0);
    assert!(!host.is_moving());
    assert!(host.travel() > -4.0, "{}", host.travel());
}

#[test]
fn somebody_stops_it_at_its_panel() {
    let mut host = Host::new();
    host.tell(to(6_000, 2.0));
    host.pass(1.0);
    let now = host.now();
    host.wire.lock().emulator.receive(now, 0, b"s");
    host.until("at rest", |host| !host.is_moving());
    assert!((host.newest().pulses as f64 * 0.01 + host.travel()).abs() < 0.006);
    assert!(host.path.is_at_rest() && host.path_errors.is_empty(), "{:?}", host.path_errors);
}

#[test]
fn somebody_moves_it_at_its_panel() {
    let mut host = Host::new();
    host.go(300, 2.0);
    let now = host.now();
    host.wire.lock().emulator.receive(now, 0, b"mu");
    host.pass(1.0);
    // Its target was 3 mm in; it is where it has gone since, by its own travel.
    assert!((host.travel() + 3.0).abs() > 0.1, "{}", host.travel());
    let first = host.path_errors.first().expect("it is noticed");
    assert_eq!(first.expected_pulses, 300.0);
    assert!((1..50).contains(&(first.reported_pulses - 300).abs()));
    assert!((host.newest().pulses as f64 * 0.01 + host.travel()).abs() < 0.02);
}

#[test]
fn a_stand_that_does_not_begin_is_reported() {
    let mut host = Host::new();
    host.pass(0.1);
    host.send(to(600, 2.0));
    // The letter is lost, the rest is not.
    let mut is_lost = false;
    while !is_lost {
        while let Some(line) = host.session.take_line(host.now()) {
            if line == b"d" {
                is_lost = true;
            } else {
                palpate_drivers::wire::Link::write(&mut host.wire, &line)
                    .expect("the wire is whole");
            }
        }
        host.turn().expect("the wire is whole");
    }
    host.pass(2.0);
    let printed = host.faults.last().expect("a fault").to_string();
    assert!(printed.contains("does not start"), "{printed}");
    assert_eq!(host.travel(), 0.0);
}

#[test]
fn garbled_answers_are_not_taken() {
    let mut host = Host::new();
    // Every 97th byte from the stand is another one.
    let mut count = 0;
    host.wire.lock().spoil = Box::new(move |byte| {
        count += 1;
        vec![if count % 97 == 0 { byte ^ 0x80 } else { byte }]
    });
    host.pass(10.0);
    assert!(host.readings.len() > 100, "{}", host.readings.len());
    assert!(host.readings.iter().all(|r| r.volts.0.abs() < 0.05 && r.pulses == 0));
    assert!(host.session.stats().resynchronised > 0);
    assert!(host.session.is_dead(host.now()).is_none());
}

#[test]
fn a_key_of_the_gauge_is_noticed() {
    let mut host = Host::new();
    let now = host.now();
    host.wire.lock().emulator.receive(now, 0, b"/LB\r\\");
    host.pass(0.2);
    assert!(host.faults.iter().any(|f| matches!(f, Fault::SignalInvalid { .. })));
}

#[test]
fn an_overload_reads_the_end_of_the_range() {
    let mut host = Host::new();
    let now = host.now();
    host.wire.lock().emulator.apply_fault(now, DeviceFault::Saturated, true);
    host.pass(0.2);
    assert!((host.newest().volts.0 - 27.5).abs() < 1e-9);
}

#[test]
fn an_overload_in_mid_move_stops_it_and_is_reported_once() {
    let mut host = Host::new();
    host.tell(to(6_000, 2.0));
    host.pass(1.0);
    let now = host.now();
    let before = host.travel();
    host.wire.lock().emulator.apply_fault(now, DeviceFault::Saturated, true);
    host.pass(1.0);
    assert!(!host.wire.lock().emulator.is_moving());
    assert!((host.travel() - before).abs() < 0.5, "{}", host.travel());
    let printed = |host: &Host| {
        let is_it = |fault: &&Fault| fault.to_string().contains("range");
        host.faults.iter().filter(is_it).count()
    };
    assert_eq!(printed(&host), 1, "{:?}", host.faults);
    // Within the range and beyond it again.
    for is_on in [false, true] {
        let now = host.now();
        host.wire.lock().emulator.apply_fault(now, DeviceFault::Saturated, is_on);
        host.pass(0.2);
    }
    assert_eq!(printed(&host), 2, "{:?}", host.faults);
}

#[test]
fn a_cut_wire_leaves_it_at_its_target() {
    let mut host = Host::new();
    host.tell(to(600, 2.0));
    host.pass(1.0);
    host.wire.lock().is_cut = true;
    assert!(host.turn().is_err());
    for _ in 0..400 {
        let mut wire = host.wire.lock();
        wire.now = wire.now + palpate_model::Nanos::from_millis(10);
        let now = wire.now;
        wire.emulator.advance(now);
    }
    assert!((host.travel() + 6.0).abs() < 0.006);
    assert_eq!(
        host.acks,
        [RigCommand::MoveTo(match to(600, 2.0) {
            RigCommand::MoveTo(to) => to,
            _ => unreachable!("it is a move"),
        })]
    );
}

#[test]
fn a_crosshead_that_falls_behind_is_reported_where_it_is() {
    let mut host = Host::new();
    host.tell(to(6_000, 2.0));
    host.pass(1.0);
    // Somebody sets the slowest speed at the panel.
    let now = host.now();
    host.wire.lock().emulator.receive(now, 0, b"k");
    host.pass(0.5);
    let first = host.path_errors.first().expect("it is noticed");
    assert!(first.expected_pulses > first.reported_pulses as f64, "{first}");
    assert!((host.newest().pulses as f64 * 0.01 + host.travel()).abs() < 0.011);
}

#[test]
fn late_answers_are_not_taken_for_fresh_ones() {
    for delay_ms in [450, 700, 1_300] {
        let mut host = Host::new();
        host.tell(to(6_000, 2.0));
        host.pass(1.0);
        host.wire.lock().delay = palpate_model::Nanos::from_millis(delay_ms);
        host.pass(0.1);
        let before = host.readings.len();
        while host.session.is_dead(host.now()).is_none() {
            host.turn().expect("the wire is whole");
        }
        assert_eq!(host.readings.len(), before, "{delay_ms} ms");
        assert!(!host.wire.lock().emulator.is_moving());
        assert!(host.travel() > -4.0);
    }
}
