//! The service without its sockets: messages in, reports out, and the force on the hand.

use super::InverseFault;
use super::arm::{ArmSettings, EmulatedArm, MIDDLE_FROM_BASE_MM};
use super::report::{DEVICE, Facts, lying, report, version};
use palpate_haptics::SettingError;
use palpate_model::Nanos;
use serde_json::Value;
use std::collections::BTreeMap;

/// What is emulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseServiceSettings {
    pub arm: ArmSettings,
    /// Whether a grip with a button is on the arm.
    pub has_grip: bool,
    /// Longest that a command lasts without another. Haply's pages say that the device then becomes idle, but not when; 20 ms is
    /// assumed.
    pub command_life: Nanos,
    /// From a message to its report.
    pub reply_delay: Nanos,
    /// Up to so much is added to that.
    pub jitter: Nanos,
    pub seed: u64,
}

impl Default for InverseServiceSettings {
    fn default() -> Self {
        Self {
            arm: ArmSettings::default(),
            has_grip: true,
            command_life: Nanos::from_millis(20),
            reply_delay: Nanos::ZERO,
            jitter: Nanos::ZERO,
            seed: 1,
        }
    }
}

#[derive(Clone, Debug)]
struct Session {
    id: u64,
    force: [f64; 3],
    commanded_at: Nanos,
    profile: Option<String>,
}

/// The service.
#[derive(Clone, Debug)]
pub struct InverseService {
    settings: InverseServiceSettings,
    arm: EmulatedArm,
    /// By channel.
    sessions: BTreeMap<usize, Session>,
    next_session: u64,
    is_centred: bool,
    is_held: bool,
    fault: Option<InverseFault>,
    fault_at: Option<Nanos>,
    zero_since: Option<Nanos>,
    /// When the force was first zero in the fault.
    zero_in_fault: Option<Nanos>,
    messages: u64,
}

impl InverseService {
    /// With an arm at rest.
    pub fn new(settings: InverseServiceSettings) -> Result<Self, SettingError> {
        Ok(Self {
            arm: EmulatedArm::new(settings.arm)?,
            settings,
            sessions: BTreeMap::new(),
            next_session: 7,
            is_centred: false,
            is_held: true,
            fault: None,
            fault_at: None,
            zero_since: Some(Nanos::ZERO),
            zero_in_fault: None,
            messages: 0,
        })
    }

    pub fn settings(&self) -> &InverseServiceSettings {
        &self.settings
    }

    pub fn arm(&self) -> &EmulatedArm {
        &self.arm
    }

    /// Begins a fault, or ends it.
    pub fn set_fault(&mut self, now: Nanos, fault: Option<InverseFault>) {
        self.fault = fault;
        self.fault_at = fault.map(|_| now);
        self.zero_in_fault = None;
        self.note_force(now);
    }

    pub fn fault(&self) -> Option<InverseFault> {
        self.fault
    }

    /// When the fault began.
    pub fn fault_at(&self) -> Option<Nanos> {
        self.fault_at
    }

    /// Presses the button of the grip, or lets it go.
    pub fn set_held(&mut self, is_held: bool) {
        self.is_held = is_held;
    }

    /// The force on the hand in N: those of all sessions together.
    pub fn force(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for session in self.sessions.values() {
            for (sum, part) in sum.iter_mut().zip(session.force) {
                *sum += part;
            }
        }
        sum
    }

    /// Since when there is no force; `None` while there is one.
    pub fn zero_since(&self) -> Option<Nanos> {
        self.zero_since
    }

    /// When the force was first zero after the fault began; `None` while it was not.
    pub fn zero_in_fault(&self) -> Option<Nanos> {
        self.zero_in_fault
    }

    /// Messages received.
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// Name of the profile of a channel's session.
    pub fn profile(&self, channel: usize) -> Option<&str> {
        self.sessions.get(&channel)?.profile.as_deref()
    }

    /// A client has connected: the inventory.
    pub fn open(&mut self, now: Nanos, channel: usize) -> String {
        let session =
            Session { id: self.next_session, force: [0.0; 3], commanded_at: now, profile: None };
        self.next_session += 1;
        let id = session.id;
        self.sessions.insert(channel, session);
        report(&self.facts(id), true).to_string()
    }

