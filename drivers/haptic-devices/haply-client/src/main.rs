//! Haply's crate `haply` 1.3.1, unchanged, drives the emulated Inverse service: version, devices, session, force, pose,
//! grip, and a report that lies. Exit code 1 if something differs.

use haply::HaplyDevice;
use haply::device_model::{
    Config, Force, ForceInput, Inverse3Configure, PresetConfig, ProfileConfig, SessionConfigure,
};
use palpate_emulators::ServedDevice;
use palpate_emulators::inverse::{
    EmulatedInverse, InverseFault, InverseLie, InversePanel, InverseServiceSettings,
};
use std::error::Error;
use std::time::Duration;

type Outcome = Result<(), Box<dyn Error + Send + Sync>>;

/// Longest wait for something that must come.
const WAITS: u32 = 2000;

fn check(what: &str, is_so: bool) -> Outcome {
    println!("{what}: {}", if is_so { "as expected" } else { "DIFFERENT" });
    if is_so { Ok(()) } else { Err(what.into()) }
}

/// Sends a force until the hand has it.
async fn push(device: &mut HaplyDevice, panel: &InversePanel, z: f32) -> Outcome {
    let input =
        || vec![ForceInput { device_id: "049D".into(), forces: Force { x: 0.0, y: 0.0, z } }];
    for _ in 0..WAITS {
        device.update_force(input(), Some(true), Some(true)).await?;
        tokio::time::sleep(Duration::from_millis(1)).await;
        if panel.force() == [0.0, 0.0, f64::from(z)] {
            return check(&format!("a force of {z} N on the hand"), true);
        }
    }
    check(&format!("a force of {z} N on the hand"), false)
}

async fn drive() -> Outcome {
    let (service, panel) = EmulatedInverse::new(InverseServiceSettings::default())?;
    let served = ServedDevice::start(service, ServedDevice::free_port())?;
    let address = &served.address;
    let mut device =
        HaplyDevice::new(&format!("http://{address}"), &format!("ws://{address}/")).await?;
    let version = device.get_service_version().await?;
    check("the version", version.project_version == "3.5.0.0")?;
    let devices = device.list_devices().await?;
    check("two devices over HTTP", devices.len() == 2)?;
    let is_arm = matches!(&devices[0], Config::DeviceConfig(arm) if arm.id == "049D");
    check("an Inverse3 named 049D", is_arm)?;

    let profile = ProfileConfig {
        name: "palpate:haply-client".into(),
        required_version: Some(">=3.5".into()),
    };
    let session = SessionConfigure { profile: Some(profile), ..Default::default() };
    device.configure_session(session, Some(true)).await?;
    push(&mut device, &panel, 1.5).await?;

    let state = device.read_state().await?;
    let arm = state.inverse3.first().ok_or("no Inverse3 over WebSocket")?;
    let place = arm.state.cursor_position.ok_or("no position")?;
    // The hand swings some millimetres around 0, -0.12, 0.15 m from the base.
    let is_near =
        place.x.abs() < 0.02 && (place.y + 0.12).abs() < 0.02 && (place.z - 0.15).abs() < 0.03;
    check("a position near the middle of the reach, from the base", is_near)?;
    check("calibrated, powered and ready", {
        let status = &arm.status;
        status.calibrated && status.power_supply && status.ready
    })?;
    let grip = state.wireless_verse_grip.first().ok_or("no grip")?;
    check("a pressed button", grip.state.buttons.as_ref().is_some_and(|buttons| buttons.a))?;

    let preset = PresetConfig { preset: "arm_front_centered".into() };
    let config = Inverse3Configure { preset: Some(preset), ..Default::default() };
    device.configure_inverse3("049D", config, Some(true)).await?;
    push(&mut device, &panel, 0.75).await?;
    let state = device.force_read_full_state(Some(Duration::from_secs(5))).await?;
    let place = state.inverse3[0].state.cursor_position.ok_or("no position")?;
    check("a position near zero with the preset arm_front_centered", {
        place.y.abs() < 0.02 && place.z.abs() < 0.03
    })?;

    // What Haply's client makes of a report that lies is its matter; it must go on afterwards.
    panel.set_fault(Some(InverseFault::Lie(InverseLie::NotANumber)));
    push(&mut device, &panel, 0.5).await?;
    panel.set_fault(None);
    push(&mut device, &panel, 0.0).await?;
    device.shutdown().await?;
    Ok(())
}

#[tokio::main]
async fn main() -> std::process::ExitCode {
    match drive().await {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(err) => {
            eprintln!("{err}");
            std::process::ExitCode::FAILURE
        }
    }
}
