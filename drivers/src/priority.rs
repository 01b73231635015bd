//! The priority of a thread that must be in time: the best that the system grants.

use std::fmt;
use thread_priority::ThreadPriority;
#[cfg(unix)]
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// Above ordinary real-time work such as sound (10 to 20 on common systems), below the kernel's own threads (50).
#[cfg(unix)]
const WANTED: u8 = 30;

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GrantedPriority {
    /// Real time, first in first out, with this priority: nothing ordinary comes between.
    RealTime(u8),
    /// The highest that Windows has for an ordinary program.
    Highest,
    Ordinary(String),
}

impl fmt::Display for GrantedPriority {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Highest => f.write_str("the highest of an ordinary program"),
            Self::RealTime(priority) => write!(f, "real time, priority {priority}"),
            Self::Ordinary(reason) => write!(
                f,
                "ordinary, because the system does not grant real-time priority ({reason}); set an 'rtprio' limit for your account in /etc/security/limits.conf"
            ),
        }
    }
}

/// Asks for real time for the thread that calls.
#[cfg(not(unix))]
#[must_use]
pub fn request_real_time() -> GrantedPriority {
    match ThreadPriority::Max.set_for_current() {
        Ok(()) => GrantedPriority::Highest,
        Err(err) => GrantedPriority::Ordinary(err.to_string()),
    }
}

/// Asks for real time for the thread that calls.
#[cfg(unix)]
#[must_use]
pub fn request_real_time() -> GrantedPriority {
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let granted = ThreadPriorityValue::try_from(WANTED).and_then(|value| {
        let priority = ThreadPriority::Crossplatform(value);
        set_thread_priority_and_policy(thread_native_id(), priority, policy)
            .map_err(|err| err.to_string())
    });
    match granted {
        Ok(()) => GrantedPriority::RealTime(WANTED),
        Err(reason) => GrantedPriority::Ordinary(reason),
    }
}
