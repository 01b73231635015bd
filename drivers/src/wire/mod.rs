//! Bytes to a device and back: links, and the thread that owns one.
//!
//! Nothing here knows what the bytes mean: that is a [`Dialogue`], a state machine with the time handed in, so that
//! every protocol can be tested without a port, a thread or a clock. [`LinkThread`] runs one on a link.

mod address;
mod answer_queue;
mod caller_time;
mod dialogue;
mod halt;
mod link;
mod link_thread;
mod memory;
mod tapped;

pub use address::{Place, WireError};
pub use answer_queue::AnswerQueue;
pub use caller_time::CallerTime;
pub use dialogue::{Dialogue, LinkStats};
pub use halt::{HaltHandle, after_farewell};
pub use link::{Link, SerialLink, TcpLink};
pub use link_thread::{LinkThread, LinkThreadSettings};
pub use memory::{MemoryLink, pair};
pub use tapped::TappedLink;

use palpate_model::Nanos;
use std::sync::Arc;

/// Reads the computer's monotonic clock. Drivers are handed one and never read a clock by themselves.
pub type HostClock = Arc<dyn Fn() -> Nanos + Send + Sync>;
