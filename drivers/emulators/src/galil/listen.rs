//! Handles each byte of a client: echo, statement or line of a download; and sends the answer.

use super::client::ClientMode;
use super::input::Statement;
use super::{Answer, GalilEmulator, Origin};
use palpate_drivers::galil::ErrorCode;

impl GalilEmulator {
    /// Takes one byte of a client, or queues it while the controller is busy with that client.
    pub(super) fn receive_byte(&mut self, channel: usize, byte: u8) {
        if self.boots_until.is_some() || !self.clients[channel].is_open {
            return;
        }
        if self.clients[channel].is_busy() {
            self.clients[channel].wait(byte);
        } else {
            self.take(channel, byte);
        }
    }

    /// Takes queued bytes, and notes pauses in lines.
    pub(super) fn take_waiting_bytes(&mut self) {
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
            ClientMode::Program { .. } => self.take_program_byte(channel, byte),
            ClientMode::Values { .. } => self.take_value_byte(channel, byte),
            ClientMode::Commands => {
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

    /// Sends unsolicited text of a program; lines end with CR LF.
    pub(super) fn send_unsolicited(&mut self, text: &str) {
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
