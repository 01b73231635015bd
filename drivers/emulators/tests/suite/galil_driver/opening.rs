//! What is found out and set when a controller is opened.

use super::bench::{Host, clock_of, thesis, try_connect, wired};
use palpate_drivers::galil::{AnalogRange, GalilOpenError, GalilSettings, Sampling, connect};
use palpate_drivers::wire::memory_link_pair;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::faults::DeviceFault;
use palpate_emulators::galil::{self, GalilModel};
use palpate_model::Nanos;

#[test]
fn a_controller_tells_what_it_is() {
    let host = Host::new(&thesis());
    let rig = &host.connected.description;
    for fact in ["DMC4143 Rev 1.3a", "no. 1820", "axis A", "input 1", "watchdog"] {
        assert!(rig.identity.contains(fact), "{fact}: {}", rig.identity);
    }
    assert_eq!(rig.tick_nanos, 976_563);
    assert!((rig.speed_quantum.0 - 0.03).abs() < 1e-12);
    assert!((rig.acceleration.0 - 61.44).abs() < 1e-9);
    let adc = rig.adc.unwrap();
    assert_eq!((adc.counts_min, adc.counts_max), (-32_768, 32_767));
    // Half a second at 20 mm/s and the brake.
    assert!((host.connected.worst_case_mm - (10.0 + 400.0 / 122.88)).abs() < 1e-9);
    assert!(host.connected.stats.round_trip_max < Nanos::from_millis(2));
    assert!(!host.connected.raw.is_empty());
}

#[test]
fn rates_are_those_read_back() {
    let mut settings = thesis();
    settings.acceleration.0 = 73_422.0 * 0.015;
    let host = Host::new(&settings);
    let made = host.connected.description.acceleration.0 / 0.015;
    assert!((made - 72_704.0).abs() < 1e-6, "{made}");
}

#[test]
fn other_series_and_clocks_are_driven_too() {
    for model in [GalilModel::Dmc4183, GalilModel::Dmc4040] {
        let wire = wired(galil::EmulatedGalilSettings {
            model,
            ..galil::EmulatedGalilSettings::default()
        });
        let found = try_connect(&wire, &thesis()).unwrap();
        assert_eq!(found.board.axes, model.axes());
    }
    let wire = wired(galil::EmulatedGalilSettings::default());
    {
        let mut wire = wire.lock();
        let now = wire.now;
        wire.emulator.receive(now, 0, b"TM 500\r");
        wire.emulator.transmit(0);
    }
    let found = try_connect(&wire, &thesis()).unwrap();
    assert_eq!(found.description.tick_nanos, 488_281);
    assert!((found.description.speed_quantum.0 - 0.06).abs() < 1e-12);
}

#[test]
fn what_is_not_the_rig_of_the_file_is_refused_in_words() {
    let serial = GalilSettings { serial_number: Some(7), ..thesis() };
    let axis = GalilSettings { axis: 'F', ..thesis() };
    let speed = GalilSettings { speed_max: palpate_model::MmPerS(1e6), ..thesis() };
    for (settings, words) in
        [(serial, "serial number 1820"), (axis, "axis F does not exist"), (speed, "SPA=")]
    {
        let wire = wired(galil::EmulatedGalilSettings::default());
        let err = try_connect(&wire, &settings).unwrap_err().to_string();
        assert!(err.contains(words), "{err}");
    }
}

#[test]
fn a_controller_without_inputs_is_refused() {
    let wire = wired(galil::EmulatedGalilSettings {
        model: GalilModel::Dmc2143,
        converter: None,
        ..galil::EmulatedGalilSettings::default()
    });
    let err = try_connect(&wire, &thesis()).unwrap_err();
    assert!(err.to_string().contains("no analog inputs"), "{err}");
    let other = wired(galil::EmulatedGalilSettings::default());
    other.lock().emulator.apply_fault(Nanos::ZERO, DeviceFault::WrongDevice, true);
    let err = try_connect(&other, &thesis()).unwrap_err();
    assert!(matches!(err, GalilOpenError::Unsupported { .. }), "{err}");
}

#[test]
fn another_range_has_other_counts() {
    let mut settings = thesis();
    settings.range = AnalogRange::Unipolar5;
    settings.bits = 12;
    let host = Host::new(&settings);
    let adc = host.connected.description.adc.unwrap();
    assert_eq!((adc.counts_min, adc.counts_max), (0, 4095));
    assert!((adc.volts_per_count - 5.0 / 4096.0).abs() < 1e-15);
}

#[test]
fn echo_half_a_line_and_half_a_download_are_got_rid_of() {
    for left in [&b"PAA=10"[..], b"DL\r#X\rJP #", b"EO 1\rMG 1,2\r"] {
        let wire = wired(galil::EmulatedGalilSettings {
            has_echo: true,
            ..galil::EmulatedGalilSettings::default()
        });
        {
            let mut wire = wire.lock();
            let now = wire.now;
            wire.emulator.receive(now, 0, left);
        }
        try_connect(&wire, &thesis()).unwrap_or_else(|err| panic!("{left:?}: {err}"));
    }
}

#[test]
fn nobody_on_the_wire_is_reported() {
    let (mut here, _there) = memory_link_pair();
    // A clock of its own: each look is a tenth of a second later.
    let now = std::sync::atomic::AtomicU64::new(0);
    let clock: palpate_drivers::wire::HostClock = std::sync::Arc::new(move || {
        Nanos(now.fetch_add(100_000_000, std::sync::atomic::Ordering::Relaxed))
    });
    let err = connect(&mut here, &clock, &thesis(), &"galil".into()).unwrap_err();
    assert_eq!(err, GalilOpenError::Silent);
    let wire = wired(galil::EmulatedGalilSettings::default());
    wire.lock().is_cut = true;
    let lost = connect(&mut wire.clone(), &clock_of(&wire), &thesis(), &"galil".into());
    assert!(matches!(lost, Err(GalilOpenError::Lost { .. })));
}

/// Repeats are compared by it.
#[test]
fn the_identity_is_the_same_each_time() {
    for sampling in [Sampling::Poll, Sampling::Record] {
        let settings = GalilSettings { sampling, ..thesis() };
        let wire = wired(galil::EmulatedGalilSettings::default());
        let first = try_connect(&wire, &settings).unwrap();
        let second = try_connect(&wire, &settings).unwrap();
        assert_eq!(first.description.identity, second.description.identity);
        assert!(first.link.contains("the controller answers in"), "{}", first.link);
    }
}

#[test]
fn switches_set_otherwise_are_an_error_that_names_them() {
    let wire = wired(galil::EmulatedGalilSettings::default());
    // Every sign is lost on the way here, so that `CN -1,-1` is not what is read back.
    wire.lock().spoil = Box::new(|byte| if byte == b'-' { Vec::new() } else { vec![byte] });
    let err = try_connect(&wire, &thesis()).unwrap_err();
    let GalilOpenError::SetOtherwise { command, found } = err else {
        panic!("{err}");
    };
    assert_eq!(command, "CN -1,-1");
    assert!(found.contains("1.0000"), "{found}");
}
