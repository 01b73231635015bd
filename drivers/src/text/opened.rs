//! A load cell that was opened.

use crate::cell::{CellDescription, CellDialogue};
use palpate_model::rig::RawBytes;

/// What opening a load cell gives: who it is, how to go on with it, and what was said so far.
pub struct OpenedCell {
    pub description: CellDescription,
    pub dialogue: Box<dyn CellDialogue>,
    /// What was exchanged, by the host's clock.
    pub raw: Vec<RawBytes>,
    /// To be written when the line is closed, so that the device falls silent; may be empty.
    pub farewell: Vec<u8>,
}
