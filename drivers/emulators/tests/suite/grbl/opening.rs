//! A board is looked at before it is used, and nothing of it is changed.

use super::bench::{Shared, slide, try_connect, wired};
use palpate_drivers::grbl::{GrblOpenError, GrblSettings, HomeSwitch};
use palpate_emulators::DeviceFault;
use palpate_emulators::bench::EmulatedAxis;
use palpate_emulators::grbl::{self, Eeprom};
use palpate_model::Nanos;

fn board(values: &[(u16, f64)]) -> grbl::EmulatedGrblSettings {
    let mut settings = grbl::EmulatedGrblSettings::default();
    for (number, value) in values {
        settings.eeprom.set(*number, *value).expect("it takes it");
    }
    settings
}

fn refused(values: &[(u16, f64)], settings: &GrblSettings) -> String {
    let wire = wired(board(values));
    let err = try_connect(&wire, settings).expect_err("refused");
    assert_eq!(wire.lock().board.counter_mm(), 0.0);
    err.to_string()
}

#[test]
fn settings_that_are_otherwise_are_reported_with_the_line_that_mends_them() {
    for (number, value, words) in [
        (100, 250.0, "$100=400.000"),
        (110, 600.0, "$110=1200.000"),
        (120, 10.0, "$120=60.000"),
        (1, 25.0, "$1=255"),
        (13, 1.0, "$13=0"),
        (21, 1.0, "$21=0"),
        (10, 0.0, "$10=1"),
    ] {
        let message = refused(&[(number, value)], &slide());
        assert!(
            message.contains(words) && message.contains(&format!("${number}={value}")),
            "{message}"
        );
    }
    let probe = GrblSettings { home: HomeSwitch::Probe, ..slide() };
    assert!(refused(&[], &probe).contains("$21=1"));
}

#[test]
fn steps_that_are_finer_than_what_grbl_tells_are_refused() {
    let fine = GrblSettings { mm_per_pulse: 1.0 / 1_600.0, ..slide() };
    let message = refused(&[(100, 1_600.0)], &fine);
    assert!(message.contains("$100=1600") && message.contains("thousandths"), "{message}");
}

#[test]
fn a_closed_limit_pin_that_both_ends_share_is_refused() {
    for by in [-200.0, 200.0] {
        let wire = wired(grbl::EmulatedGrblSettings::default());
        {
            let mut wire = wire.lock();
            wire.plant.shift_counter(by);
            wire.pass(Nanos::from_millis(10));
        }
        let err = try_connect(&wire, &slide()).expect_err("refused");
        assert_eq!(err, GrblOpenError::OnASwitch { axis: 'X' });
        assert!(err.to_string().contains("closed_is_home = true"), "{err}");
        let settings = GrblSettings { is_closed_home: true, ..slide() };
        try_connect(&wire, &settings).expect("it connects");
    }
}

#[test]
fn a_locked_board_is_unlocked_only_when_the_rig_file_says_so() {
    let locked = [(22, 1.0)];
    let message = refused(&locked, &slide());
    assert!(message.contains("unlock = true"), "{message}");
    let wire = wired(board(&locked));
    let settings = GrblSettings { is_unlocking: true, ..slide() };
    try_connect(&wire, &settings).expect("it connects");
    assert!(String::from_utf8_lossy(&wire.lock().sent).contains("$X\n"));
}

/// On a limit switch of its own, the board locked and deaf for everything but a reset.
fn on_a_limit() -> (Shared, GrblSettings) {
    let settings = GrblSettings { home: HomeSwitch::Probe, is_unlocking: true, ..slide() };
    let mut own = board(&[(21, 1.0)]);
    own.home = grbl::HomeWiring::Probe;
    let wire = wired(own);
    {
        let mut wire = wire.lock();
        let now = wire.now;
        wire.board.receive(now, b"$J=G91X400F1200\n");
        wire.pass(Nanos::from_millis(12_000));
        let message = wire.take_output();
        assert!(message.contains("ALARM:1"), "{message}");
        wire.board.receive(Nanos::ZERO, b"?$I\n");
        wire.pass(Nanos::from_millis(1_000));
        assert_eq!(wire.take_output(), "");
    }
    (wire, settings)
}

#[test]
fn a_board_that_a_limit_has_locked_is_reset_and_opened() {
    let (wire, settings) = on_a_limit();
    let err = try_connect(&wire, &settings).expect_err("the switch is closed still");
    assert_eq!(err, GrblOpenError::OnALimit { axis: 'X' });
    // By hand.
    wire.lock().plant.shift_counter(-20.0);
    try_connect(&wire, &settings).expect("it connects");
}

