//! Messages as text: what palpate sends, what it reads, and what it makes of texts that no service sends.

use palpate_drivers::sim::{Random, RandomStream};
use palpate_emulators::inverse::{InverseService, InverseServiceSettings};
use palpate_haptic_devices::inverse::{Exchange, ReportFault, ServiceReport, write_force};
use palpate_haptic_devices::{ForceLimits, WorkspaceFit};
use palpate_model::Nanos;
use serde_json::{Value, json};

#[test]
fn first_message_names_the_session_and_later_ones_the_force_alone() {
    let mut text = String::new();
    write_force(&mut text, "049D", [0.25, -1.0, 1e-7], true);
    let expected = json!({
        "session": { "configure": {
            "profile": { "name": "palpate:scene", "required_version": ">=3.5" },
        } },
        "inverse3": [{
            "device_id": "049D",
            "configure": { "preset": { "preset": "arm_front_centered" } },
            "commands": { "set_cursor_force": { "vector": { "x": 0.25, "y": -1.0, "z": 1e-7 } } },
        }],
    });
    assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), expected);
    // A force at no number is none, whoever asks for it.
    write_force(&mut text, "049D", [f64::NAN, f64::INFINITY, 2.0], false);
    let expected = json!({ "inverse3": [{
        "device_id": "049D",
        "commands": { "set_cursor_force": { "vector": { "x": 0.0, "y": 0.0, "z": 2.0 } } },
    }] });
    let sent: Value = serde_json::from_str(&text).unwrap();
    let part = |value: &Value, name: &str| {
        value
            .pointer(&format!("/inverse3/0/commands/set_cursor_force/vector/{name}"))
            .unwrap()
            .as_f64()
    };
    for name in ["x", "y", "z"] {
        assert_eq!(part(&sent, name), part(&expected, name), "{name}");
    }
    assert_eq!(sent.as_object().unwrap().len(), 1);
}

/// A report with a grip on a wire, in single precision.
fn wired_report() -> Value {
    json!({
        "session_id": 3,
        "inverse3": [{
            "device_id": "A14",
            "state": {
                "cursor_position": { "x": 0.01, "y": -0.12, "z": 0.15 },
                "cursor_velocity": { "x": 0.0, "y": 0.3, "z": -0.4 },
                "unknown": [1, 2, 3],
            },
            "status": { "calibrated": true, "in_use": true, "power_supply": true, "ready": true },
        }],
        "verse_grip": [{
            "device_id": "VG",
            "state": {
                "button": true, "hall": 3,
                "orientation": { "w": 0.70710677, "x": 0.0, "y": 0.0, "z": 0.70710677 },
            },
            "status": { "error": 0, "ready": true },
        }],
    })
}

fn read(value: &Value) -> Result<palpate_haptic_devices::inverse::ArmReport, ReportFault> {
    let report = ServiceReport::parse(&value.to_string())?;
    report.arm("A14", Some("VG"))
}

#[test]
fn report_is_read_with_a_grip_on_a_wire() {
    let report = read(&wired_report()).unwrap();
    assert_eq!(report.position_m, [0.01, -0.12, 0.15]);
    assert_eq!(report.is_held, Some(true));
    // Eight digits of single precision.
    assert!((report.quaternion[0] - 0.5_f64.sqrt()).abs() < 1e-7);
    let length: f64 = report.quaternion.iter().map(|part| part * part).sum();
    assert!((length - 1.0).abs() < 1e-15);
}

#[test]
fn every_wrong_value_has_its_fault() {
    let cases: [(&str, Value, Result<(), ReportFault>); 11] = [
        ("/inverse3/0/state/unknown", json!("anything"), Ok(())),
        ("/inverse3/0/device_id", json!("B"), Err(ReportFault::DeviceMissing)),
        ("/inverse3/0/state/cursor_position/x", Value::Null, Err(ReportFault::Position)),
        ("/inverse3/0/state/cursor_position/x", json!(1.5), Err(ReportFault::Position)),
        ("/inverse3/0/state/cursor_position", Value::Null, Err(ReportFault::Position)),
        ("/inverse3/0/state/cursor_velocity/z", json!(-21.0), Err(ReportFault::Velocity)),
        ("/inverse3/0/state/cursor_velocity", Value::Null, Err(ReportFault::Velocity)),
        ("/verse_grip/0/device_id", json!("other"), Err(ReportFault::GripMissing)),
        ("/verse_grip/0/state/orientation/w", json!(0.9), Err(ReportFault::Orientation)),
        ("/verse_grip/0/state/orientation", Value::Null, Err(ReportFault::Orientation)),
        ("/inverse3/0/state/cursor_position/x", json!("0.01"), Err(ReportFault::Unreadable)),
    ];
    for (path, value, expected) in cases {
        let mut report = wired_report();
        *report.pointer_mut(path).unwrap() = value.clone();
        assert_eq!(read(&report).map(|_| ()), expected, "{path} {value}");
    }
}

#[test]
fn button_counts_only_on_a_grip_that_is_there() {
    for (path, value) in
        [("/verse_grip/0/state/button", json!(false)), ("/verse_grip/0/status/ready", json!(false))]
    {
        let mut report = wired_report();
        *report.pointer_mut(path).unwrap() = value;
        assert_eq!(read(&report).unwrap().is_held, Some(false), "{path}");
    }
}

#[test]
fn damaged_reports_never_panic_and_never_make_a_force_that_is_too_large() {
    let mut service = InverseService::new(InverseServiceSettings::default()).unwrap();
    let mut random = Random::new(5, RandomStream::Fault);
    let limits = ForceLimits { ramp: Nanos(1), ..ForceLimits::default() };
    let names = ("049D".to_owned(), "61576".to_owned());
    let mut exchange = Exchange::new(names, WorkspaceFit::default(), [0.0; 3], limits);
    let inventory = service.open(Nanos::ZERO, 0);
    exchange.begin(&inventory).unwrap();
    let mut below = |count: usize| (random.unit() * count as f64) as usize;
    let (mut good, mut bad) = (0, 0);
    for step in 1..=20_000_u64 {
        let now = Nanos(step * 1_000_000);
        exchange.set_order(now, [0.0, 100.0, 0.0]);
        let reports = service.receive(now, 0, exchange.message(now));
        let [_, force, _] = service.force();
        assert!(force.abs() <= limits.force_max_n * (1.0 + 1e-15), "{force}");
        let mut bytes = reports[0].clone().into_bytes();
        for _ in 0..below(3) {
            let at = below(bytes.len());
            match below(3) {
                0 => bytes[at] = below(128) as u8,
                1 => bytes.truncate(at + 1),
                _ => bytes.insert(at, b"0123456789-e.\"{}[]:,"[below(20)]),
            }
        }
        let pose = exchange.receive(now, &String::from_utf8_lossy(&bytes)).pose;
        let is_finite = pose.at.iter().chain(&pose.turn).all(|part| part.is_finite());
        if is_finite {
            good += 1;
            assert!(pose.at.iter().all(|part| part.abs() <= 1000.0), "{pose:?}");
        } else {
            bad += 1;
            assert!(pose.at.iter().all(|part| part.is_nan()), "{pose:?}");
        }
    }
    // A third is untouched, and most of the others are seen to be damaged.
    assert!(good > 6000 && bad > 5000, "{good} good, {bad} bad");
}
