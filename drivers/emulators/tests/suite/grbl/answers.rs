//! What the emulated board answers, byte for byte: as gnea/grbl does it (protocol.c, system.c, gcode.c, report.c of 1.1h).

use palpate_emulators::bench::{EmulatedAxis, SlideSwitches};
use palpate_emulators::grbl::{Eeprom, EmulatedGrblSettings, Grbl};
use palpate_model::Nanos;

struct Board {
    grbl: Grbl,
    now: Nanos,
    switches: SlideSwitches,
}

impl Board {
    fn new() -> Self {
        Self::with(&[])
    }

    fn with(values: &[(u16, f64)]) -> Self {
        let mut eeprom = Eeprom::slide();
        for (number, value) in values {
            eeprom.set(*number, *value).expect("it takes it");
        }
        let settings = EmulatedGrblSettings { eeprom, ..EmulatedGrblSettings::default() };
        let mut board = Self {
            grbl: Grbl::new(settings),
            now: Nanos::ZERO,
            switches: SlideSwitches::default(),
        };
        board.pass(1);
        board
    }

    /// What it says within so many milliseconds.
    fn pass(&mut self, ms: u64) -> String {
        for _ in 0..ms {
            self.now = self.now + Nanos::from_millis(1);
            self.grbl.advance(self.now, self.switches);
        }
        String::from_utf8(self.grbl.transmit()).expect("text")
    }

    /// What it says to some bytes at once.
    fn say(&mut self, bytes: &str) -> String {
        self.grbl.receive(self.now, bytes.as_bytes());
        self.pass(1)
    }

    fn byte(&mut self, byte: u8) -> String {
        self.grbl.receive(self.now, &[byte]);
        self.pass(1)
    }
}

const HELLO: &str = "\r\nGrbl 1.1h ['$' for help]\r\n";

#[test]
fn headers_of_post_processors_are_taken() {
    let mut board = Board::new();
    for line in [
        "G90 G94 G17 G21",
        "G40 G49 G80 G54 G61 G91.1",
        "G0",
        "T1 M3 S1000",
        "G4 P0",
        "G10 L20 P1 X0 Y0 Z0",
        "G92 X0",
        "G92.1",
        "G28.1",
        "M1",
        "M8",
        "N10 (comment) ; and more",
    ] {
        assert_eq!(board.say(&format!("{line}\n")), "ok\r\n", "{line}");
    }
    assert_eq!(board.say("$G\n"), "[GC:G0 G54 G17 G21 G90 G94 M3 M8 T0 F0 S1000]\r\nok\r\n");
    assert_eq!(board.say("?"), "<Idle|MPos:0.000,0.000,0.000|FS:0,1000|WCO:0.000,0.000,0.000>\r\n");
    assert_eq!(board.say("?"), "<Idle|MPos:0.000,0.000,0.000|FS:0,1000|Ov:100,100,100|A:SF>\r\n");
    assert_eq!(board.say("M30\n"), "[MSG:Pgm End]\r\nok\r\n");
    assert_eq!(board.say("$G\n"), "[GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F0 S1000]\r\nok\r\n");
}

#[test]
fn a_new_zero_is_reported_with_the_next_report() {
    let mut board = Board::new();
    assert_eq!(board.say("$J=X2F1200\n"), "ok\r\n");
    board.pass(1_000);
    board.say("??");
    assert_eq!(board.say("G10L20P1X0\n"), "ok\r\n");
    assert_eq!(board.say("?"), "<Idle|MPos:2.000,0.000,0.000|FS:0,0|WCO:2.000,0.000,0.000>\r\n");
    let message = board.say("$#\n");
    assert!(message.starts_with("[G54:2.000,0.000,0.000]\r\n[G55:0.000"), "{message}");
    assert!(message.ends_with(
        "[G92:0.000,0.000,0.000]\r\n[TLO:0.000]\r\n[PRB:0.000,0.000,0.000:0]\r\nok\r\n"
    ));
}

#[test]
fn a_line_is_answered_when_what_it_waits_for_is_done() {
    let mut board = Board::new();
    assert_eq!(board.say("G0X1\nG4P0.1\n"), "ok\r\n");
    // A millimetre at 60 mm/s2 takes a quarter of a second.
    assert_eq!(board.pass(250), "");
    assert_eq!(board.pass(200), "ok\r\n");
    assert_eq!(board.say("G0X0\nM30\n"), "ok\r\n");
    assert_eq!(board.pass(400), "[MSG:Pgm End]\r\nok\r\n");
    assert_eq!(board.say("M0\n"), "ok\r\n");
    assert!(board.say("?").starts_with("<Hold:0|"));
    assert_eq!(board.say("G0X1\n"), "");
    assert_eq!(board.say("~"), "ok\r\n");
}

#[test]
fn a_full_planner_moves_and_a_reset_in_it_is_an_alarm() {
    let mut board = Board::new();
    let burst: String = (1..=20).map(|n| format!("X{n}\n")).collect();
    assert_eq!(board.say(&burst), "ok\r\n".repeat(15));
    assert!(board.say("?").starts_with("<Run|"));
    assert_eq!(board.byte(0x18), "ALARM:3\r\n");
    // Half a second for the alarm to be read; the line that waited is answered.
    assert_eq!(board.pass(490), "");
    assert_eq!(board.pass(20), format!("ok\r\n{HELLO}[MSG:'$H'|'$X' to unlock]\r\n"));
}

