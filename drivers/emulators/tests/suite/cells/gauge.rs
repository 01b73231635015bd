//! The Mark-10 gauge.

use super::bench::{CellBench, Stranger};
use palpate_drivers::cell::CellDevice;
use palpate_drivers::mark10::gauge::GaugeSettings;
use palpate_drivers::text::{DeviceError, OpenedCell};
use palpate_emulators::DeviceFault;
use palpate_emulators::cell::EmulatedCell;
use palpate_emulators::mark10::{EmulatedGauge, EmulatedGaugeSettings};
use palpate_model::units::Newtons;

fn bench() -> CellBench<EmulatedGauge> {
    CellBench::new(EmulatedGauge::new(EmulatedGaugeSettings::default()))
}

fn opened<E: EmulatedCell>(
    bench: &CellBench<E>,
    settings: &GaugeSettings,
) -> Result<OpenedCell, DeviceError> {
    settings.open(&mut bench.clone(), &bench.clock(), &"gauge".into())
}

fn refused<E: EmulatedCell>(bench: &CellBench<E>, settings: &GaugeSettings) -> String {
    opened(bench, settings).err().expect("a refusal").to_string()
}

#[test]
fn the_emulator_answers_as_the_guides_say() {
    let mut bench = bench();
    bench.feel(0.0, 4.285);
    bench.ask("", 200);
    // Series 5 user's guide, page 17: CR, or CR LF with the LF ignored; answers end with CR LF.
    assert_eq!(bench.ask("N\r", 5), "");
    assert_eq!(bench.ask("?\r\n", 5), "4.285 N\r\n");
    // Model 7i user's guide, page 30: tension negative, inverted by IPOL1; the sign left out by OPOL1, + never sent.
    assert_eq!(bench.ask("IPOL1\r?\rIPOL0\r", 5), "-4.285 N\r\n");
    assert_eq!(bench.ask("NUM\r?\rFULL\r", 5), "4.285\r\n");
    bench.feel(0.0, -4.285);
    bench.ask("", 200);
    assert_eq!(bench.ask("?\rOPOL1\r?\rOPOL0\r", 5), "-4.285 N\r\n4.285 N\r\n");
    // Series 5 user's guide, page 19: LIST and errors.
    assert_eq!(
        bench.ask("LB\rLIST\r", 5),
        "V1.00;LBF;CUR;FLTC8;FLTP1;AOUT00;AOFF5;FULL;MIT;POL;IPOL0;OPOL0;B0\r\n"
    );
    assert_eq!(
        bench.ask("HELLO\r?A\rFLTCx\rFLTC11\rAOUT3\r", 5),
        "*10\r\n*11\r\n*12\r\n*22\r\n*12\r\n"
    );
    bench.feel(0.0, 0.0);
    bench.ask("", 200);
    assert_eq!(bench.ask("N\rZ\r?\r", 5), "0.000 N\r\n");
    let ten = bench.ask("AOUT10\r", 1_000);
    assert_eq!(ten.matches("\r\n").count(), 10, "{ten}");
    assert_eq!(bench.ask("AOUT0\r", 500), "");
}

#[test]
fn the_description_is_what_was_found_and_set() {
    let bench = bench();
    let settings = GaugeSettings {
        serial_number: Some("3519042".into()),
        filter: Some(4),
        per_second: 125,
        ..GaugeSettings::default()
    };
    let cell = opened(&bench, &settings).expect("a gauge");
    let found = &cell.description;
    for part in ["Series 5", "M5-5", "3519042", "V1.00", "125", "FLTC4", "FLTP4"] {
        let part = part.trim_start_matches('V');
        assert!(found.identity.contains(part), "{part} in {}", found.identity);
    }
    assert_eq!(found.rate, 125.0);
    assert_eq!(found.newtons_per_volt, Some(1.0));
    assert_eq!(found.adc.volts_per_count, 1e-3);
    assert_eq!((found.adc.counts_min, found.adc.counts_max), (-27_500, 27_500));
    assert!((found.noise_expected.0 - 1e-3 / 12.0_f64.sqrt()).abs() < 1e-9);
    assert_eq!(cell.closing_bytes, b"AOUT0\r");
    let sent: Vec<u8> = cell
        .raw
        .iter()
        .filter(|piece| piece.is_sent)
        .flat_map(|piece| piece.bytes.clone())
        .collect();
    assert_eq!(
        String::from_utf8(sent).expect("text"),
        "\rAOUT0\rAOUT0\rLIST\rRN\rRM\rRS\rN\rCUR\rFULL\rIPOL0\rOPOL0\rAOFF0\rFLTC4\rFLTP4\rLIST\r?C\rAOUT125\r"
    );
}

