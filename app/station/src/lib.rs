//! The station: a rig's state, live values and a stop over HTTP and WebSocket, and runs of a queue that a person at the
//! rig has armed.
//!
//! It reads the runner's snapshots and sends requests; it holds no device and decides nothing about motion. What an
//! attacker on the network can and cannot do is in `docs/station-threats.md`.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod access;
mod library_facts;
mod limits;
mod live;
mod problem;
pub mod remote;
mod routes;
mod shared;
mod station;
pub mod tokens;
pub mod view;

pub use station::{BoundStation, Station, StationError};
