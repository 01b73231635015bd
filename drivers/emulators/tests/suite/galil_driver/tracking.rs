//! Targets on the way: how the driver sends them, and every stop while the axis tracks them.

use super::bench::{Host, thesis, to, try_connect, wired};
use palpate_drivers::galil::GalilSettings;
use palpate_drivers::wire::Dialogue;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::galil::{EmulatedGalilSettings, GalilModel};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, PathTracker, RigCommand};

fn track(target_pulses: i64, speed: f64) -> RigCommand {
    let RigCommand::MoveTo(wanted) = to(target_pulses, speed) else {
        panic!("no move");
    };
    RigCommand::Track(wanted)
}

fn enabled(settings: &GalilSettings) -> Host {
    let mut host = Host::new(settings);
    host.until("a sample", |host| !host.readings.is_empty());
    host.tell(RigCommand::EnableMotor);
    host
}

fn lines(host: &Host) -> String {
    String::from_utf8(host.wire.lock().lines.clone()).unwrap()
}

/// On its way to a place far off.
fn under_way(settings: &GalilSettings) -> Host {
    let mut host = enabled(settings);
    let wanted = track(3000, 19.98);
    assert!(wanted.is_answered_by(&host.tell(wanted)));
    host.pass(0.6);
    assert!(!host.is_at_rest());
    host
}

#[test]
fn mode_is_found_by_asking_for_it() {
    assert!(Host::new(&thesis()).connected.description.takes_targets);
    let old =
        EmulatedGalilSettings { model: GalilModel::Dmc2143, ..EmulatedGalilSettings::default() };
    assert!(!try_connect(&wired(old), &thesis()).unwrap().description.takes_targets);
}

#[test]
fn target_replaces_the_one_on_the_way_in_one_line_and_the_path_is_believed() {
    for is_reversed in [false, true] {
        let mut host = enabled(&GalilSettings { is_reversed, ..thesis() });
        let mut path = PathTracker::new(&host.connected.description);
        for reading in host.readings.drain(..) {
            path.on_reading(&reading).unwrap();
        }
        let mut give = |host: &mut Host, target: i64, seconds: f64| {
            let command = track(target, 9.0);
            let RigCommand::Track(wanted) = command else { panic!("no target") };
            path.on_track(wanted);
            host.tell(command);
            host.pass(seconds);
            for reading in host.readings.drain(..host.readings.len() - 1) {
                path.on_reading(&reading).unwrap();
            }
        };
        give(&mut host, 2000, 0.5);
        assert!(!host.is_at_rest());
        // Further on, back, and a little beside where it is: nothing waits for rest.
        let sent = lines(&host).len();
        give(&mut host, 2500, 0.2);
        assert_eq!(lines(&host)[sent..].matches("SPA").count(), 0);
        give(&mut host, 100, 0.05);
        assert!(!host.is_at_rest());
        give(&mut host, 110, 3.0);
        assert!(host.is_at_rest());
        assert_eq!(host.newest().pulses, 110);
        // A move from rest leaves the mode.
        host.tell(to(50, 9.0));
        host.settle();
        assert_eq!(host.newest().pulses, 50);
        assert_eq!(host.faults, []);
        let bench = lines(&host);
        assert!(bench.contains("PTA=1") && bench.contains("PTA=0;SPA"), "{bench}");
        // When the mode begins, the target is the new one, whatever a stop left behind.
        let begun = &bench[..bench.find("PTA=1").unwrap()];
        let target = begun.rfind("PAA=").unwrap();
        let first = if is_reversed { "PAA=-2000" } else { "PAA=2000" };
        assert!(begun[target..].starts_with(first), "{bench}");
    }
}

#[test]
fn stop_and_halt_end_tracking_on_the_way() {
    for stop in [RigCommand::Stop, RigCommand::Halt] {
        let mut host = under_way(&thesis());
        let before = host.newest().pulses;
        // A target that waits behind a stop is not sent.
        let now = host.now();
        host.session.command(now, track(5000, 19.98));
        host.session.command(now, stop);
        host.until("stopped", |host| host.acks.contains(&stop));
        host.settle();
        // 20 mm/s brake within 3.3 mm, and a halt within samples.
        let most = if stop == RigCommand::Stop { 250 } else { 30 };
        assert!((0..most).contains(&(host.newest().pulses - before)), "{}", host.newest().pulses);
        let rested = host.newest().pulses;
        host.pass(0.5);
        assert_eq!(host.newest().pulses, rested);
        // It is followed again afterwards.
        host.tell(track(rested + 100, 9.0));
        // The acknowledgement comes before the first sample in motion.
        host.pass(0.1);
        host.settle();
        assert_eq!(host.newest().pulses, rested + 100);
    }
}

