//! Motion: the slide is where the track says it is, at every moment.

use super::bench::{Host, slide, to, try_connect, wired};
use palpate_drivers::grbl::GrblSettings;
use palpate_drivers::wire::Link;
use palpate_emulators::grbl;
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, RigCommand};

#[test]
fn a_motion_of_many_jogs_is_the_profile_that_was_asked_for() {
    for (speed, target) in [(0.75, 800), (0.75, -900), (6.0, 16_000), (20.0, 32_000), (9.0, 30)] {
        let mut host = Host::new(&slide());
        let command = to(target, speed);
        assert_eq!(host.tell(command), command);
        let mut worst = 0.0_f64;
        while host.has(AxisStatus::MOVING) {
            host.pass(0.005);
            worst = worst.max((host.truth() - host.pulses()).abs());
        }
        // The start is known to half a round trip, 3 ms, and the steps of this emulation are 1 ms.
        let slack = 2.0 + 0.006 * speed / 0.0025;
        assert!(worst <= slack, "{speed} to {target}: {worst} of {slack}");
        assert_eq!((host.pulses(), host.truth()), (target as f64, target as f64));
        assert_eq!(host.faults, []);
    }
}

#[test]
fn a_board_whose_clock_is_off_is_kept_to_the_pace_of_the_host() {
    for resonator in [0.995, 1.005] {
        let mut host = Host::on(
            wired(grbl::EmulatedGrblSettings {
                resonator,
                ..grbl::EmulatedGrblSettings::default()
            }),
            &slide(),
        );
        for (target, worst_s) in [(30_000, 0.03), (0, 0.015)] {
            host.tell(to(target, 0.75));
            let mut worst = 0.0_f64;
            while host.has(AxisStatus::MOVING) {
                host.pass(0.05);
                worst = worst.max((host.truth() - host.pulses()).abs());
            }
            // Unmended it would be half a second at the end of these 100 s, and the jogs sent ahead last 0.3.
            let slack = 2.0 + worst_s * 0.75 / 0.0025;
            assert!(worst <= slack, "{resonator}, to {target}: {worst} of {slack}");
            assert_eq!(host.truth(), target as f64);
        }
        assert_eq!(host.faults, []);
    }
}

#[test]
fn a_board_that_a_cancel_left_suspended_goes_on() {
    let settings =
        grbl::EmulatedGrblSettings { is_suspending: true, ..grbl::EmulatedGrblSettings::default() };
    let mut host = Host::on(wired(settings), &slide());
    host.tell(to(8_000, 5.0));
    host.pass(1.0);
    host.tell(RigCommand::Stop);
    host.settle();
    host.tell(to(400, 5.0));
    host.settle();
    assert_eq!((host.truth(), &host.faults[..]), (400.0, &[][..]));

    // Left so by whoever drove it before.
    host.tell(to(8_000, 5.0));
    host.pass(1.0);
    host.wire.write(&[0x85]).expect("a wire");
    host.wire.lock().pass(Nanos::from_millis(500));
    let again = try_connect(&host.wire, &slide()).expect("it connects");
    assert!(again.identity.contains("1.1h"), "{}", again.identity);
}

#[test]
fn a_long_way_is_cut_and_never_too_much_is_sent() {
    let mut host = Host::new(&slide());
    host.tell(to(24_000, 20.0));
    host.pass(1.0);
    let lines = String::from_utf8_lossy(&host.wire.lock().sent).into_owned();
    let newest: f64 = lines
        .rsplit("G53X")
        .next()
        .and_then(|rest| rest.split('F').next())
        .expect("a jog")
        .parse()
        .expect("a place");
    let ahead = newest - host.truth() * 0.0025;
    assert!(ahead > 3.4 && ahead <= host.connected.worst_case_mm, "{ahead}");
    // Rounded up: it is a bound.
    let stated = format!("{:.1} mm", (host.connected.worst_case_mm * 10.0).ceil() / 10.0);
    assert!(host.connected.identity.contains(&stated), "{stated}");
}

#[test]
fn a_stop_brakes_and_the_place_is_known() {
    let mut host = Host::new(&slide());
    host.tell(to(24_000, 9.0));
    host.pass(1.0);
    let before = host.truth();
    host.ask(RigCommand::Stop);
    host.until("braking", |host| host.has(AxisStatus::STOPPING));
    host.until("stopped", |host| host.acks.contains(&RigCommand::Stop));
    host.settle();
    let way = (host.truth() - before) * 0.0025;
    // Braking from 9 mm/s takes 0.675 mm, and 60 ms go by before it.
    assert!((0.6..1.4).contains(&way), "{way}");
    assert_eq!(host.pulses(), host.truth());
    assert_eq!(host.faults, []);
    host.tell(to(0, 9.0));
    host.settle();
    assert_eq!((host.truth(), host.pulses()), (0.0, 0.0));
}

