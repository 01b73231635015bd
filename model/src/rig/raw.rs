//! Bytes as a device and the computer exchanged them.

use crate::Nanos;
use std::sync::Arc;

/// One piece of what went over a wire, before any parser saw it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawBytes {
    /// When the computer read or wrote it.
    pub at: Nanos,
    /// Name of the device, such as `controller`.
    pub device: Arc<str>,
    /// Whether the computer sent it; received otherwise.
    pub is_sent: bool,
    /// The bytes. A piece may hold part of a message, or several.
    pub bytes: Vec<u8>,
}
