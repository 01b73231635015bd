//! One client: its input line, its download, and the bytes for it.

use super::input::InputLine;
use palpate_model::Nanos;
use std::collections::VecDeque;

/// Bytes that wait for the client to read them; the longest upload has about 200 kB.
const OUT_MAX: usize = 1 << 20;
/// Bytes that wait for a controller that is busy.
const WAITING_MAX: usize = 1024;

#[derive(Clone, Debug, Default)]
pub enum ClientMode {
    #[default]
    Commands,
    /// Lines of a program, after `DL`.
    Program {
        /// Lines taken so far.
        lines: Vec<String>,
        /// The line under way.
        line: Vec<u8>,
    },
    /// Values of an array, after `QD`.
    Values {
        name: String,
        /// The next element.
        next: usize,
        /// The element behind the last.
        end: usize,
        /// The value under way.
        value: Vec<u8>,
        is_wrong: bool,
    },
}

#[derive(Clone, Debug, Default)]
pub struct GalilClient {
    pub is_open: bool,
    pub input: InputLine,
    pub mode: ClientMode,
    /// `EO 1`: characters received are sent back.
    pub has_echo: bool,
    /// The controller has closed the connection.
    pub is_hung_up: bool,
    /// A command that takes long is under way until then.
    pub busy_until: Option<Nanos>,
    /// The answer to that command.
    held: Vec<u8>,
    waiting: VecDeque<u8>,
    out: Vec<u8>,
}

impl GalilClient {
    pub fn connected(has_echo: bool) -> Self {
        Self { is_open: true, has_echo, ..Self::default() }
    }

    /// The controller has just closed the connection.
    pub fn dropped() -> Self {
        Self { is_hung_up: true, ..Self::default() }
    }

    /// Queues bytes to be sent; a client that does not read loses what is too much.
    pub fn send(&mut self, bytes: &[u8]) {
        if self.out.len() + bytes.len() <= OUT_MAX {
            self.out.extend_from_slice(bytes);
        }
    }

    /// Queues an answer, which comes when the command that takes long is over.
    pub fn answer(&mut self, bytes: &[u8]) {
        if self.is_busy() {
            self.held.extend_from_slice(bytes);
        } else {
            self.send(bytes);
        }
    }

    pub fn take_out(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }

    pub fn is_busy(&self) -> bool {
        self.busy_until.is_some()
    }

    /// Queues a byte for later, as far as the input buffer has room.
    pub fn wait(&mut self, byte: u8) {
        if self.waiting.len() < WAITING_MAX {
            self.waiting.push_back(byte);
        }
    }

    /// The next byte that waits, once nothing is under way.
    pub fn take_waiting(&mut self, now: Nanos) -> Option<u8> {
        if self.busy_until.is_some_and(|until| now < until) {
            return None;
        }
        self.busy_until = None;
        let held = std::mem::take(&mut self.held);
        self.send(&held);
        self.waiting.pop_front()
    }
}
