//! What goes wrong ends with the axis at rest and in words.

use super::bench::{Host, slide, to, wired};
use palpate_drivers::grbl::{GrblSettings, HomeSwitch};
use palpate_drivers::wire::Dialogue;
use palpate_emulators::DeviceFault;
use palpate_emulators::bench::EmulatedAxis;
use palpate_emulators::grbl::{self, HomeWiring};
use palpate_model::Nanos;
use palpate_model::random::SplitMix;
use palpate_model::rig::{AxisStatus, Fault, MoveTo, RigCommand};
use palpate_model::units::{MmPerS, MmPerS2};

#[test]
fn a_cut_cable_stops_the_axis_within_the_stated_way() {
    // The last one is so short that its first jog might be all of it.
    let cases = [
        (20.0, 0.3, 40_000),
        (20.0, 1.0, 40_000),
        (0.75, 1.0, 40_000),
        (9.0, 0.05, 40_000),
        (20.0, 0.0, 5_560),
    ];
    for (speed, after, target) in cases {
        let mut host = Host::new(&slide());
        host.tell(to(target, speed));
        host.pass(after);
        let mut wire = host.wire.lock();
        let before = wire.board.counter_mm();
        wire.is_cut = true;
        wire.pass(Nanos::from_millis(5_000));
        let way = wire.board.counter_mm() - before;
        assert!(way > 0.0 && way <= host.connected.worst_case_mm, "{speed}: {way}");
        wire.pass(Nanos::from_millis(1_000));
        assert_eq!(wire.board.counter_mm() - before, way);
    }
}

#[test]
fn a_pulled_plug_ends_the_motion_for_the_samples_of_a_cell_that_lives() {
    for (speed, after, is_stopped) in
        [(20.0, 0.3, false), (0.75, 1.0, false), (9.0, 0.05, false), (9.0, 0.6, true)]
    {
        let mut host = Host::new(&slide());
        host.tell(to(40_000, speed));
        host.pass(after);
        if is_stopped {
            host.ask(RigCommand::Stop);
            host.pass(0.02);
        }
        let Host { wire, session, track, .. } = host;
        wire.lock().is_cut = true;
        drop(session);
        // What the board has of the stop and of the jogs is done.
        wire.lock().pass(Nanos::from_millis(5_000));
        let now = wire.lock().now;
        let placed = track.lock().expect("no panic holds it").at(now);
        assert!(!placed.status.has(AxisStatus::MOVING), "{speed}");
        let truth = wire.lock().board.counter_mm() / 0.0025;
        assert!(
            (placed.pulses - truth).abs() <= 2.0 + 0.02 * speed / 0.0025,
            "{speed}: {} of {truth}",
            placed.pulses
        );
    }
}

#[test]
fn a_reset_that_is_lost_is_written_again() {
    for lost in [1, 3] {
        let mut host = Host::new(&slide());
        host.tell(to(40_000, 20.0));
        host.pass(1.0);
        let mut left = lost;
        host.wire.lock().lose = Box::new(move |byte| {
            let is_lost = byte == 0x18 && left > 0;
            left -= i32::from(is_lost);
            is_lost
        });
        host.ask(RigCommand::Halt);
        host.pass(0.05);
        assert!(!host.acks.contains(&RigCommand::Halt));
        assert!(host.has(AxisStatus::MOVING), "it moves and is message to rest");
        host.tell(RigCommand::Halt);
        let there = host.truth();
        host.pass(1.0);
        assert_eq!(host.truth(), there);
        assert!(!host.has(AxisStatus::MOVING));
        let halts = host.acks.iter().filter(|ack| **ack == RigCommand::Halt);
        assert_eq!(halts.count(), 2);
    }
}

#[test]
fn a_halt_without_a_welcome_is_a_lost_link() {
    let mut host = Host::new(&slide());
    host.tell(to(40_000, 5.0));
    host.pass(0.5);
    host.wire.lock().lose = Box::new(|byte| byte == 0x18);
    host.ask(RigCommand::Halt);
    host.until("dead", |host| host.session.is_dead(host.now()).is_some());
    assert!(!host.acks.contains(&RigCommand::Halt));
    let why = host.session.is_dead(host.now()).expect("dead");
    assert!(why.contains("reset"), "{why}");
}

