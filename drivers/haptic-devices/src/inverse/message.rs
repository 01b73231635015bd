//! Messages of the Inverse service 3.5: its reports into numbers, forces into its commands.
//!
//! Field names and units: docs.haply.co, Inverse SDK 3.5 (WebSocket protocol, control commands), and Haply's crate `haply`
//! 1.3.1. Places are in m, speeds in m/s, forces in N; the service answers every message with one report, and numbers or dates
//! no report.

use crate::gate::ReportState;
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// Farthest place from the device's origin in m. The arm reaches about 0.3 m from its base.
const REACH_MAX_M: f64 = 1.0;
/// Fastest speed in m/s that can be: a thrown stylus has less.
const SPEED_MAX_M_PER_S: f64 = 20.0;
/// How far the square of a quaternion's length may be from one: the service sends single precision with few digits.
const QUATERNION_TOLERANCE: f64 = 0.05;

/// A vector as the service writes it. A number that is none is missing or `null` in JSON.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
struct Vector {
    x: Option<f64>,
    y: Option<f64>,
    z: Option<f64>,
}

impl Vector {
    fn within(self, most: f64) -> Option<[f64; 3]> {
        let [x, y, z] = [self.x?, self.y?, self.z?];
        let length = x.hypot(y).hypot(z);
        (length <= most).then_some([x, y, z])
    }
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct Quaternion {
    w: Option<f64>,
    x: Option<f64>,
    y: Option<f64>,
    z: Option<f64>,
}

impl Quaternion {
    fn unit(self) -> Option<[f64; 4]> {
        let parts = [self.w?, self.x?, self.y?, self.z?];
        let square: f64 = parts.iter().map(|part| part * part).sum();
        let is_unit = (square - 1.0).abs() <= QUATERNION_TOLERANCE;
        is_unit.then(|| parts.map(|part| part / square.sqrt()))
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct ArmState {
    cursor_position: Option<Vector>,
    cursor_velocity: Option<Vector>,
}

/// What an arm says about itself. Whatever is missing is not the case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default)]
pub struct ArmStatus {
    pub calibrated: bool,
    pub in_use: bool,
    pub power_supply: bool,
    pub ready: bool,
}

impl ArmStatus {
    fn is_able(self) -> bool {
        self.calibrated && self.power_supply && self.ready
    }
}

#[derive(Debug, Deserialize)]
struct Arm {
    device_id: String,
    #[serde(default)]
    state: ArmState,
    #[serde(default)]
    status: ArmStatus,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Buttons {
    a: bool,
    b: bool,
    c: bool,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct GripState {
    /// Of a grip on a wire.
    button: Option<bool>,
    /// Of a wireless grip.
    buttons: Option<Buttons>,
    orientation: Option<Quaternion>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct GripStatus {
    ready: Option<bool>,
    connected: Option<bool>,
    awake: Option<bool>,
}

#[derive(Debug, Deserialize)]
struct Grip {
    device_id: String,
    #[serde(default)]
    state: GripState,
    #[serde(default)]
    status: GripStatus,
}

impl Grip {
    fn is_held(&self) -> bool {
        let status = [self.status.ready, self.status.connected, self.status.awake];
        let buttons = self.state.buttons.as_ref();
        let is_pressed = self.state.button == Some(true)
            || buttons.is_some_and(|buttons| buttons.a || buttons.b || buttons.c);
        is_pressed && !status.contains(&Some(false))
    }
}

#[derive(Debug, Deserialize)]
struct SessionInfo {
    session_id: Option<u64>,
}

/// A report of the service; lists that are missing are empty.
#[derive(Debug, Deserialize)]
pub struct ServiceReport {
    session_id: Option<u64>,
    session: Option<SessionInfo>,
    #[serde(default)]
    inverse3: Vec<Arm>,
    #[serde(default)]
    verse_grip: Vec<Grip>,
    #[serde(default)]
    wireless_verse_grip: Vec<Grip>,
    #[serde(default)]
    custom_verse_grip: Vec<Grip>,
}

palpate_model::named! {
    /// What is wrong with a report.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum ReportFault {
        /// Not JSON, or not a report.
        Unreadable = "the report is not readable",
        /// A report that no message waits for.
        Unexpected = "the report answers no message",
        /// Of another session.
        OtherSession = "the report is of a different session",
        /// The device is not in it.
        DeviceMissing = "the device is missing in the report",
        /// No finite place within reach.
        Position = "the position is missing, not finite or out of reach",
        /// No finite speed that can be.
        Velocity = "the velocity is missing, not finite or too large",
        /// Farther from the last place than any hand moves.
        Jump = "the position jumps",
        /// A grip that was there is gone.
        GripMissing = "the grip is missing in the report",
        /// A grip whose turn is no unit quaternion.
        Orientation = "the orientation of the grip is missing or not finite",
    }
}

/// A report of one device in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmReport {
    /// Place of the stylus in m along the device's axes.
    pub position_m: [f64; 3],
    /// Its velocity in m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Turn of the grip (w, x, y, z), none without a grip.
    pub quaternion: [f64; 4],
    pub status: ArmStatus,
    /// Whether the dead-man button is pressed; `None` without a grip.
    pub is_held: Option<bool>,
}

impl ArmReport {
    /// The report as the gate sees it.
    #[must_use]
    pub fn state(&self) -> ReportState {
        if !self.status.is_able() {
            return ReportState::NotReady;
        }
        let [x, y, z] = self.velocity_m_per_s;
        ReportState::Good { speed_mm_per_s: 1000.0 * x.hypot(y).hypot(z), is_held: self.is_held }
    }
}

impl ServiceReport {
    /// Reads a report of the WebSocket.
    pub fn parse(text: &str) -> Result<Self, ReportFault> {
        serde_json::from_str(text).map_err(|_| ReportFault::Unreadable)
    }

    /// Reads a list of devices, bare or in the envelope `{"ok": true, "data": ...}`: Haply's pages show both.
    pub fn parse_devices(text: &str) -> Result<Self, ReportFault> {
        #[derive(Deserialize)]
        struct Envelope {
            data: ServiceReport,
        }
        let envelope = serde_json::from_str::<Envelope>(text);
        envelope.map_or_else(|_| Self::parse(text), |envelope| Ok(envelope.data))
    }

    /// The session it belongs to.
    #[must_use]
    pub fn session(&self) -> Option<u64> {
        self.session_id.or_else(|| self.session.as_ref()?.session_id)
    }

    /// Names and states of all arms.
    pub fn arms(&self) -> impl Iterator<Item = (&str, ArmStatus)> {
        self.inverse3.iter().map(|arm| (arm.device_id.as_str(), arm.status))
    }

    fn grips(&self) -> impl Iterator<Item = &Grip> {
        self.custom_verse_grip.iter().chain(&self.wireless_verse_grip).chain(&self.verse_grip)
    }

    /// The first grip: custom before wireless before wired, as a wireless grip may be listed twice.
    pub fn first_grip(&self) -> Option<&str> {
        self.grips().next().map(|grip| grip.device_id.as_str())
    }

    /// The numbers of an arm and the grip on it.
    pub fn arm(&self, device: &str, grip: Option<&str>) -> Result<ArmReport, ReportFault> {
        let arm = self.inverse3.iter().find(|arm| arm.device_id == device);
        let arm = arm.ok_or(ReportFault::DeviceMissing)?;
        let position = arm.state.cursor_position.and_then(|one| one.within(REACH_MAX_M));
        let velocity = arm.state.cursor_velocity.and_then(|one| one.within(SPEED_MAX_M_PER_S));
        let (mut quaternion, mut is_held) = ([1.0, 0.0, 0.0, 0.0], None);
        if let Some(grip) = grip {
            let grip = self.grips().find(|one| one.device_id == grip);
            let grip = grip.ok_or(ReportFault::GripMissing)?;
            let turn = grip.state.orientation.and_then(Quaternion::unit);
            quaternion = turn.ok_or(ReportFault::Orientation)?;
            is_held = Some(grip.is_held());
        }
        Ok(ArmReport {
            position_m: position.ok_or(ReportFault::Position)?,
            velocity_m_per_s: velocity.ok_or(ReportFault::Velocity)?,
            quaternion,
            status: arm.status,
            is_held,
        })
    }
}

/// Writes the command for a force in N. The first message of a session also names it and requests places around the middle of
/// the arm's reach (preset `arm_front_centered`).
pub fn write_force(text: &mut String, device: &str, force: [f64; 3], is_first: bool) {
    text.clear();
    let [x, y, z] = force.map(|part| if part.is_finite() { part } else { 0.0 });
    let session = if is_first {
        r#""session":{"configure":{"profile":{"name":"palpate:scene","required_version":">=3.5"}}},"#
    } else {
        ""
    };
    let configure =
        if is_first { r#""configure":{"preset":{"preset":"arm_front_centered"}},"# } else { "" };
    // A name is checked when a device is chosen; writing to a string cannot fail. `?` keeps the point in 1.0.
    let _ = write!(
        text,
        r#"{{{session}"inverse3":[{{"device_id":"{device}",{configure}"commands":{{"set_cursor_force":{{"vector":{{"x":{x:?},"y":{y:?},"z":{z:?}}}}}}}}}]}}"#
    );
}

/// Whether a name can stand in a message as it is.
#[must_use]
pub fn is_plain_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_:.".contains(c))
}
