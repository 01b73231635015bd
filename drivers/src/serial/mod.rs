//! Serial ports: which there are.

pub mod discovery;

pub use discovery::{PortInfo, SerialError, list_ports};
