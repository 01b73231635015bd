//! The service's JSON: the full inventory, the reports, and reports that lie.

use super::InverseLie;
use serde_json::{Value, json};

/// Name of the emulated device and of its grip.
pub const DEVICE: &str = "049D";
pub const GRIP: &str = "61576";

/// What a report says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    pub session: u64,
    /// In m.
    pub position: [f64; 3],
    /// In m/s.
    pub velocity: [f64; 3],
    /// In N.
    pub force: [f64; 3],
    pub is_calibrated: bool,
    pub is_powered: bool,
    pub is_in_use: bool,
    pub has_device: bool,
    pub has_grip: bool,
    pub is_held: bool,
    pub is_centred: bool,
}

fn vector([x, y, z]: [f64; 3]) -> Value {
    json!({ "x": x, "y": y, "z": z })
}

fn arm(facts: &Facts) -> Value {
    let zero = json!({ "a0": 0.0, "a1": 0.0, "a2": 0.0 });
    json!({
        "device_id": DEVICE,
        "state": {
            "cursor_position": vector(facts.position),
            "cursor_velocity": vector(facts.velocity),
            "angular_position": zero,
            "angular_velocity": zero,
            "body_orientation": { "w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0 },
            "current_cursor_force": vector(facts.force),
            "current_cursor_position": vector([0.0; 3]),
            "current_angular_torques": zero,
            "current_angular_position": zero,
            // Not in Haply's pages, but its client requires it.
            "mode": "idle",
            "control_domain": "cartesian",
            "control_mode": "force",
            "transform": {},
        },
        "status": {
            "calibrated": facts.is_calibrated,
            "in_use": facts.is_in_use,
            "power_supply": facts.is_powered,
            "ready": true,
            "started": true,
        },
    })
}

fn arm_config(facts: &Facts) -> Value {
    let preset = if facts.is_centred { "arm_front_centered" } else { "defaults" };
    json!({
        "type": "inverse3",
        "port": "emulated",
        "device_info": {
            "major_version": 7, "minor_version": 4, "id": DEVICE, "device_type": 4,
            "uuid": "00000000-0000-0000-0000-000000000000",
        },
        "extended_device_id": "emulated",
        "extended_firmware_version": "emulated",
        "gravity_compensation": { "enabled": true, "scaling_factor": 1.0 },
        "handedness": "right",
        "streaming_mode": "USB",
        "torque_scaling": { "enabled": true },
        "home_return": { "enabled": false },
        "preset": preset,
        "basis": { "permutation": "XYZ" },
        "mount": {},
        "filters": { "force_gate": { "gain": 0.3 }, "damping": { "scalar": 0.0 } },
    })
}

fn grip(facts: &Facts) -> Value {
    json!({
        "device_id": GRIP,
        "state": {
            "battery_level": 0.9,
            "battery_voltage": 3.9,
            "buttons": { "a": facts.is_held, "b": false, "c": false },
            "hall": 0,
            "orientation": { "w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0 },
            "transform": {},
        },
        "status": { "ready": true, "connected": true, "awake": true },
    })
}

fn grip_config() -> Value {
    json!({
        "port": "emulated",
        "type": "wireless_verse_grip",
        "major_version": 1, "minor_version": 0, "hardware_version": 1,
        "streaming_mode": "Radio",
        "basis": { "permutation": "XYZ" },
        "preset": "defaults",
        "mount": {},
    })
}

/// A report of all devices; `is_full` adds their configuration.
pub fn report(facts: &Facts, is_full: bool) -> Value {
    let (mut arms, mut grips) = (Vec::new(), Vec::new());
    if facts.has_device {
        let mut arm = arm(facts);
        if is_full {
            arm["config"] = arm_config(facts);
        }
        arms.push(arm);
    }
    if facts.has_grip {
        let mut grip = grip(facts);
        if is_full {
            grip["config"] = grip_config();
        }
        grips.push(grip);
    }
    json!({ "session_id": facts.session, "inverse3": arms, "wireless_verse_grip": grips })
}

/// The texts sent in place of a true report.
pub fn lying(facts: &Facts, lie: InverseLie) -> Vec<String> {
    let mut facts = *facts;
    match lie {
        InverseLie::Huge => facts.position[2] = 4_000.0,
        InverseLie::Jump => facts.position[2] += 0.05,
        InverseLie::OtherSession => facts.session += 1,
        InverseLie::DeviceGone => facts.has_device = false,
        InverseLie::GripGone => facts.has_grip = false,
        InverseLie::Uncalibrated => facts.is_calibrated = false,
        _ => {}
    }
    let mut report = report(&facts, false);
    let state = report.pointer_mut("/inverse3/0/state");
    match (lie, state) {
        (InverseLie::Null, Some(state)) => state["cursor_position"]["x"] = Value::Null,
        (InverseLie::NoVelocity, Some(state)) => state["cursor_velocity"]["y"] = Value::Null,
        (InverseLie::Missing, Some(Value::Object(state))) => {
            state.remove("cursor_position");
        }
        (InverseLie::NotANumber | InverseLie::Infinite, Some(state)) => {
            state["cursor_position"]["x"] = "?".into();
        }
        _ => {}
    }
    let text = report.to_string();
    match lie {
        InverseLie::NotANumber => vec![text.replacen("\"?\"", "NaN", 1)],
        InverseLie::Infinite => vec![text.replacen("\"?\"", "1e999", 1)],
        InverseLie::Twice => vec![text.clone(), text],
        InverseLie::Cut => vec![text[..text.len() / 2].to_owned()],
        _ => vec![text],
    }
}

/// The answer of `/version`.
pub fn version(version: &str) -> Value {
    json!({
        "build_time": "2026-01-01T00:00:00Z",
        "git_branch": "main",
        "git_describe": version,
        "git_hash": "00000000",
        "git_tag": version,
        "project_name": "haply-inverse-service",
        "project_version": format!("{version}.0"),
    })
}