#[test]
fn a_board_that_is_held_is_reported() {
    let wire = wired(grbl::EmulatedGrblSettings::default());
    wire.lock().board.receive(Nanos::ZERO, b"!");
    let err = try_connect(&wire, &slide()).expect_err("refused");
    assert!(err.to_string().contains("Hold"), "{err}");
    assert!(err.to_string().contains("reset the board"), "{err}");
}

#[test]
fn a_board_that_starts_is_waited_for() {
    let wire = wired(grbl::EmulatedGrblSettings {
        is_unused: true,
        ..grbl::EmulatedGrblSettings::default()
    });
    {
        let mut wire = wire.lock();
        let now = wire.now;
        wire.board.apply_fault(now, DeviceFault::Reset, true);
    }
    let connected = try_connect(&wire, &slide()).expect("it connects");
    assert!(connected.identity.contains("1.1h"), "{}", connected.identity);
    assert!(connected.stats.round_trip_min >= Nanos(6_000_000));
}

#[test]
fn a_jog_of_somebody_else_is_ended() {
    let wire = wired(grbl::EmulatedGrblSettings::default());
    {
        let mut wire = wire.lock();
        let now = wire.now;
        wire.board.receive(now, b"$J=G91X50F600\n$J=G9");
        wire.pass(Nanos::from_millis(500));
        assert!(wire.board.counter_mm() > 1.0);
    }
    let connected = try_connect(&wire, &slide()).expect("it connects");
    let truth = (wire.lock().board.counter_mm() / 0.0025).round();
    assert_eq!(connected.parameters.steps as f64, truth);
    assert!(truth < 4_000.0);
}

#[test]
fn half_a_line_of_somebody_else_moves_nothing() {
    for half in ["G90G0X50", "$J=G91X50F600", "(a remark G0X50", "$H"] {
        let wire = wired(grbl::EmulatedGrblSettings::default());
        {
            let mut wire = wire.lock();
            let now = wire.now;
            wire.board.receive(now, half.as_bytes());
            wire.pass(Nanos::from_millis(100));
        }
        let connected = try_connect(&wire, &slide());
        assert!(connected.is_ok(), "{half}: {connected:?}");
        wire.lock().pass(Nanos::from_millis(1_000));
        assert_eq!(wire.lock().board.counter_mm(), 0.0, "{half}");
    }
}

#[test]
fn another_board_is_noticed() {
    let mut own = grbl::EmulatedGrblSettings::default();
    own.eeprom.build_info = "LEFT".into();
    let settings = GrblSettings { build_info: Some("RIGHT".into()), ..slide() };
    let err = try_connect(&wired(own), &settings).expect_err("refused");
    assert!(matches!(err, GrblOpenError::OtherBoard { .. }), "{err}");
    let wire = wired(grbl::EmulatedGrblSettings::default());
    {
        let mut wire = wire.lock();
        wire.board.apply_fault(Nanos::ZERO, DeviceFault::WrongDevice, true);
        wire.board.receive(Nanos::ZERO, &[0x18]);
    }
    let err = try_connect(&wire, &slide()).expect_err("refused");
    assert!(err.to_string().contains("0.9j"), "{err}");
}

#[test]
fn nobody_and_somebody_else_are_reported() {
    let wire = wired(grbl::EmulatedGrblSettings::default());
    wire.lock().spoil = Box::new(|_| Vec::new());
    assert_eq!(try_connect(&wire, &slide()).unwrap_err(), GrblOpenError::Silent);
    let wire = wired(grbl::EmulatedGrblSettings::default());
    wire.lock().spoil =
        Box::new(|byte| if byte == b'\n' { vec![byte] } else { vec![b'A' + byte % 16] });
    let err = try_connect(&wire, &slide()).unwrap_err();
    assert!(matches!(err, GrblOpenError::NotGrbl { .. }), "{err}");
    let wire = wired(grbl::EmulatedGrblSettings::default());
    wire.lock().is_cut = true;
    assert!(matches!(try_connect(&wire, &slide()), Err(GrblOpenError::Lost { .. })));
    let eeprom = Eeprom::factory();
    let err = try_connect(
        &wired(grbl::EmulatedGrblSettings { eeprom, ..grbl::EmulatedGrblSettings::default() }),
        &slide(),
    );
    assert!(matches!(err, Err(GrblOpenError::SetOtherwise { .. })));
}