    /// A client is gone, and its force with it: the end of a session ends its commands.
    pub fn close(&mut self, now: Nanos, channel: usize) {
        self.sessions.remove(&channel);
        self.note_force(now);
    }

    /// A message, and what is sent for it.
    pub fn receive(&mut self, now: Nanos, channel: usize, text: &str) -> Vec<String> {
        self.advance(now);
        self.messages += 1;
        let message: Value = serde_json::from_str(text).unwrap_or_default();
        let is_full = message.pointer("/session/force_render_full_state").is_some();
        if let Some(session) = self.sessions.get_mut(&channel) {
            if let Some(name) = message.pointer("/session/configure/profile/name") {
                session.profile = name.as_str().map(str::to_owned);
            }
            let arms = message["inverse3"].as_array();
            let arm = arms.and_then(|arms| arms.iter().find(|arm| arm["device_id"] == DEVICE));
            if let Some(arm) = arm {
                if arm
                    .pointer("/configure/preset/preset")
                    .is_some_and(|one| one == "arm_front_centered")
                {
                    self.is_centred = true;
                }
                if let Some(force) = force_of(arm) {
                    (session.force, session.commanded_at) = (force, now);
                }
            }
        }
        self.note_force(now);
        let id = self.sessions.get(&channel).map_or(0, |session| session.id);
        let facts = self.facts(id);
        match self.fault {
            Some(InverseFault::Stalled | InverseFault::Cut) => Vec::new(),
            Some(InverseFault::Lie(lie)) => lying(&facts, lie),
            _ => vec![report(&facts, is_full).to_string()],
        }
    }

    /// The answer to a GET, with its HTTP status.
    pub fn get(&self, path: &str) -> (u16, String) {
        let path = path.split('?').next().unwrap_or_default();
        match path {
            "/version" => {
                let number = match self.fault {
                    Some(InverseFault::Old) => "3.1.1",
                    Some(InverseFault::New) => "4.0.0",
                    _ => "3.5.0",
                };
                (200, version(number).to_string())
            }
            "/devices" => (200, report(&self.facts(0), true).to_string()),
            _ => (404, r#"{"ok":false,"error":"not found"}"#.into()),
        }
    }

    /// Moves the arm to `now`; a command that is too old ends.
    pub fn advance(&mut self, now: Nanos) {
        let life = self.settings.command_life;
        for session in self.sessions.values_mut() {
            if now.since(session.commanded_at) > life {
                session.force = [0.0; 3];
            }
        }
        self.note_force(now);
        self.arm.advance(now, self.force());
    }

    fn note_force(&mut self, now: Nanos) {
        if self.force() == [0.0; 3] {
            self.zero_since.get_or_insert(now);
            if self.fault.is_some() {
                self.zero_in_fault.get_or_insert(now);
            }
        } else {
            self.zero_since = None;
        }
    }

    fn facts(&self, session: u64) -> Facts {
        let origin = if self.is_centred { [0.0; 3] } else { MIDDLE_FROM_BASE_MM };
        let place = self.arm.place_mm();
        Facts {
            session,
            position: [0, 1, 2].map(|i| 1e-3 * (place[i] + origin[i])),
            velocity: self.arm.velocity_mm_per_s().map(|part| 1e-3 * part),
            force: self.force(),
            is_calibrated: self.fault != Some(InverseFault::Uncalibrated),
            is_powered: self.fault != Some(InverseFault::Unpowered),
            is_in_use: self.fault == Some(InverseFault::InUse),
            has_device: self.fault != Some(InverseFault::NoDevice),
            has_grip: self.settings.has_grip,
            is_held: self.is_held,
            is_centred: self.is_centred,
        }
    }
}

/// The force commanded in a message in N; parts that are missing are none.
fn force_of(arm: &Value) -> Option<[f64; 3]> {
    let vector = arm.pointer("/commands/set_cursor_force/vector")?;
    let part = |name: &str| vector[name].as_f64().unwrap_or(0.0);
    Some([part("x"), part("y"), part("z")])
}