#[test]
fn a_stop_is_reported_when_the_axis_stands() {
    let mut host = Host::new(&slide());
    host.tell(to(40_000, 20.0));
    host.pass(1.0);
    host.ask(RigCommand::Stop);
    host.until("stopped", |host| host.acks.contains(&RigCommand::Stop));
    let there = host.truth();
    host.pass(0.5);
    assert_eq!(host.truth(), there);
}

#[test]
fn a_stop_of_an_axis_that_brakes_slowly_is_answered_within_a_second() {
    let mut eeprom = grbl::Eeprom::slide();
    eeprom.set(120, 5.0).expect("it takes it");
    let wire =
        wired(grbl::EmulatedGrblSettings { eeprom, ..grbl::EmulatedGrblSettings::default() });
    let acceleration = MmPerS2(5.0);
    let mut host = Host::on(wire, &GrblSettings { acceleration, ..slide() });
    host.tell(RigCommand::MoveTo(MoveTo {
        target_pulses: 40_000,
        speed: MmPerS(9.0),
        acceleration,
    }));
    host.pass(3.0);
    host.ask(RigCommand::Stop);
    host.pass(0.5);
    assert!(!host.acks.contains(&RigCommand::Stop));
    host.pass(0.4);
    assert!(host.acks.contains(&RigCommand::Stop));
    host.settle();
    assert_eq!((host.pulses(), host.faults.len()), (host.truth(), 0));
}

#[test]
fn a_program_of_somebody_else_is_ended_by_a_reset() {
    for command in [RigCommand::Halt, RigCommand::Stop] {
        let mut host = Host::new(&slide());
        {
            let mut wire = host.wire.lock();
            let now = wire.now;
            wire.board.receive(now, b"G1X100F600\n");
        }
        host.until("noticed", |host| !host.faults.is_empty());
        assert!(host.faults[0].to_string().contains("Run"), "{:?}", host.faults);
        host.tell(command);
        let there = host.truth();
        assert!(there < 20_000.0);
        host.pass(1.0);
        assert_eq!(host.truth(), there);
    }
}

#[test]
fn a_host_that_hangs_stops_the_axis() {
    let mut host = Host::new(&slide());
    host.tell(to(40_000, 9.0));
    host.pass(0.5);
    host.is_attended = false;
    host.pass(1.5);
    let there = host.truth();
    host.pass(1.0);
    assert_eq!((host.truth(), host.pulses()), (there, there));
    assert!(host.faults[0].to_string().contains("half a second"), "{:?}", host.faults);
}

#[test]
fn what_waits_is_not_begun_when_nobody_attends_or_the_cell_has_failed() {
    for is_cell in [false, true] {
        let mut host = Host::new(&slide());
        if is_cell {
            host.track.lock().expect("no panic holds it").is_stop_wanted = true;
        } else {
            host.is_attended = false;
            host.pass(0.6);
        }
        let begun = host.acks.len();
        for target in [400, 800, 1_200] {
            host.ask(to(target, 5.0));
        }
        host.pass(1.0);
        assert_eq!((host.truth(), host.acks.len()), (0.0, begun));
        assert_eq!(host.faults.len(), 3, "{:?}", host.faults);
    }
}

#[test]
fn the_hold_button_ends_a_motion_and_none_begins_while_it_is_pressed() {
    let mut host = Host::new(&slide());
    host.tell(to(40_000, 0.75));
    host.pass(2.0);
    let before = host.truth();
    host.wire.lock().board.press_hold(true);
    host.pass(1.0);
    // Noticed with the next report, 0.1 s later.
    let way = (host.truth() - before) * 0.0025;
    assert!(way < 0.2, "{way}");
    assert!(host.faults[0].to_string().contains("hold"), "{:?}", host.faults);
    let there = host.truth();
    host.ask(to(0, 0.75));
    host.pass(2.0);
    assert!((host.truth() - there).abs() * 0.0025 < 0.2);
    assert_eq!(host.pulses(), host.truth());
    host.wire.lock().board.press_hold(false);
    host.tell(to(0, 5.0));
    host.settle();
    assert_eq!((host.truth(), host.pulses()), (0.0, 0.0));
}

