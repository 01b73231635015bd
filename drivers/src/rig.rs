//! The trait every rig implements, simulated or real: commands in, events out.

use crate::device::OpenError;
use crate::rig_file::RigFileError;
use crate::wire::{HaltHandle, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{
    Ack, Fault, HandAction, RawBytes, Reading, RigCommand, RigDescription, SensorReading,
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

#[derive(Debug, Error)]
pub enum RigError {
    #[error(
        "no rig is called '{name}'; use 'sim', 'sim:NAME' for a shared simulated rig, or a rig file, NAME.toml"
    )]
    Unknown {
        name: String,
    },
    #[error("the rig file {file} cannot be read ({detail}); check its path")]
    File {
        file: String,
        detail: String,
    },
    #[error(transparent)]
    RigFile(#[from] RigFileError),
    #[error("this rig cannot be connected again; choose it anew")]
    NotAgain,
    #[error("rig {file}: {error}")]
    Device {
        file: String,
        error: OpenError,
    },
}

/// A connected rig.
///
/// Time is the caller's: `next_event` never returns an event later than `until`, and a command
/// takes effect at the time of the newest event returned. A rig on real wires blocks in
/// `next_event` until something arrives or `until` has come; the simulated rig computes.
pub trait Rig: Send {
    /// What the rig is, as read from it when it was connected.
    fn description(&self) -> &RigDescription;

    /// Hands one command to the rig. Refusals arrive as [`Fault::CommandRefused`].
    fn send(&mut self, command: RigCommand);

    /// The next event at or before `until`, if there is one.
    fn next_event(&mut self, until: Nanos) -> Option<RigEvent>;

    /// Connects anew after the link was lost or the controller was reset: the same devices at the same place, checked and
    /// set up as at first, the axis stopped. Nothing moves; where the axis is has to be found again. It may wait for
    /// seconds. A rig whose link is whole is connected anew too. Who has asked the operator calls it.
    fn reconnect(&mut self) -> Result<(), RigError> {
        Err(RigError::NotAgain)
    }

    /// The link as it was measured when it was opened, in words for the operator: latency, jitter, and how samples are
    /// taken over it. It differs a little each time; what is the same stands in the identity.
    fn link(&self) -> Option<&str> {
        None
    }

    /// Whether time is simulated, so that the caller may run it at any pace.
    fn is_virtual(&self) -> bool;

    /// A person has done something at the rig, as an instruction asked. On a rig on wires it is done by
    /// then and there is nothing to do; a simulated rig does it now.
    fn by_hand(&mut self, _action: HandAction) {}

    /// The bytes exchanged with devices since this was last asked, in order, at the caller's time. A rig without
    /// wires has none. Must not wait.
    fn take_raw(&mut self) -> Vec<RawBytes> {
        Vec::new()
    }

    /// What its sensors beside load cell and axis say that is new since this was last asked, in order. Every one is told
    /// again from time to time. A rig without any has nothing to say. Must not wait.
    fn take_sensors(&mut self) -> Vec<SensorReading> {
        Vec::new()
    }

    /// Newtons of a volt of its signal, where the load cell itself is calibrated as a force gauge is.
    fn newtons_per_volt(&self) -> Option<f64> {
        None
    }

    /// What stops its axis at once when whoever holds the rig cannot any more. A rig without wires moves only while it
    /// is asked, and has none.
    fn halt_handle(&self) -> Option<HaltHandle> {
        None
    }

    /// How each link has behaved since it was opened, by the name of the device behind it. A rig without wires has none.
    fn links(&self) -> Vec<(String, LinkStats)> {
        Vec::new()
    }
}
