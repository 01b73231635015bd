//! The device on a real socket, in real time. Waits are generous: nothing here is about speed.

use super::served::{
    ServedInverse, assert_ticks_allocate_nothing, clock, finite_pose, is_given, no_pose, tick_until,
};
use palpate_emulators::inverse::{InverseFault, InverseLie, InverseServiceSettings};
use palpate_haptic_devices::{
    ForceLimits, ForceStop, InverseError, InverseOptions, LinkedDevice, open_inverse,
};
use palpate_haptics::{HapticDevice, Period};
use palpate_model::Nanos;
use palpate_test_support::wait::until;
use std::net::TcpListener;

/// Limits that a busy computer keeps: these tests are not about time.
fn patient(served: &ServedInverse) -> InverseOptions {
    let limits = ForceLimits {
        scene_silence: Nanos::from_millis(5_000),
        reply_silence: Nanos::from_millis(5_000),
        ..ForceLimits::default()
    };
    InverseOptions { limits, ..served.options() }
}

fn open(options: &InverseOptions) -> Result<LinkedDevice, InverseError> {
    open_inverse(options, clock()).map(|(device, _)| device)
}

#[test]
fn device_is_found_and_its_force_reaches_the_hand() {
    let served = ServedInverse::start(InverseServiceSettings::default());
    let (mut device, found) = open_inverse(&patient(&served), clock()).unwrap();
    assert_eq!(found.name, "049D");
    assert_eq!(found.grip, "61576");
    assert_eq!(found.version, "3.5.0.0");
    assert_eq!(device.round_trip().count, 200);
    assert!(device.loop_device().delay_ticks > 2.0);
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |_| is_given(served.panel.force()));
    let pose = finite_pose(&mut device);
    // The hand swings 8 mm around the middle of the reach, which is the middle of the tissue.
    let [x, y, z] = pose.at;
    assert!((x - 30.0).abs() < 5.0 && (y - 30.0).abs() < 1.0 && z.abs() < 12.0, "{pose:?}");
    drop(device);
    until(|| (served.panel.force() == [0.0; 3]).then_some(()), || "force after the end".into());
}

#[test]
fn every_refusal_is_one_sentence() {
    let served = ServedInverse::start(InverseServiceSettings::default());
    let bare = InverseServiceSettings { has_grip: false, ..InverseServiceSettings::default() };
    let bare = ServedInverse::start(bare);
    let set_fault = |fault| {
        served.panel.set_fault(fault);
        let is_set = || served.panel.fault_at().is_some() == Option::is_some(&fault);
        until(|| is_set().then_some(()), || format!("{fault:?}"));
    };
    let refused = |fault, options: &InverseOptions| {
        set_fault(None);
        set_fault(fault);
        open(options).unwrap_err()
    };
    let usual = served.options();
    let slow = Period::of_rate(400.0).unwrap();
    let cases: Vec<(InverseError, &str)> = vec![
        (refused(Some(InverseFault::Old), &usual), "version 3.1.1.0"),
        (refused(Some(InverseFault::New), &usual), "version 4.0.0.0"),
        (refused(Some(InverseFault::NoDevice), &usual), "no Inverse3"),
        (refused(Some(InverseFault::Uncalibrated), &usual), "not calibrated"),
        (refused(Some(InverseFault::Unpowered), &usual), "no power"),
        (refused(Some(InverseFault::InUse), &usual), "in use"),
        (
            refused(None, &InverseOptions { device: Some("0000".into()), ..usual.clone() }),
            "no device named '0000'; it has 049D",
        ),
        (refused(None, &bare.options()), "no grip"),
        (refused(None, &InverseOptions { period: slow, ..usual.clone() }), "too slow"),
    ];
    for (err, part) in cases {
        let text = err.to_string();
        assert!(text.contains(part), "{text}");
        assert!(!text.contains('\n') && text.len() < 250, "{text}");
    }
    assert!(open(&usual).is_ok());
}

#[test]
fn port_without_a_service_is_refused() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let served = ServedInverse::start(InverseServiceSettings::default());
    drop(listener);
    let gone = InverseOptions { address, ..served.options() };
    assert!(matches!(open(&gone), Err(InverseError::NoService { .. })));
}

#[test]
fn lost_connection_is_opened_again_and_the_force_comes_back() {
    let served = ServedInverse::start(InverseServiceSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |report| report.stop == ForceStop::None);
    served.panel.set_fault(Some(InverseFault::Cut));
    let lost = tick_until(&mut device, &monitor, |report| !report.is_connected);
    assert_eq!((lost.stop, lost.losses), (ForceStop::LinkLost, 1));
    no_pose(&mut device);
    served.panel.set_fault(None);
    tick_until(&mut device, &monitor, |_| is_given(served.panel.force()));
    finite_pose(&mut device);
}

#[test]
fn lies_are_reported_and_no_pose_is_taken_from_them() {
    let served = ServedInverse::start(InverseServiceSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |report| report.stop == ForceStop::None);
    served.panel.set_fault(Some(InverseFault::Lie(InverseLie::NotANumber)));
    let report = tick_until(&mut device, &monitor, |report| report.stop == ForceStop::BadReport);
    assert!(report.faults > 0 && report.fault.is_some(), "{report:?}");
    until(|| (served.panel.force() == [0.0; 3]).then_some(()), || "force".into());
    no_pose(&mut device);
}

#[test]
fn released_button_ends_the_force_and_the_pose_stays() {
    let served = ServedInverse::start(InverseServiceSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |report| report.stop == ForceStop::None);
    served.panel.set_held(false);
    tick_until(&mut device, &monitor, |report| report.stop == ForceStop::NotHeld);
    until(|| (served.panel.force() == [0.0; 3]).then_some(()), || "force".into());
    finite_pose(&mut device);
}

#[test]
fn tick_of_the_scene_allocates_nothing() {
    let served = ServedInverse::start(InverseServiceSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    assert_ticks_allocate_nothing(&mut device);
}

#[test]
fn pose_of_a_thread_that_does_not_run_is_not_taken() {
    let served = ServedInverse::start(InverseServiceSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |report| report.stop == ForceStop::None);
    // Nothing between the calls: the scene's ticks passed, and no report came. A report may come between two of them.
    let is_gone = |device: &mut LinkedDevice| {
        device.sense(1);
        device.sense(1000).at[0].is_nan()
    };
    until(|| is_gone(&mut device).then_some(()), || "an old pose is taken".into());
}