#[test]
fn a_jog_in_doubt_is_cancelled_until_a_second_report_of_rest() {
    let mut host = Host::new(&slide());
    host.tell(to(40_000, 5.0));
    host.pass(0.5);
    host.wire.lock().spoil = Box::new(|byte| match byte {
        b'k' => Vec::new(),
        other => vec![other],
    });
    host.until("printed", |host| !host.faults.is_empty());
    host.pass(1.0);
    let sent = host.wire.lock().sent.clone();
    let resumed: Vec<usize> = (0..sent.len()).filter(|at| sent[*at] == b'~').collect();
    assert_eq!(resumed.len(), 2, "{resumed:?}");
    assert!(sent[resumed[0]..resumed[1]].contains(&b'?'));
    assert_eq!(host.pulses(), host.truth());
}

#[test]
fn silence_counts_as_death() {
    let mut host = Host::new(&slide());
    host.wire.lock().spoil = Box::new(|_| Vec::new());
    host.until("dead", |host| host.session.is_dead(host.now()).is_some());
}

#[test]
fn a_limit_switch_that_locks_the_board_is_reported() {
    let mut eeprom = grbl::Eeprom::slide();
    eeprom.set(21, 1.0).expect("it takes it");
    let wire = wired(grbl::EmulatedGrblSettings {
        eeprom,
        home: HomeWiring::Probe,
        ..grbl::EmulatedGrblSettings::default()
    });
    let mut host = Host::on(wire, &GrblSettings { home: HomeSwitch::Probe, ..slide() });
    host.tell(to(90_000, 20.0));
    host.until("a fault", |host| !host.faults.is_empty());
    let message = host.faults[0].to_string();
    assert!(message.contains("ALARM:1") && message.contains("limit switch"), "{message}");
    assert!(host.refused(to(0, 5.0)).contains("ALARM:1"));
    host.tell(RigCommand::Stop);
}

#[test]
fn a_reset_is_noticed_and_nothing_moves_after_it() {
    let mut host = Host::new(&slide());
    host.tell(to(40_000, 9.0));
    host.pass(0.5);
    {
        let mut wire = host.wire.lock();
        // Short, like a Ctrl-X of another program.
        let now = wire.now;
        wire.board.receive(now, &[0x18]);
    }
    host.until("noticed", |host| host.faults.contains(&Fault::ControllerReset));
    host.pass(0.5);
    let there = host.truth();
    // By whatever words: nothing is done until the rig is opened again.
    host.refused(to(0, 5.0));
    host.pass(1.0);
    assert_eq!(host.truth(), there);
}

#[test]
fn a_drop_of_the_supply_is_noticed() {
    let mut host = Host::new(&slide());
    {
        let mut wire = host.wire.lock();
        let now = wire.now;
        wire.board.apply_fault(now, DeviceFault::Reset, true);
    }
    host.until("noticed", |host| {
        host.faults.contains(&Fault::ControllerReset) || host.session.is_dead(host.now()).is_some()
    });
}

#[test]
fn spoilt_bytes_end_at_rest_and_never_without_a_word() {
    for seed in 0..60 {
        let mut host = Host::new(&slide());
        let mut random = SplitMix::seeded(seed);
        let kind = seed % 3;
        host.ask(to(6_000, 9.0));
        host.pass(0.3);
        host.wire.lock().spoil = Box::new(move |byte| match (random.below(25), kind) {
            (0, 0) => vec![random.below(256) as u8],
            (0, 1) => vec![],
            (0, _) => vec![byte, byte],
            _ => vec![byte],
        });
        for _ in 0..4_000 {
            if host.session.is_dead(host.now()).is_some() {
                break;
            }
            host.turn().expect("the wire is whole");
        }
        host.wire.lock().spoil = Box::new(|byte| vec![byte]);
        host.pass(1.0);
        let there = host.truth();
        host.pass(1.0);
        assert_eq!(host.truth(), there, "seed {seed}: it still moves");
        let is_done = there == 6_000.0 && host.pulses() == 6_000.0;
        assert!(is_done || !host.faults.is_empty(), "seed {seed}: {there} and no word");
    }
}