#[test]
fn a_stop_overtakes_what_waits() {
    let mut host = Host::new(&slide());
    host.ask(to(1000, 5.0));
    host.ask(to(2000, 5.0));
    host.ask(RigCommand::Stop);
    host.until("stopped", |host| host.acks.contains(&RigCommand::Stop));
    host.pass(0.5);
    assert_eq!((host.truth(), host.pulses(), host.faults.len()), (0.0, 0.0, 2));
}

#[test]
fn a_stop_right_behind_the_first_jog_ends_it_too() {
    for pause in 0..12 {
        let mut host = Host::new(&slide());
        host.ask(to(20_000, 5.0));
        host.pass(f64::from(pause) * 0.001);
        host.ask(RigCommand::Stop);
        host.until("stopped", |host| host.acks.contains(&RigCommand::Stop));
        host.settle();
        host.pass(1.0);
        assert_eq!(host.pulses(), host.truth(), "{pause} ms");
        assert!(host.truth() < 1000.0, "{pause} ms: {}", host.truth());
        host.tell(to(0, 5.0));
        host.settle();
        assert_eq!(host.truth(), 0.0);
    }
}

#[test]
fn a_halt_stands_at_once_and_the_rig_must_be_opened_again() {
    let mut host = Host::new(&slide());
    host.tell(to(24_000, 20.0));
    host.pass(1.0);
    let before = host.truth();
    assert_eq!(host.tell(RigCommand::Halt), RigCommand::Halt);
    host.pass(0.2);
    assert!((host.truth() - before) * 0.0025 < 0.2);
    assert!(host.faults[0].to_string().contains("restarted"), "{:?}", host.faults);
    assert!(host.refused(to(0, 5.0)).contains("position is lost"));
    host.pass(1.0);
    assert_eq!(host.faults.len(), 2, "{:?}", host.faults);
}

#[test]
fn a_place_gets_a_new_count() {
    let mut host = Host::new(&slide());
    host.tell(to(2_000, 5.0));
    host.settle();
    let define = RigCommand::DefinePosition { pulses: 10 };
    assert_eq!(host.tell(define), define);
    host.tell(to(110, 5.0));
    host.settle();
    assert_eq!(host.truth(), 2_100.0);
}

#[test]
fn a_reversed_axis_moves_the_other_way() {
    let mut host = Host::new(&GrblSettings { is_reversed: true, ..slide() });
    host.tell(to(-500, 5.0));
    host.settle();
    assert_eq!((host.truth(), host.pulses()), (500.0, -500.0));
}

#[test]
fn home_is_seen_and_the_far_limit_stops() {
    let mut host = Host::new(&slide());
    host.tell(to(-30_000, 9.0));
    host.until("home", |host| host.has(AxisStatus::HOME));
    host.tell(RigCommand::Stop);
    host.settle();
    assert!(host.wire.lock().plant.axis().0 > -1.6, "{:?}", host.wire.lock().plant.axis());
    let away = host.pulses() as i64 + 2_000;
    host.tell(to(away, 9.0));
    host.settle();
    host.pass(0.2);
    assert!(!host.has(AxisStatus::HOME));
    host.tell(to(90_000, 20.0));
    host.until("the limit", |host| host.has(AxisStatus::FORWARD_LIMIT));
    host.settle();
    let end = host.wire.lock().plant.axis().0;
    assert!((152.0..160.0).contains(&end), "{end}");
    assert!(host.has(AxisStatus::FORWARD_LIMIT) && !host.has(AxisStatus::HOME));
    // Off it, and then it closes once more: in doubt which end that is, the axis stops.
    let back = host.pulses() as i64 - 4_000;
    host.tell(to(back, 1.0));
    host.until("off the limit", |host| !host.has(AxisStatus::FORWARD_LIMIT));
    assert_eq!(host.faults, []);
    host.wire.lock().plant.shift_counter(1.0);
    host.until("a fault", |host| !host.faults.is_empty());
    host.pass(0.5);
    assert!(host.has(AxisStatus::FORWARD_LIMIT) && !host.has(AxisStatus::HOME));
    let message = host.faults[0].to_string();
    assert!(message.contains("limit switch"), "{message}");
    assert!(host.truth() > back as f64 + 400.0);
}

#[test]
fn what_cannot_be_done_is_refused_in_words() {
    let mut host = Host::new(&slide());
    let sine = palpate_model::rig::Oscillation {
        amplitude_pulses: 10,
        period_ticks: 100,
        cycles: 1,
        acceleration: palpate_model::units::MmPerS2(60.0),
    };
    for (command, words) in [
        (to(10, 30.0), "rig file"),
        (to(10, 0.01), "Grbl's minimum"),
        (to(1 << 40, 5.0), "ten metres"),
        (RigCommand::Oscillate(sine), "cannot follow a sine"),
    ] {
        let message = host.refused(command);
        assert!(message.contains(words), "{message}");
    }
    // A way that is none is done.
    host.tell(to(0, 5.0));
    host.tell(to(10, 5.0));
}
