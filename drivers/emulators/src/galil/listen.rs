//! What becomes of a byte: echo, statement, line of a download; and what is answered.

use super::client::Mode;
use super::input::Statement;
use super::{Answer, GalilEmulator, Origin};
use palpate_drivers::galil::ErrorCode;

impl GalilEmulator {
    /// Takes one byte of a client, or keeps it while the controller is busy with that client.
    pub(super) fn feed(&mut self, channel: usize, byte: u8) {
        if self.boots_until.is_some() || !self.clients[channel].is_open {
            return;
        }
        if self.clients[channel].is_busy() {
            self.clients[channel].wait(byte);
        } else {
            self.take(channel, byte);
        }
    }

    /// Bytes that waited, and lines that paused, as time passes.
    pub(super) fn feed_waiting(&mut self) {
        for channel in 0..self.clients.len() {
            let now = self.now;
            while let Some(byte) = self.clients[channel].take_waiting(now) {
                self.take(channel, byte);
            }
            self.clients[channel].input.pause();
        }
    }

    fn take(&mut self, channel: usize, byte: u8) {
        let client = &mut self.clients[channel];
        if client.has_echo {
            client.send(&[byte]);
        }
        match client.mode {
            Mode::Program { .. } => self.take_program(channel, byte),
            Mode::Values { .. } => self.take_value(channel, byte),
            Mode::Commands => {
                if let Some(statement) = client.input.take(byte) {
                    self.answer(channel, &statement);
                }
            }
        }
    }

    fn answer(&mut self, channel: usize, statement: &Statement) {
        let answer = match statement {
            Statement::TooLong => Err(ErrorCode::BUFFER_FULL),
            Statement::Whole(text) if text.is_empty() => Ok(Answer::Done),
            Statement::Whole(text) => self.execute(Origin::Client(channel), text),
        };
        let bytes = match answer {
            Ok(Answer::Done) => b":".to_vec(),
            Ok(Answer::Text(text)) => format!("{text}\r\n:").into_bytes(),
            Ok(Answer::Open(text)) => format!("{text}:").into_bytes(),
            Ok(Answer::Bytes(mut bytes)) => {
                bytes.push(b':');
                bytes
            }
            Ok(Answer::Silent) => Vec::new(),
            Err(code) => {
                self.error = code;
                b"?".to_vec()
            }
        };
        self.clients[channel].answer(&bytes);
    }

    /// Text of a program, of which nobody asked; lines end with CR LF.
    pub(super) fn say(&mut self, text: &str) {
        let mark = if self.is_marked { 0x80 } else { 0 };
        let bytes: Vec<u8> = text.bytes().map(|byte| byte | mark).collect();
        if let Some(client) = self
            .unsolicited_to
            .and_then(|channel| self.clients.get_mut(channel))
            .filter(|client| client.is_open)
        {
            client.send(&bytes);
        }
    }
}
