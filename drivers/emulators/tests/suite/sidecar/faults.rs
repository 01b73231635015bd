//! Sidecars that die, hang, and lie: the axis stops, and the owner of the rig gets a fault.

use super::bench::{Host, Shared, to};
use palpate_drivers::wire::{Dialogue, Link};
use palpate_emulators::DeviceFault;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::sidecar::{EmulatedSidecarSettings as Emulated, SidecarLie};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, MoveTo, RigCommand};
use palpate_model::units::{MmPerS, MmPerS2};

/// Half a second into a long move at 5 mm/s.
fn moving() -> Host {
    let mut host = Host::new();
    host.tell(RigCommand::EnableMotor);
    host.tell(to(8_000, 5.0));
    host.pass(0.5);
    assert!(host.is_moving());
    host
}

/// A silence of 0.2 s, braking over 0.25 mm, and a sample.
const STOPS_WITHIN_MM: f64 = 5.0 * 0.2 + 0.25 + 0.02;

fn lie(host: &mut Host, lie: SidecarLie) -> f64 {
    let mut wire = host.wire.lock();
    wire.emulator.set_lie(Some(lie));
    wire.emulator.position_mm()
}

fn stands(host: &Host) -> bool {
    !host.wire.lock().emulator.is_moving()
}

#[test]
fn a_lost_link_stops_the_axis_by_itself() {
    let mut host = moving();
    let from = host.position_mm();
    host.wire.lock().is_cut = true;
    host.pass(2.0);
    assert!(host.ending.is_some() && stands(&host));
    let way = host.position_mm() - from;
    assert!(way > 1.0 && way < STOPS_WITHIN_MM, "{way}");
}

#[test]
fn a_deaf_sidecar_stops_by_itself_and_the_link_is_given_up() {
    let mut host = moving();
    host.wire.lock().is_deaf = true;
    let from = host.position_mm();
    host.pass(2.0);
    assert!(stands(&host) && host.position_mm() - from < STOPS_WITHIN_MM);
    assert!(!host.faults.is_empty());
    assert!(host.ending.as_ref().is_some_and(|why| why.contains("stop")), "{:?}", host.ending);
}

#[test]
fn every_lie_stops_the_axis_and_is_reported() {
    for one in [
        SidecarLie::Mute,
        SidecarLie::Jump(400),
        SidecarLie::Jump(-40),
        SidecarLie::ClockBack(50_000),
        SidecarLie::ClockStuck,
        SidecarLie::WrongUnits(25),
        SidecarLie::NotANumber,
        SidecarLie::Flood(5),
        SidecarLie::BeyondConverter,
    ] {
        let mut host = moving();
        let from = lie(&mut host, one);
        host.pass(2.5);
        assert!(stands(&host), "{one:?}");
        // Until it is noticed: a quarter of a second without samples, a second of a flood; then it brakes.
        let far = host.position_mm() - from;
        let most = if matches!(one, SidecarLie::Flood(_)) { 5.5 } else { 5.0 * 0.3 + 0.3 };
        assert!(far < most, "{one:?}: {far}");
        let is_reported = !host.faults.is_empty() || host.ending.is_some();
        assert!(is_reported, "{one:?}");
    }
}

#[test]
fn samples_that_cannot_be_count_in_a_row_whatever_else_is_said() {
    for one in [SidecarLie::ClockStuck, SidecarLie::BeyondConverter] {
        let mut host = moving();
        lie(&mut host, one);
        // Fifty samples, and the answers of two beats.
        host.pass(0.1);
        let is_counted = host.faults.iter().any(|one| one.to_string().contains("mean nothing"));
        assert!(is_counted, "{one:?}: {:?}", host.faults);
        assert!(!host.faults.contains(&Fault::ControllerReset), "{one:?}");
    }
}