#[test]
fn lines_too_long_for_the_buffer_are_answered() {
    let mut board = Board::new();
    let line = format!("{}\n", "X".repeat(200));
    assert_eq!(board.say(&line), "error:11\r\n");
    assert_eq!(board.say("G0X0\n"), "ok\r\n");
}

#[test]
fn a_soft_limit_ends_in_a_reset_and_its_line_is_answered() {
    let mut board = Board::with(&[(22, 1.0), (20, 1.0)]);
    assert_eq!(board.say("$X\n"), "[MSG:Caution: Unlocked]\r\nok\r\n");
    assert_eq!(board.say("G0X500\n"), "ALARM:2\r\n[MSG:Reset to continue]\r\n");
    assert_eq!(board.say("?$$\n"), "");
    board.pass(600);
    assert_eq!(board.byte(0x18), format!("ok\r\n{HELLO}[MSG:'$H'|'$X' to unlock]\r\n"));
}

#[test]
fn a_limit_alarms_when_it_closes_and_when_it_opens() {
    let mut board = Board::with(&[(21, 1.0)]);
    board.switches.is_forward = true;
    assert_eq!(board.pass(1), "ALARM:1\r\n[MSG:Reset to continue]\r\n");
    board.pass(600);
    let locked = format!("{HELLO}[MSG:Check Limits]\r\n[MSG:'$H'|'$X' to unlock]\r\n");
    assert_eq!(board.byte(0x18), locked);
    assert_eq!(board.say("$X\n"), "[MSG:Caution: Unlocked]\r\nok\r\n");
    board.switches.is_forward = false;
    assert_eq!(board.pass(1), "ALARM:1\r\n[MSG:Reset to continue]\r\n");
}

#[test]
fn what_resets_the_board_is_answered_before() {
    let mut board = Board::new();
    assert_eq!(board.say("$C\n"), "[MSG:Enabled]\r\nok\r\n");
    assert_eq!(board.say("$C\n"), format!("[MSG:Disabled]\r\nok\r\n{HELLO}"));
    assert_eq!(board.say("$RST=#\n"), format!("[MSG:Restoring defaults]\r\nok\r\n{HELLO}"));
    assert_eq!(board.say("$SLP\n"), "ok\r\n[MSG:Sleeping]\r\n");
    assert_eq!(board.byte(0x18), format!("{HELLO}[MSG:'$H'|'$X' to unlock]\r\n"));
}

#[test]
fn startup_lines_are_tried_kept_and_done() {
    let mut board = Board::new();
    assert_eq!(board.say("$N0=G99\n"), "error:20\r\n");
    assert_eq!(board.say("$N0=G20\n"), "ok\r\n");
    assert_eq!(board.say("$N\n"), "$N0=G20\r\n$N1=\r\nok\r\n");
    assert_eq!(board.byte(0x18), format!("{HELLO}>G20:ok\r\n"));
    assert!(board.say("$G\n").contains(" G20 "));
    for (line, code) in [
        ("$foo", 2),
        ("$Z=1", 2),
        ("$10=5x", 3),
        ("$10", 3),
        ("$10=", 2),
        ("$300=1", 3),
        ("$9=1", 3),
        ("$J", 3),
        ("$J=X1F1G2", 35),
        ("$$$", 3),
        ("$G1", 3),
        ("$H1", 5),
        ("$SLP1", 3),
        ("$RST=x", 3),
        ("$Ix", 3),
    ] {
        assert_eq!(board.say(&format!("{line}\n")), format!("error:{code}\r\n"));
    }
}

#[test]
fn overrides_are_reported_at_once() {
    let mut board = Board::new();
    board.say("?");
    for (byte, printed) in
        [(0x91, "110,100,100"), (0x96, "110,50,100"), (0x9b, "110,50,90"), (0x90, "100,50,90")]
    {
        board.byte(byte);
        assert!(board.say("?").contains(&format!("|Ov:{printed}>")));
    }
    assert_eq!(board.say("$J=F100\n"), "ok\r\n");
}

#[test]
fn a_door_stops_and_is_closed_again() {
    let mut board = Board::new();
    board.say("G1X5F600\n");
    board.pass(100);
    assert_eq!(board.byte(0x84), "[MSG:Check Door]\r\n");
    assert!(board.say("?").starts_with("<Door:2|"));
    board.pass(500);
    let message = board.say("?");
    assert!(message.starts_with("<Door:0|MPos:") && !message.contains("MPos:5.000"), "{message}");
    board.say("~");
    assert!(board.say("?").starts_with("<Run|"));
    board.pass(2_000);
    assert!(board.say("?").starts_with("<Idle|MPos:5.000"));
}

#[test]
fn a_probe_that_finds_nothing_is_an_alarm_before_its_place() {
    let mut board = Board::new();
    assert_eq!(board.say("G38.2X0.1F600\n"), "");
    assert_eq!(board.pass(400), "ALARM:5\r\n");
    assert_eq!(board.pass(600), "[PRB:0.000,0.000,0.000:0]\r\nok\r\n");
    assert_eq!(board.say("$X\nG38.3X0.2F600\n"), "[MSG:Caution: Unlocked]\r\nok\r\n");
    assert_eq!(board.pass(1_000), "[PRB:0.200,0.000,0.000:0]\r\nok\r\n");
}
