//! The HX711 board.

use super::bench::{CellBench, Stranger};
use palpate_drivers::cell::{CellDescription, CellDevice};
use palpate_drivers::hx711::Hx711Settings;
use palpate_drivers::text::{DeviceError, OpenedCell};
use palpate_emulators::DeviceFault;
use palpate_emulators::hx711::{EmulatedHx711, EmulatedHx711Settings};
use palpate_model::units::Volts;

fn bench(settings: EmulatedHx711Settings) -> CellBench<EmulatedHx711> {
    CellBench::new(EmulatedHx711::new(settings))
}

fn opened<E: palpate_emulators::cell::EmulatedCell>(
    bench: &CellBench<E>,
    settings: &Hx711Settings,
) -> Result<OpenedCell, DeviceError> {
    settings.open(&mut bench.clone(), &bench.clock(), &"hx711".into())
}

fn usual() -> (CellBench<EmulatedHx711>, OpenedCell) {
    let bench = bench(EmulatedHx711Settings::default());
    let cell = opened(&bench, &Hx711Settings::default()).expect("an HX711 board");
    (bench, cell)
}

#[test]
fn it_answers_as_its_lines_are_described() {
    let mut bench = bench(EmulatedHx711Settings {
        board: "bench-1".into(),
        ..EmulatedHx711Settings::default()
    });
    // Python: crc_hqx(b"H,...", 0xffff) gives the sums.
    let text = bench.ask("?", 14);
    let mut lines = text.split_inclusive("\r\n");
    assert_eq!(lines.next(), Some("H,1002000,palpate-hx711,1,80,128,bench-1*CDFA\r\n"), "{text:?}");
}

#[test]
fn the_description_is_what_was_found() {
    let (_, cell) = usual();
    let CellDescription { identity, adc, noise_expected, rate, delay, newtons_per_volt } =
        cell.description;
    // 80 a second, 3 % fast, by a clock that is 0.2 % fast itself.
    assert!((rate - 80.0 * 1.03 / 1.002).abs() < 0.05, "{rate}");
    // Two conversions.
    assert!((delay.seconds().0 - 2.0 / rate).abs() < 1e-6);
    assert!(identity.contains("emulated") && identity.contains("gain 128"), "{identity}");
    assert_eq!((adc.counts_min, adc.counts_max), (-8_388_608, 8_388_607));
    assert_eq!(adc.volts_per_count, 5.0 / 8_388_608.0);
    assert_eq!(noise_expected, Volts(0.3e-3));
    assert_eq!(newtons_per_volt, None);
    assert!(cell.closing_bytes.is_empty());
    assert!(cell.raw.iter().any(|piece| piece.is_sent && piece.bytes == b"?\r\n"));
}

#[test]
fn values_are_those_of_the_amplified_signal_at_either_gain() {
    for is_half_gain in [false, true] {
        let mut bench =
            bench(EmulatedHx711Settings { is_half_gain, ..EmulatedHx711Settings::default() });
        let mut cell = opened(&bench, &Hx711Settings::default()).expect("an HX711 board");
        bench.feel(1.2808, 0.0);
        bench.run(cell.dialogue.as_mut(), 50);
        let samples = bench.run(cell.dialogue.as_mut(), 1_000);
        assert!((80..=84).contains(&samples.len()), "{}", samples.len());
        for sample in &samples {
            let step = cell.description.adc.volts_per_count;
            assert!((sample.volts.0 - 1.2808).abs() <= step, "{sample:?}");
        }
        let times: Vec<u64> = samples.iter().filter_map(|s| s.device_time).map(|t| t.0).collect();
        // One conversion is 12 135.9 us; micros() counts in steps of 4.
        for pair in times.windows(2) {
            assert!((pair[1] - pair[0]).abs_diff(12_160_000) <= 8_000, "{pair:?}");
        }
        assert_eq!((times.len(), cell.dialogue.garbled()), (samples.len(), 0));
    }
}

#[test]
fn the_slow_chip_is_recognised() {
    let bench = bench(EmulatedHx711Settings { is_fast: false, ..EmulatedHx711Settings::default() });
    let cell = opened(&bench, &Hx711Settings::default()).expect("an HX711 board");
    assert!((cell.description.rate - 10.28).abs() < 0.01);
}

#[test]
fn the_boards_clock_may_wrap() {
    let mut bench = bench(EmulatedHx711Settings {
        micros: u32::MAX - 3_000_000,
        ..EmulatedHx711Settings::default()
    });
    let mut cell = opened(&bench, &Hx711Settings::default()).expect("an HX711 board");
    let samples = bench.run(cell.dialogue.as_mut(), 3_000);
    let times: Vec<u64> = samples.iter().filter_map(|s| s.device_time).map(|t| t.0).collect();
    assert!(times.windows(2).all(|w| (12_000_000..12_400_000).contains(&(w[1] - w[0]))));
    // It has wrapped: what the board tells is small again.
    assert!(times.last().is_some_and(|t| *t > u64::from(u32::MAX) * 1_000));
    assert_eq!(cell.dialogue.take_trouble(), None);
}

