//! The trait every rig implements, simulated or real: commands in, events out.

use crate::device::OpenError;
use crate::rig_file::RigFileError;
use crate::wire::{HaltHandle, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{
    Ack, AxisStatus, Fault, HandAction, RawBytes, Reading, RigCommand, RigDescription,
    SensorReading,
};
use thiserror::Error;

/// Something a rig reported, with the time it reached the host.
#[derive(Clone, Debug, PartialEq)]
pub struct RigEvent {
    /// Arrival on the host's clock.
    pub at: Nanos,
    pub body: RigEventBody,
}

impl RigEvent {
    #[must_use]
    pub const fn new(at: Nanos, body: RigEventBody) -> Self {
        Self { at, body }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum RigEventBody {
    Reading(Reading),
    Ack(Ack),
    Fault(Fault),
}

impl RigEventBody {
    /// A command is refused, or something else has failed.
    pub fn refusal(detail: impl Into<String>) -> Self {
        Self::Fault(Fault::CommandRefused { detail: detail.into() })
    }
}

/// The status whose bits are set.
pub(crate) fn axis_status<const N: usize>(bits: [(bool, AxisStatus); N]) -> AxisStatus {
    let set = bits.into_iter().filter(|(is_set, _)| *is_set);
    set.fold(AxisStatus(0), |all, (_, bit)| all | bit)
}

#[derive(Debug, Error)]
pub enum RigError {
    #[error(
        "no rig is called '{name}'; use 'sim', 'sim:NAME' for a shared simulated rig, or the path of a rig file, NAME.toml"
    )]
    Unknown { name: String },
    #[error("the rig file {file} cannot be read ({detail}); check its path")]
    File { file: String, detail: String },
    #[error(transparent)]
    RigFile(#[from] RigFileError),
    #[error("this rig cannot be connected again; close it and open it again")]
    CannotReconnect,
    #[error("rig {file}: {error}")]
    Device { file: String, error: OpenError },
}

/// A connected rig.
///
/// Time is the caller's: `next_event` never returns an event later than `until`, and a command
/// takes effect at the time of the newest event returned. A rig on real wires blocks in
/// `next_event` until something arrives or `until` has come; the simulated rig computes.
pub trait Rig: Send {
    /// The rig's description, read when it was connected.
    fn description(&self) -> &RigDescription;

    /// Hands one command to the rig. Refusals arrive as [`Fault::CommandRefused`].
    fn send(&mut self, command: RigCommand);

    /// The next event at or before `until`, if there is one.
    fn next_event(&mut self, until: Nanos) -> Option<RigEvent>;

    /// Connects again after the link was lost or the controller was reset, also where the link still works: the same
    /// devices at the same addresses, checked and set up as at first, the axis stopped. Nothing moves; the axis must be
    /// homed again. It may wait for seconds. Callers have asked the operator.
    fn reconnect(&mut self) -> Result<(), RigError> {
        Err(RigError::CannotReconnect)
    }

    /// The link as it was measured when it was opened, in words for the operator: latency, jitter, and how samples are
    /// taken over it. It differs a little each time; what stays the same is in the identity.
    fn link(&self) -> Option<&str> {
        None
    }

    /// Whether time is simulated, so that the caller may run it at any pace.
    fn is_virtual(&self) -> bool;

    /// A person has done something at the rig, as an instruction asked. A real rig has nothing to do then; a simulated
    /// rig does it now.
    fn apply_hand_action(&mut self, _action: HandAction) {}

    /// The bytes exchanged with devices since the last call, in order, at the caller's time. A rig without
    /// wires has none. Must not wait.
    fn take_raw(&mut self) -> Vec<RawBytes> {
        Vec::new()
    }

    /// New readings of sensors other than load cell and axis since the last call, in order. Each is repeated from
    /// time to time. Must not wait.
    fn take_sensors(&mut self) -> Vec<SensorReading> {
        Vec::new()
    }

    /// Newtons per volt of its signal, where the load cell itself is calibrated as a force gauge is.
    fn newtons_per_volt(&self) -> Option<f64> {
        None
    }

    /// Stops the axis at once when the owner of the rig no longer can. A simulated rig moves only while it is asked for
    /// events, and has none.
    fn halt_handle(&self) -> Option<HaltHandle> {
        None
    }

    /// Statistics of each link since it was opened, by the name of its device. A rig without wires has none.
    fn links(&self) -> Vec<(String, LinkStats)> {
        Vec::new()
    }
}
