//! One client: the line it writes, what it downloads, and what waits to be sent to it.

use super::input::InputLine;
use palpate_model::Nanos;
use std::collections::VecDeque;

/// Bytes that wait for the client to read them; the longest upload has about 200 kB.
const OUT_MAX: usize = 1 << 20;
/// Bytes that wait for a controller that is busy.
const WAITING_MAX: usize = 1024;

/// What a client's bytes are.
#[derive(Clone, Debug, Default)]
pub enum ClientMode {
    /// Statements.
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
        /// The array.
        name: String,
        /// The next element.
        next: usize,
        /// The element behind the last.
        end: usize,
        /// The value under way.
        value: Vec<u8>,
        /// Something was wrong.
        is_wrong: bool,
    },
}

/// One client.
#[derive(Clone, Debug, Default)]
pub struct GalilClient {
    /// Whether somebody is connected.
    pub is_open: bool,
    /// The line being written.
    pub input: InputLine,
    /// What its bytes are.
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
    /// Somebody who has just connected.
    pub fn connected(has_echo: bool) -> Self {
        Self { is_open: true, has_echo, ..Self::default() }
    }

    /// Somebody whose connection the controller has just closed.
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

    /// What has to be sent.
    pub fn take_out(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }

    /// Whether bytes have to wait.
    pub fn is_busy(&self) -> bool {
        self.busy_until.is_some()
    }

    /// Keeps a byte for later; an input buffer has an end.
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