#[test]
fn a_restart_is_reported_and_values_come_again() {
    let (mut bench, mut cell) = usual();
    bench.run(cell.dialogue.as_mut(), 100);
    bench.apply_fault(DeviceFault::Reset, true);
    let now = bench.clock();
    bench.run(cell.dialogue.as_mut(), 1_100);
    // The boot loader takes longer than a cell may be silent.
    assert!(cell.dialogue.is_dead(now()).is_some());
    let samples = bench.run(cell.dialogue.as_mut(), 1_000);
    assert!(!samples.is_empty());
    assert!(cell.dialogue.take_trouble().expect("a trouble").contains("restarted"));
}

#[test]
fn a_saturated_a_stuck_and_a_missing_chip() {
    let (mut bench, mut cell) = usual();
    bench.apply_fault(DeviceFault::Saturated, true);
    let samples = bench.run(cell.dialogue.as_mut(), 50);
    assert!(samples.last().expect("samples").volts.0 > 4.999);
    assert!(cell.dialogue.take_trouble().expect("a trouble").contains("beyond"));
    bench.apply_fault(DeviceFault::Saturated, false);
    // The amplifier at its end saturates it too.
    bench.feel(12.0, 0.0);
    let samples = bench.run(cell.dialogue.as_mut(), 100);
    assert_eq!(samples.last().expect("samples").counts, 8_388_607);
    bench.feel(1.0, 0.0);
    bench.run(cell.dialogue.as_mut(), 50);
    bench.apply_fault(DeviceFault::Stuck, true);
    bench.feel(2.0, 0.0);
    let samples = bench.run(cell.dialogue.as_mut(), 50);
    assert!((samples.last().expect("samples").volts.0 - 1.0).abs() < 1e-6);

    cell.dialogue.take_trouble();
    bench.with(|board| board.set_chip_missing(true));
    assert!(bench.run(cell.dialogue.as_mut(), 700).is_empty());
    assert!(cell.dialogue.take_trouble().expect("a trouble").contains("DOUT"));
    bench.run(cell.dialogue.as_mut(), 700);
    assert!(cell.dialogue.is_dead(bench.clock()()).expect("dead").contains("DOUT"));
}

#[test]
fn who_does_not_fit_is_reported_in_words() {
    let other = bench(EmulatedHx711Settings::default());
    let settings = Hx711Settings { board: Some("bench-2".into()), ..Hx711Settings::default() };
    let err = opened(&other, &settings).err().expect("another board").to_string();
    assert!(err.contains("emulated") && err.contains("bench-2"), "{err}");

    let dead = bench(EmulatedHx711Settings::default());
    dead.with(|board| board.set_chip_missing(true));
    let err = opened(&dead, &Hx711Settings::default()).err().expect("no chip").to_string();
    assert!(err.contains("DOUT"), "{err}");

    for (says, name) in [
        ("", "does not answer"),
        ("\r\nGrbl 1.1h ['$' for help]\r\n", "Grbl"),
        ("?", "Galil"),
        ("*10\r\n", "Mark-10"),
        ("\u{1}hello\r\n", "hello"),
    ] {
        let bench = CellBench::new(Stranger(says, Vec::new()));
        let err = opened(&bench, &Hx711Settings::default()).err().expect("a stranger");
        assert!(err.to_string().contains(name), "{err}");
    }

    let gone = bench(EmulatedHx711Settings::default());
    gone.unplug();
    let err = opened(&gone, &Hx711Settings::default()).err().expect("no link");
    assert!(matches!(err, DeviceError::Lost { .. }), "{err}");
    let settings = Hx711Settings { full_scale: Volts(f64::NAN), ..Hx711Settings::default() };
    let err = opened(&other, &settings).err().expect("no scale").to_string();
    assert!(err.contains("full scale"), "{err}");
}

#[test]
fn another_board_in_mid_run_and_a_mute_line_end_it() {
    let (mut bench, mut cell) = usual();
    bench.apply_fault(DeviceFault::WrongDevice, true);
    bench.run(cell.dialogue.as_mut(), 2_500);
    let why = cell.dialogue.is_dead(bench.clock()()).expect("dead");
    assert!(why.contains("another"), "{why}");

    let (mut bench, mut cell) = usual();
    bench.mute(true);
    bench.run(cell.dialogue.as_mut(), 1_010);
    let why = cell.dialogue.is_dead(bench.clock()()).expect("dead");
    assert!(why.contains("no value"), "{why}");
}
