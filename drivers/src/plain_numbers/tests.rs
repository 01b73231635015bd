use super::*;
use crate::cell::CellDialogue;

fn cell(keys: &str) -> PlainNumbers {
    let mut fields = Fields::read(&format!("[cell]\n{keys}")).unwrap();
    let cell = PlainNumbers::read(&mut fields).unwrap();
    assert_eq!(fields.finish(), []);
    cell
}

/// After the line that was under way when it was opened.
fn numbers(keys: &str, decimals: u8) -> LineCell<PlainNumberReader> {
    let cell = cell(keys);
    let step = 10_f64.powi(-i32::from(decimals));
    let numbers = PlainNumberReader {
        decimals,
        counts_max: (cell.full_scale / step).round() as i32,
        per_count: step * cell.volts_per_unit(),
        clock: BoardClock::new(cell.nanos_per_tick.unwrap_or(1)),
        silence_max: silence_max(1e3),
        is_begun: false,
        cell,
    };
    let mut line = LineCell::start(numbers, Nanos::ZERO);
    // Half of a line may be a number too.
    line.handle_bytes(Nanos::ZERO, b"99\r\n");
    assert_eq!((line.take_sample(), line.garbled()), (None, 0));
    line
}

fn counts(line: &mut dyn CellDialogue) -> Vec<i32> {
    std::iter::from_fn(|| line.take_sample()).map(|sample| sample.counts).collect()
}

const COUNTS: &str = "unit = \"counts\"\nfull_scale = 8388607\n";

#[test]
fn plain_numbers_count_and_everything_else_is_garbled() {
    let mut line = numbers(COUNTS, 0);
    line.handle_bytes(Nanos(7), b"12345\r\n-6\n +7 \r\n0\r\n");
    assert_eq!(counts(&mut line), [12_345, -6, 7, 0]);
    assert_eq!(line.garbled(), 0);
    let wrong = [
        "12345 g",
        "1.0",
        "1e3",
        "nan",
        "inf",
        "--1",
        "+-1",
        "1,234",
        "0x10",
        "1 2",
        ".5",
        "-",
        "Hello",
        "123456789",
        "12\u{7f}3",
    ];
    for wrong in wrong {
        line.handle_bytes(Nanos(8), format!("{wrong}\r\n").as_bytes());
        assert!(counts(&mut line).is_empty(), "{wrong}");
    }
    assert_eq!(line.garbled(), wrong.len() as u64);
    assert_eq!(line.take_trouble(), None);
}

#[test]
fn pieces_of_a_line_are_put_together() {
    let mut line = numbers(COUNTS, 0);
    for byte in b"-1234\r\n5\n" {
        line.handle_bytes(Nanos(1), &[*byte]);
    }
    assert_eq!(counts(&mut line), [-1234, 5]);
}

#[test]
fn units_become_volts() {
    for (keys, decimals, text, volts) in [
        (COUNTS, 0, "8388607", 5.0),
        ("unit = \"counts\"\nfull_scale = 1000\nfull_scale_v = 2.5\n", 0, "-100", -0.25),
        ("unit = \"V\"\nfull_scale = 10\n", 3, "1.234", 1.234),
        ("unit = \"mV\"\nfull_scale = 5000\n", 1, "1234.5", 1.2345),
        ("unit = \"N\"\nfull_scale = 25\n", 3, "4.285", 4.285),
        ("unit = \"gF\"\nfull_scale = 2000\ndirection = \"tension\"\n", 0, "-1000", 9.806_65),
    ] {
        let mut line = numbers(keys, decimals);
        line.handle_bytes(Nanos(1), format!("{text}\r\n").as_bytes());
        let sample = line.take_sample().unwrap();
        assert!((sample.volts.0 - volts).abs() < 1e-12, "{keys}: {sample:?}");
        assert_eq!(sample.device_time, None);
    }
}

#[test]
fn times_of_the_board_neither_wrap_nor_go_back() {
    let keys = format!("{COUNTS}time_column = \"ms\"\n");
    let mut line = numbers(&keys, 0);
    let ms = Nanos::from_millis;
    line.handle_bytes(ms(10), b"4294967290,1\r\n");
    line.handle_bytes(ms(20), b"4, 2\r\n4,2\r\n");
    let times = [(); 2].map(|()| line.take_sample().unwrap().device_time.unwrap());
    assert_eq!(times[1].since(times[0]), ms(10));
    assert_eq!((line.take_sample(), line.garbled()), (None, 1));
    assert_eq!(line.take_trouble(), None);
    for wrong in ["3", "+30,3", "-1,3", "30.5,3", "4294967296,3", ",3", "30,", "30,3,4"] {
        line.handle_bytes(ms(30), format!("{wrong}\r\n").as_bytes());
        assert_eq!(line.take_sample(), None, "{wrong}");
    }
    // It counts from the beginning: that is no wrap of 49 days.
    line.handle_bytes(ms(2_000), b"1,3\r\n");
    assert!(line.take_trouble().unwrap().contains("restarted"));
    assert!(line.take_sample().unwrap().device_time.unwrap() > times[1]);
}

#[test]
fn end_of_the_range_is_reported_once_and_silence_ends_it() {
    let mut line = numbers("unit = \"N\"\nfull_scale = 25\n", 2);
    let ms = Nanos::from_millis;
    line.handle_bytes(ms(1), b"24.99\r\n25.00\r\n-25.01\r\n1.00\r\n");
    assert!(line.take_trouble().unwrap().contains("full scale"));
    assert_eq!(line.take_trouble(), None);
    line.handle_bytes(ms(2), b"25.00\r\n");
    assert!(line.take_trouble().is_some());
    assert_eq!(line.is_dead(ms(1_002)), None);
    // What is no number is no sign of life.
    line.handle_bytes(ms(1_002), b"?\r\n");
    assert!(line.is_dead(ms(1_003)).unwrap().contains("no number"));
}

#[test]
fn mistakes_in_the_rig_file_are_reported() {
    let found = |keys: &str| {
        let mut fields = Fields::read(&format!("[cell]\n{keys}")).unwrap();
        assert_eq!(PlainNumbers::read(&mut fields), None, "{keys}");
        let mistakes = fields.finish();
        mistakes.iter().map(|it| it.message.clone()).collect::<Vec<_>>().join("; ")
    };
    assert!(found("full_scale = 1\n").contains("cell.unit"));
    assert!(found("unit = \"N\"\n").contains("cell.full_scale"));
    let volts = found("unit = \"N\"\nfull_scale = 25\nfull_scale_v = 5\n");
    assert!(volts.contains("needs unit"), "{volts}");
    assert!(found("unit = \"N\"\nfull_scale = 25\ntime_column = \"s\"\n").contains("\"us\""));
}

#[test]
fn lines_of_numbers_give_it_away_and_one_number_does_not() {
    let of = |lines: &[&str]| DeviceKind::recognise_lines(lines).map(|(kind, _)| kind.word);
    assert_eq!(of(&["345", "12345", "12344"]), Some("plain-numbers"));
    assert_eq!(of(&["345", "12345"]), None);
    assert_eq!(of(&["1", "2", "ok"]), None);
    assert_eq!(of(&["4.285 N", "1", "2"]), Some("mark10"));
}