#[test]
fn limit_switch_ends_tracking() {
    let mut host = enabled(&thesis());
    host.tell(track(-3000, 19.98));
    host.until("the limit", |host| host.newest().status.has(AxisStatus::REVERSE_LIMIT));
    host.settle();
    let rested = host.newest().pulses;
    let now = host.now();
    host.session.command(now, track(-3001, 19.98));
    host.until("a refusal", |host| !host.faults.is_empty());
    host.pass(0.3);
    assert_eq!(host.newest().pulses, rested);
}

#[test]
fn axis_that_tracks_stops_when_the_computer_falls_silent_or_takes_no_samples() {
    // The watchdog's program ends the mode with its stop.
    let host = under_way(&thesis());
    let before = host.newest().pulses;
    let wire = host.wire.clone();
    drop(host);
    let is_running = {
        let mut wire = wire.lock();
        let end = wire.now + Nanos::from_millis(2000);
        while wire.now < end {
            wire.pass(Nanos::from_millis(1));
        }
        wire.emulator.is_running(0)
    };
    assert!(!is_running);
    // Without one the session does it, while no samples are taken.
    let mut host = under_way(&GalilSettings { has_watchdog: false, ..thesis() });
    host.is_attended = false;
    host.pass(1.5);
    assert!(host.is_at_rest() && host.newest().pulses > before);
}

#[test]
fn mode_that_something_else_has_ended_is_noticed() {
    // On a network, where another program has a line of its own.
    let network = EmulatedGalilSettings { is_serial: false, ..EmulatedGalilSettings::default() };
    let wire = wired(network);
    for channel in [0, 1] {
        wire.lock().emulator.connect(Nanos::ZERO, channel);
    }
    let mut host = Host::on(wire, &thesis());
    host.until("a sample", |host| !host.readings.is_empty());
    host.tell(RigCommand::EnableMotor);
    host.tell(track(3000, 19.98));
    host.pass(0.6);
    {
        let mut wire = host.wire.lock();
        let now = wire.now;
        wire.emulator.receive(now, 1, b"STA\r");
    }
    host.settle();
    let now = host.now();
    host.session.command(now, track(0, 19.98));
    host.until("a refusal", |host| !host.faults.is_empty());
    let Some(Fault::CommandRefused { detail }) = host.faults.last() else {
        panic!("{:?}", host.faults);
    };
    assert!(detail.contains("position tracking"), "{detail}");
}

#[test]
fn path_of_a_tracking_axis_is_refused_where_it_cannot_have_come() {
    let mut host = enabled(&thesis());
    let mut path = PathTracker::new(&host.connected.description);
    let RigCommand::Track(wanted) = track(400, 9.0) else { panic!("no target") };
    for reading in host.readings.drain(..) {
        path.on_reading(&reading).unwrap();
    }
    path.on_track(wanted);
    host.tell(RigCommand::Track(wanted));
    host.pass(0.3);
    for reading in &host.readings {
        path.on_reading(reading).unwrap();
    }
    // 9 mm/s, as it shows in whole pulses: one more or less of a sample is 0.73 mm/s in a mean of 20 ms.
    assert!((path.velocity().0 - 9.0).abs() < 1.5, "{:?}", path.velocity());
    let mut next = host.newest();
    next.tick += 1;
    // Three samples of 0.6 pulses, and a pulse; either way.
    for (by, is_believed) in [(0, true), (2, true), (5, false), (-2, true), (-5, false)] {
        let mut reading = next;
        reading.pulses += by;
        let result = path.clone().on_reading(&reading);
        assert_eq!(result.is_ok(), is_believed, "{by}: {result:?}");
    }
    // Slowly beyond the target and the way of the brake, 0.66 mm.
    let mut beyond = host.newest();
    let mut refused = None;
    while refused.is_none() && beyond.pulses < 1000 {
        (beyond.tick, beyond.pulses) = (beyond.tick + 2, beyond.pulses + 1);
        refused = path.on_reading(&beyond).err();
    }
    let refused = refused.unwrap();
    assert!((444..=447).contains(&refused.reported_pulses), "{refused:?}");
}