#[test]
fn readings_come_at_their_rate_and_the_farewell_ends_them() {
    let mut bench = bench();
    let mut cell = opened(&bench, &GaugeSettings::default()).expect("a gauge");
    bench.feel(0.0, 4.285);
    bench.run(cell.dialogue.as_mut(), 100);
    let samples = bench.run(cell.dialogue.as_mut(), 1_000);
    assert!((249..=251).contains(&samples.len()), "{}", samples.len());
    for sample in &samples {
        // Two of its steps of 5 mN: noise of 2 mN averaged over 37 ms.
        assert!((sample.volts.0 - 4.285).abs() < 0.0101, "{sample:?}");
        assert_eq!(sample.counts, (sample.volts.0 * 1e3).round() as i32);
    }
    assert_eq!(cell.dialogue.garbled(), 0);
    let farewell = String::from_utf8(cell.closing_bytes).expect("text");
    bench.ask(&farewell, 5);
    assert_eq!(bench.ask("", 500), "");
}

#[test]
fn a_reversed_gauge_counts_tension_as_pressing() {
    let mut bench = bench();
    let settings = GaugeSettings { is_reversed: true, ..GaugeSettings::default() };
    let mut cell = opened(&bench, &settings).expect("a gauge");
    bench.feel(0.0, -3.0);
    bench.run(cell.dialogue.as_mut(), 100);
    let samples = bench.run(cell.dialogue.as_mut(), 20);
    assert!((samples[0].volts.0 - 3.0).abs() < 0.02);
}

#[test]
fn one_a_second_is_fifty_on_a_7i() {
    let bench = CellBench::new(EmulatedGauge::new(EmulatedGaugeSettings {
        is_7i: true,
        ..EmulatedGaugeSettings::default()
    }));
    let settings = GaugeSettings { per_second: 1, ..GaugeSettings::default() };
    let cell = opened(&bench, &settings).expect("a gauge");
    assert_eq!(cell.description.rate, 50.0);
}

#[test]
fn an_overload_reads_the_end_of_the_range() {
    let mut bench = bench();
    let mut cell = opened(&bench, &GaugeSettings::default()).expect("a gauge");
    bench.feel(0.0, 40.0);
    let samples = bench.run(cell.dialogue.as_mut(), 200);
    assert_eq!(samples.last().expect("samples").counts, 27_500);
    assert!(cell.dialogue.take_trouble().expect("a trouble").contains("range"));
    bench.feel(0.0, 1.0);
    bench.run(cell.dialogue.as_mut(), 100);
    bench.apply_fault(DeviceFault::Saturated, true);
    let samples = bench.run(cell.dialogue.as_mut(), 50);
    assert_eq!(samples.last().expect("samples").counts, 27_500);
}

#[test]
fn a_stuck_a_restarted_and_an_unplugged_gauge() {
    let mut bench = bench();
    let mut cell = opened(&bench, &GaugeSettings::default()).expect("a gauge");
    bench.feel(0.0, 2.0);
    bench.run(cell.dialogue.as_mut(), 100);
    bench.apply_fault(DeviceFault::Stuck, true);
    bench.feel(0.0, 5.0);
    let samples = bench.run(cell.dialogue.as_mut(), 100);
    assert!((samples.last().expect("samples").volts.0 - 2.0).abs() < 0.02);
    // Its settings are gone with its supply: it is silent.
    bench.apply_fault(DeviceFault::Reset, true);
    bench.run(cell.dialogue.as_mut(), 1_100);
    let why = cell.dialogue.is_dead(bench.clock()()).expect("dead");
    assert!(why.contains("silent"), "{why}");
    bench.unplug();
    assert!(refused(&bench, &GaugeSettings::default()).contains("lost"));
}

#[test]
fn who_does_not_fit_is_reported_in_words() {
    let other = GaugeSettings { serial_number: Some("1".into()), ..GaugeSettings::default() };
    let err = refused(&bench(), &other);
    assert!(err.contains("3519042") && err.contains("expects 1"), "{err}");
    for (says, name) in [
        ("", "does not answer"),
        ("\r\nGrbl 1.1h ['$' for help]\r\n", "Grbl"),
        ("?", "Galil"),
        ("*10\r\n", "Series 4"),
        ("4.285 N\r\n", "does not receive commands"),
        ("D,48332680,-152034*4E04\r\n", "HX711"),
    ] {
        let err = refused(&CellBench::new(Stranger(says, Vec::new())), &GaugeSettings::default());
        assert!(err.contains(name), "{says:?}: {err}");
    }
    let torque = "V1.00;LBIN;CUR;FLTC8;FLTP1;AOUT00;AOFF5;FULL;MIT;POL;B0\r\n";
    let err = refused(&CellBench::new(Stranger(torque, Vec::new())), &GaugeSettings::default());
    assert!(err.contains("LBIN") && err.contains("newtons"), "{err}");
    let peak = "V1.00;N;PC;FLTC8;FLTP1;AOUT00;AOFF5;FULL;MIT;POL;B0\r\n";
    let err = refused(&CellBench::new(Stranger(peak, Vec::new())), &GaugeSettings::default());
    assert!(err.contains("CUR"), "{err}");
    for (settings, word) in [
        (GaugeSettings { per_second: 100, ..GaugeSettings::default() }, "choose one of 1, 2, 5"),
        (GaugeSettings { filter: Some(11), ..GaugeSettings::default() }, "0 to 10"),
        (GaugeSettings { capacity: Newtons(0.0), ..GaugeSettings::default() }, "capacity"),
    ] {
        let err = refused(&bench(), &settings);
        assert!(err.contains(word), "{err}");
    }
}
