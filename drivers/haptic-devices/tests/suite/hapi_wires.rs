//! The device on a real port, in real time. Waits are generous: nothing here is about speed.

use super::served::{
    ServedHapi, assert_ticks_allocate_nothing, clock, finite_pose, no_pose, tick_until,
};
use palpate_drivers::wire::DeviceAddress;
use palpate_emulators::hapi::{HapiBoardSettings, HapiFault, HapiLie};
use palpate_haptic_devices::{
    ForceLimits, ForceStop, HapiError, HapiOptions, LinkedDevice, open_hapi,
};
use palpate_haptics::scene::Pose;
use palpate_model::Nanos;
use palpate_test_support::wait::until;

/// Limits that a busy computer keeps: these tests are not about time.
fn patient(served: &ServedHapi) -> HapiOptions {
    let limits = ForceLimits {
        scene_silence: Nanos::from_millis(5_000),
        reply_silence: Nanos::from_millis(1_000),
        ..ForceLimits::default()
    };
    HapiOptions { limits, ..served.options() }
}

fn open(options: &HapiOptions) -> Result<LinkedDevice, HapiError> {
    open_hapi(options, clock())
}

/// Half a newton out of the tissue: against the plane's y axis.
fn is_pushed(served: &ServedHapi) -> bool {
    let [x, y] = served.panel.force();
    x.abs() < 0.05 && (y + 0.5).abs() < 0.05
}

#[test]
fn board_is_set_up_and_the_force_reaches_the_hand() {
    let served = ServedHapi::start(HapiBoardSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    assert!(served.panel.is_set_up());
    assert_eq!(device.round_trip().count, 200);
    assert!(device.loop_device().delay_ticks > 1.5);
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |_| is_pushed(&served));
    // The hand swings 8 mm around the middle of the tissue, and stays in the middle along the missing axis.
    let is_at_work = |pose: &Pose| {
        let [x, y, z] = pose.at;
        (x - 30.0).abs() < 5.0 && y == 30.0 && z.abs() < 12.0
    };
    until(|| Some(finite_pose(&mut device)).filter(is_at_work), || "the hand is elsewhere".into());
    drop(device);
    // At once: the device waits for the answer to its last zero.
    until(|| (served.panel.torques() == [0.0; 2]).then_some(()), || "torque after the end".into());
}

#[test]
fn every_refusal_is_one_sentence() {
    let served = ServedHapi::start(HapiBoardSettings::default());
    let usual = patient(&served);
    let missing = DeviceAddress::Serial {
        port: "/dev/there-is-no-such-port".into(),
        baud: 115_200,
        has_handshake: false,
    };
    let missing = open(&HapiOptions { address: missing, ..usual.clone() }).unwrap_err();
    assert!(missing.to_string().contains("does not exist"), "{missing}");
    served.panel.set_fault(Some(HapiFault::Mute));
    until(|| served.panel.fault_at(), || "no fault".into());
    let silent = open(&usual).unwrap_err();
    assert!(silent.to_string().contains("no hAPI board answers"), "{silent}");
    for err in [missing, silent] {
        let text = err.to_string();
        assert!(!text.contains('\n') && text.len() < 400, "{text}");
    }
    served.panel.set_fault(None);
    until(|| served.panel.fault_at().is_none().then_some(()), || "a fault".into());
    assert!(open(&usual).is_ok());
}

#[test]
fn board_that_keeps_its_home_position_is_found_again_and_the_force_comes_back() {
    let settings = HapiBoardSettings { has_own_power: true, ..HapiBoardSettings::default() };
    let served = ServedHapi::start(settings);
    let mut device = open(&patient(&served)).unwrap();
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |report| report.stop == ForceStop::None);
    served.panel.set_fault(Some(HapiFault::Cut));
    // After 1.5 s without an answer the port is opened again.
    let lost = tick_until(&mut device, &monitor, |report| report.losses > 0);
    assert_ne!(lost.stop, ForceStop::None);
    no_pose(&mut device);
    served.panel.set_fault(None);
    tick_until(&mut device, &monitor, |_| is_pushed(&served));
    finite_pose(&mut device);
}

#[test]
fn board_that_has_restarted_gives_no_force_until_it_is_opened_again() {
    let served = ServedHapi::start(HapiBoardSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |report| report.stop == ForceStop::None);
    served.panel.set_fault(Some(HapiFault::Cut));
    until(|| served.panel.fault_at(), || "no fault".into());
    served.panel.set_fault(None);
    let report = tick_until(&mut device, &monitor, |report| report.stop == ForceStop::NotReady);
    assert!(report.fault.unwrap().contains("home position"), "{report:?}");
    assert_eq!(served.panel.torques(), [0.0; 2]);
    no_pose(&mut device);
}

#[test]
fn lies_are_reported_and_no_pose_is_taken_from_them() {
    let served = ServedHapi::start(HapiBoardSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    let monitor = device.monitor();
    tick_until(&mut device, &monitor, |report| report.stop == ForceStop::None);
    served.panel.set_fault(Some(HapiFault::Lie(HapiLie::NotANumber)));
    let report = tick_until(&mut device, &monitor, |report| report.stop == ForceStop::BadReport);
    assert!(report.faults > 0 && report.fault.is_some(), "{report:?}");
    until(|| (served.panel.torques() == [0.0; 2]).then_some(()), || "torque".into());
    no_pose(&mut device);
}

#[test]
fn tick_of_the_scene_allocates_nothing() {
    let served = ServedHapi::start(HapiBoardSettings::default());
    let mut device = open(&patient(&served)).unwrap();
    assert_ticks_allocate_nothing(&mut device);
}
