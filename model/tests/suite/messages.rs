//! The words of what can be wrong with a calibration or a rig.

use palpate_model::calibration::CalibrationError as Wrong;
use palpate_model::rig::Fault;
use palpate_model::units::Seconds;
use palpate_test_support::assert_messages;

#[test]
fn what_prevents_a_calibration_is_worded() {
    assert_messages! {
        Wrong::TooFewSteps { count: 1 } => ["1 weight step"],
        Wrong::NotANumber { step: 2, mass_g: -3.0, volts: 1.5 } => ["step 2", "-3 g", "1.5 V"],
        Wrong::Fact { what: "excitation", value: f64::NAN } => ["excitation", "NaN"],
        Wrong::MassNotIncreasing { step: 3, mass_g: 50.0, before_g: 100.0 } => ["step 3", "50 g", "100 g"],
        Wrong::VoltsNotIncreasing { step: 4, volts: 1.1, before_volts: 1.2 } => ["step 4", "1.1 V", "1.2 V", "wiring"],
        Wrong::SignalFalls { mass_g: 100.0, volts: 1.1, before_g: 0.0, before_volts: 1.2, way: "loading" } => ["100 g", "1.1 V", "0 g", "1.2 V", "loading", "wiring"],
        Wrong::TooFlat => ["two weights"],
        Wrong::NewerFormat { format: 9 } => ["format 9"],
        Wrong::UnknownWeight { step: 5, name: "A".into() } => ["step 5", "\"A\""],
        Wrong::WeightsDisagree { step: 6, mass_g: 100.0, sum_g: 50.0 } => ["step 6", "100 g", "50 g"],
        Wrong::Tolerance { tolerance_g: -1.0 } => ["-1 g"],
        Wrong::NoSuchBreak { through_g: vec![0.0, 350.0] } => ["0 g, 350 g"],
        Wrong::NotRising { degree: 6, points: 11 } => ["degree 6", "11 weights"],
    }
}

#[test]
fn faults_of_a_rig_are_worded() {
    let detail = || "what the driver saw".to_owned();
    assert_messages! {
        Fault::LinkLost { detail: detail() } => ["what the driver saw"],
        Fault::CommandRefused { detail: detail() } => ["what the driver saw"],
        Fault::ControllerReset => ["controller"],
        Fault::SignalInvalid { tick: 7 } => ["load cell"],
        Fault::LogFailed { detail: detail() } => ["what the driver saw"],
        Fault::LogAtRisk { detail: detail() } => ["what the driver saw"],
        Fault::HostPaused { missed: Seconds(2.5) } => ["2.5 s"],
    }
}
