//! Record arrays and data records.

use super::bench::Bench;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::galil::{EmulatedGalilSettings, GalilModel};

#[test]
fn record_arrays_lose_no_sample_in_ninety_seconds() {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    bench.tell("DM t[4000];DM f[4000];RA t[],f[];RD TIME,_AFX");
    // Half of what is measured, as integers: less to send.
    bench.tell("VF 10.0;RC 1,-4000");
    let start = bench.number("TIME");
    let mut next = 0_usize;
    let mut times: Vec<f64> = Vec::new();
    while bench.now.0 < 90_000_000_000 {
        bench.wait(1.0);
        let until = bench.number("_RD") as usize;
        // The circle is read up to where it is being written.
        let parts =
            if until >= next { vec![(next, until)] } else { vec![(next, 4000), (0, until)] };
        for (from, to) in parts.into_iter().filter(|(from, to)| to > from) {
            let answer = bench.ask(&format!("QU t[],{from},{},1", to - 1));
            let values = answer.strip_suffix("\r\n\x1a:").unwrap();
            times.extend(values.split(',').map(|value| value.trim().parse::<f64>().unwrap()));
        }
        next = until;
    }
    assert_eq!(bench.number("_RC"), 1.0);
    let expected: Vec<f64> = (1..=times.len()).map(|at| start + 2.0 * at as f64).collect();
    assert_eq!(times, expected);
    // 512 a second.
    assert!((times.len() as f64 - 90.0 * 512.0).abs() <= 1.0, "{}", times.len());
}

#[test]
fn a_recording_ends_by_itself_and_holds_what_clients_scale() {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    bench.tell("DM t[100];DM f[50];RA t[],f[];RD TIME,_AFX;RC 3");
    assert_eq!(bench.ask("RC 1;TC1"), "?80 Record mode already running\r\n:");
    bench.wait(1.0);
    assert_eq!((bench.number("_RC"), bench.number("_RD")), (0.0, 50.0));
    assert_eq!(bench.number("t[49]-t[0]"), 49.0 * 8.0);
    // Signed counts of +-10 V: 1.28 V without load, 1 mV of noise.
    let volts = bench.number("f[20]") * 10.0 / 32_768.0;
    assert!((volts - 1.28).abs() < 0.02, "{volts}");
    assert_eq!(bench.ask("RC 1,51;TC1"), "?84 Too many elements\r\n:");
    assert_eq!(bench.ask("DM g[16000];TC1"), "?66 Array space full\r\n:");
}

#[test]
fn a_data_record_says_what_the_commands_say() {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    bench.tell("SHA;JGA=500;BGA");
    bench.wait(1.0);
    bench.ask("nonsense");
    let record = bench.raw(0, b"QR\r");
    let size = 82 + 4 * 36;
    assert_eq!(record.len(), size + 1);
    assert_eq!(record[size], b':');
    assert_eq!(u16::from_le_bytes([record[2], record[3]]) as usize, size);
    assert_eq!(f64::from(u16::from_le_bytes([record[4], record[5]])), bench.number("TIME"));
    let i32_at = |at: usize| i32::from_le_bytes(record[at..at + 4].try_into().unwrap());
    assert_eq!(f64::from(i32_at(82 + 4)), bench.number("_RPA"));
    assert_eq!(f64::from(i32_at(82 + 16)), bench.number("_TDA"));
    assert_eq!(i32_at(82 + 20), 64 * 500);
    // Moving, slewing; TC 1.
    assert_eq!(u16::from_le_bytes([record[82], record[83]]) & 0x8021, 0x8020);
    assert_eq!(record[50], 1);
    let volts = f64::from(i16::from_le_bytes([record[110], record[111]])) * 10.0 / 32_768.0;
    assert!((volts - bench.number("@AN[1]")).abs() < 0.0004, "{volts}");
}

#[test]
fn records_are_pushed_to_another_handle() {
    let mut bench =
        Bench::new(EmulatedGalilSettings { is_serial: false, ..EmulatedGalilSettings::default() });
    bench.emulator.connect(bench.now, 0);
    assert_eq!(bench.ask("DR 4,B;TC1"), "?126 Can not use closed Ethernet handle\r\n:");
    bench.emulator.connect(bench.now, 1);
    bench.tell("DR 4,B");
    bench.wait(1.0);
    bench.tell("DR 0");
    let bytes = bench.emulator.transmit(1);
    let size = 82 + 4 * 36;
    assert_eq!(bytes.len(), 256 * size);
    let samples: Vec<u16> =
        bytes.chunks(size).map(|record| u16::from_le_bytes([record[4], record[5]])).collect();
    assert!(samples.windows(2).all(|pair| pair[1] - pair[0] == 4));
}