#[test]
fn a_flood_of_lines_between_right_samples_ends_the_link_and_lists_few_faults() {
    for word in ["{\"ok\":0}\n", "{\"fault\":\"hot\"}\n", "{\"no\":null,\"why\":\"\"}\n", "?\n"] {
        let mut host = moving();
        let lines = format!("\n{}", word.repeat(20)).into_bytes();
        let spoil = move |byte: u8| if byte == b'\n' { lines.clone() } else { vec![byte] };
        host.wire.lock().spoil = Box::new(spoil);
        let from = host.position_mm();
        host.pass(2.0);
        assert!(stands(&host) && host.ending.is_some(), "{word}: {:?}", host.ending);
        // It brakes within a second, at 5 mm/s.
        assert!(host.position_mm() - from < 5.3, "{word}: {}", host.position_mm() - from);
        assert!(host.faults.len() <= 20, "{word}: {}", host.faults.len());
    }
}

#[test]
fn a_small_jump_is_left_to_the_path() {
    let mut host = moving();
    lie(&mut host, SidecarLie::Jump(30));
    host.pass(0.1);
    assert!(!host.path_errors.is_empty());
}

#[test]
fn a_position_beyond_every_counter_is_no_reading_and_overflows_nothing() {
    let is_possible = |host: &Host| {
        let pulses = host.readings.iter().map(|reading| reading.pulses.unsigned_abs());
        pulses.max().unwrap_or(0) < 1 << 32
    };
    let mut host = moving();
    lie(&mut host, SidecarLie::Jump(1 << 31));
    host.pass(0.5);
    assert!(stands(&host) && is_possible(&host));
    assert!(host.faults[0].to_string().contains("2147483647 pulses"), "{:?}", host.faults);
    // From the first sample on.
    let wire = Shared::new(Emulated::default());
    wire.lock().emulator.set_lie(Some(SidecarLie::Jump(i64::MAX)));
    let mut host = Host::on(wire);
    host.send(RigCommand::DefinePosition { pulses: -1 });
    host.pass(0.1);
    assert_eq!(host.readings, []);
    assert!(host.faults.iter().any(|fault| fault.to_string().contains("cannot be defined")));
}

#[test]
fn a_motion_that_is_acknowledged_and_not_made_is_reported() {
    let mut host = Host::new();
    host.tell(RigCommand::EnableMotor);
    lie(&mut host, SidecarLie::Lazy);
    host.tell(to(4_000, 5.0));
    host.pass(0.5);
    assert!(host.faults[0].to_string().contains("does not move"), "{:?}", host.faults);
    assert!(host.sent().contains("stop"));
}

#[test]
fn a_stop_before_the_answer_of_a_move_is_no_missing_motion() {
    let mut host = Host::new();
    host.tell(RigCommand::EnableMotor);
    host.send(to(8_000, 5.0));
    // The move and the stop are under way at once; the axis never gets going.
    for word in ["move", "stop"] {
        while !host.sent().contains(word) {
            let line = host.session.take_line(host.now()).expect("something to say");
            host.wire.clone().write(&line).unwrap();
        }
        if word == "move" {
            host.send(RigCommand::Stop);
        }
    }
    host.pass(1.0);
    assert_eq!(host.acks.last(), Some(&RigCommand::Stop));
    assert!(stands(&host) && host.position_mm().abs() < 1e-9);
    host.assert_clean();
}

/// A computer that looks every 25 ms only, for good, and one that stood still for a second.
#[test]
fn silence_is_noticed_by_a_slow_computer_and_its_pause_is_none() {
    let mut host = moving();
    let ms = Nanos::from_millis;
    let mut now = host.now();
    let mut ended_after = None;
    for turn in 1..=400 {
        now = now + ms(25);
        host.session.note_attendance(now);
        while host.session.take_line(now).is_some() {}
        if host.session.is_dead(now).is_some() {
            ended_after = Some(25 * turn);
            break;
        }
    }
    // A second is excused, and after another one without a sample the link is dead.
    assert!(ended_after.is_some_and(|ms| (1_000..=2_500).contains(&ms)), "{ended_after:?}");
    let mut host = Host::new();
    host.wire.pass(1.0);
    host.pass(2.0);
    host.assert_clean();
}

