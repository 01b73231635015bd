//! Bytes to a device and back: links, and the thread that owns one.
//!
//! Nothing here knows what the bytes mean: that is a [`Dialogue`], a state machine with the time handed in, so that
//! every protocol can be tested without a port, a thread or a clock. [`LinkThread`] runs one on a link.

mod address;
mod dialogue;
mod halt;
mod link;
mod link_thread;
#[cfg(unix)]
mod program;
mod setup_console;
mod waiting;

pub use address::{DeviceAddress, WireError};
pub(crate) use dialogue::{ATTENDED_MAX, ORDERS_MAX, OVERTAKEN, TOO_MANY_COMMANDS};
pub use dialogue::{AnswerQueue, Dialogue, LinkStats};
pub use halt::{HaltHandle, run_after_link_stop};
pub use link::{Link, MemoryLink, SerialLink, SocketLink, TcpLink, memory_link_pair};
pub use link_thread::LinkThread;
#[cfg(unix)]
pub use program::ProgramLink;
pub use setup_console::SetupConsole;
pub(crate) use waiting::Waiting;

use palpate_model::Nanos;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Reads the computer's monotonic clock. Drivers are handed one and never read a clock by themselves.
pub type HostClock = Arc<dyn Fn() -> Nanos + Send + Sync>;

/// Locks what two threads share. After a panic of the other thread, which is reported as a lost link, the data can
/// still be used.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
