//! The vocabulary of a rig that every crate shares: description, commands, readings.

pub mod command;
pub mod compliance;
pub mod compliance_document;
pub mod course;
pub mod description;
pub mod event;
pub mod hand;
pub mod limits;
pub mod oscillation;
pub mod path;
pub mod phase;
pub mod profile;
pub mod raw;
pub mod reading;
pub mod sensor;
pub mod signal;
pub mod thickness;

pub use command::{MoveTo, Oscillation, RigCommand};
pub use compliance::{Compliance, ComplianceError, CorrectedDepth, StiffSample, fit_compliance};
pub use compliance_document::{COMPLIANCE_FORMAT, PressCompliance, RigCompliance};
pub use course::Course;
pub use description::{AdcDescription, RigDescription};
pub use event::{Ack, Fault};
pub use hand::HandAction;
pub use limits::Limits;
pub use oscillation::SinePath;
pub use path::{PathError, PathTracker};
pub use phase::Phase;
pub use profile::MotionProfile;
pub use raw::RawBytes;
pub use reading::{AxisStatus, Reading, SampleAge};
pub use sensor::{
    CHANNELS_MAX, DIGITAL_INPUTS_MAX, RigSensors, SensorChannel, SensorReading, SensorValues,
};
pub use signal::SignalFacts;
pub use thickness::{Thickness, ThicknessError, TouchPosition, thickness};