#[test]
fn a_restart_loses_the_position_and_refuses_motions() {
    let mut host = moving();
    let now = host.now();
    host.wire.lock().emulator.apply_fault(now, DeviceFault::Reset, true);
    host.pass(0.3);
    assert!(stands(&host));
    assert!(host.faults.contains(&Fault::ControllerReset), "{:?}", host.faults);
    host.send(to(10, 1.0));
    host.pass(0.1);
    assert!(host.faults.last().unwrap().to_string().contains("restarted"), "{:?}", host.faults);
    assert!(stands(&host));
    // Samples do not come before it is introduced again: the link is given up.
    host.pass(2.0);
    assert!(host.ending.is_some());
}

#[test]
fn without_an_owner_who_takes_samples_the_axis_stops() {
    let mut host = moving();
    host.is_attended = false;
    let from = host.position_mm();
    host.pass(1.5);
    assert!(stands(&host) && host.position_mm() - from < 5.0 * 0.5 + 0.3);
    assert_eq!(host.ending, None, "beats go on");
    assert!(host.faults[0].to_string().contains("no samples were taken"));
}

#[test]
fn a_stop_that_is_accepted_and_not_obeyed_ends_the_link_and_silence_stops_the_axis() {
    let mut host = moving();
    lie(&mut host, SidecarLie::DeafToStops);
    host.tell(RigCommand::Stop);
    let from = host.position_mm();
    host.pass(0.9);
    // It would stand after 0.1 s and 0.25 mm; answers and samples are in order.
    assert!(!stands(&host) && host.ending.is_none() && host.position_mm() - from > 4.0);
    host.pass(1.1);
    assert!(host.ending.as_ref().is_some_and(|why| why.contains("moves on")), "{:?}", host.ending);
    // A second until it is given up, and the silence of the host.
    let way = host.position_mm() - from;
    assert!(stands(&host) && way < 5.0 + STOPS_WITHIN_MM + 0.1, "{way}");
    // An honest one is kept, also while it brakes for longer than that: 5 mm/s at 2.5 mm/s2.
    let mut host = Host::new();
    host.tell(RigCommand::EnableMotor);
    let (speed, acceleration) = (MmPerS(5.0), MmPerS2(2.5));
    host.tell(RigCommand::MoveTo(MoveTo { target_pulses: 40_000, speed, acceleration }));
    host.pass(3.0);
    host.tell(RigCommand::Stop);
    host.pass(1.5);
    assert!(!stands(&host));
    host.pass(1.5);
    assert!(stands(&host));
    host.assert_clean();
}

#[test]
fn garbled_lines_are_counted_and_noise_stops_the_axis() {
    let settings = Emulated { has_checksum: true, ..Emulated::default() };
    let mut host = Host::on(Shared::new(settings));
    host.tell(RigCommand::EnableMotor);
    host.tell(to(8_000, 5.0));
    host.pass(0.3);
    let mut count = 0_u32;
    // Every 20 000th byte is changed: a garbled line now and then stops nothing.
    host.wire.lock().spoil = Box::new(move |byte| {
        count += 1;
        vec![if count.is_multiple_of(20_000) { byte ^ 1 } else { byte }]
    });
    host.pass(2.0);
    assert!(host.is_moving());
    host.assert_clean();
    // All of them are.
    host.wire.lock().spoil = Box::new(|byte| vec![if byte == b'}' { b')' } else { byte }]);
    host.pass(1.5);
    assert!(stands(&host));
    assert!(host.faults[0].to_string().contains("mean nothing"), "{:?}", host.faults);
    assert!(host.ending.is_some());
}
