//! Bytes of a Galil DMC controller: replies counted by their prompts, unsolicited text, numbers, lines of
//! commands.
//!
//! Every command of a line is answered by a prompt of its own, `:` when it was accepted and `?` when it was not, with
//! its text and a line end before (DMC-1700/1800 user manual, page 79; `GalilConnector.cpp` of EPICS counts them so).

use super::error::GalilError;

/// Characters of a line, all commands that `;` joins and the carriage return counted (gclib.h, `G_LINE_BUFFER`).
pub const LINE_MAX: usize = 80;
/// Longest text of one reply. A whole upload is asked for in pieces shorter than this.
pub const REPLY_MAX: usize = 64 * 1024;
/// Longest unsolicited line; a program's line has 80 characters.
const UNSOLICITED_MAX: usize = 1024;
/// Ends an upload (DMC-1700/1800 user manual, `QU`).
const UPLOAD_END: u8 = 0x1a;

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GalilMessage {
    Reply(GalilReply),
    /// A line that a program of the controller wrote, marked by its top bits (`CW 1`).
    Unsolicited(String),
    /// More than [`REPLY_MAX`] bytes without a prompt: this is no controller, or its baud rate is another.
    Flood,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GalilReply {
    /// Whether it ended with `:`.
    pub is_accepted: bool,
    /// The text before the prompt, without line ends and end marks.
    pub bytes: Vec<u8>,
}

impl GalilReply {
    /// Its text; what is not ASCII stays visible as question marks in diamonds.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.bytes).trim().to_owned()
    }

    /// Whether it begins with a number as `{F2.4}` writes it, with one or two digits, a point and four decimals: one
    /// with a digit lost or too many is none.
    pub fn begins_with_volts(&self) -> bool {
        let text = self.bytes.trim_ascii_start();
        let unsigned = text.strip_prefix(b"-").unwrap_or(text);
        let digits = |bytes: &[u8]| bytes.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let whole = digits(unsigned);
        let rest = unsigned.get(whole..).unwrap_or_default();
        (1..=2).contains(&whole) && rest.strip_prefix(b".").is_some_and(|rest| digits(rest) == 4)
    }

    /// The numbers of its text; `None` when anything else stands there.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        std::str::from_utf8(&self.bytes).ok().and_then(numbers)
    }
}

/// Reads replies out of bytes that come in any pieces.
#[derive(Clone, Debug, Default)]
pub struct GalilParser {
    reply: Vec<u8>,
    unsolicited: Vec<u8>,
}

impl GalilParser {
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    pub fn take(&mut self, byte: u8) -> Option<GalilMessage> {
        if byte & 0x80 != 0 {
            return self.take_unsolicited(byte & 0x7f);
        }
        match byte {
            b':' | b'?' => {
                let mut bytes = std::mem::take(&mut self.reply);
                while matches!(bytes.last(), Some(b'\r' | b'\n' | &UPLOAD_END)) {
                    bytes.pop();
                }
                Some(GalilMessage::Reply(GalilReply { is_accepted: byte == b':', bytes }))
            }
            _ if self.reply.len() >= REPLY_MAX => {
                self.reply.clear();
                Some(GalilMessage::Flood)
            }
            _ => {
                self.reply.push(byte);
                None
            }
        }
    }

    fn take_unsolicited(&mut self, byte: u8) -> Option<GalilMessage> {
        match byte {
            b'\r' => None,
            b'\n' => {
                let line = std::mem::take(&mut self.unsolicited);
                Some(GalilMessage::Unsolicited(String::from_utf8_lossy(&line).into_owned()))
            }
            _ => {
                if self.unsolicited.len() < UNSOLICITED_MAX {
                    self.unsolicited.push(byte);
                }
                None
            }
        }
    }
}

/// Numbers as any firmware writes them: blanks, commas or only a sign between them, leading zeros or not, decimals or
/// not; `None` when anything else stands there.
#[must_use]
pub fn numbers(text: &str) -> Option<Vec<f64>> {
    let mut all = Vec::new();
    for part in text.split(|c: char| c.is_ascii_whitespace() || c == ',') {
        let mut rest = part;
        while !rest.is_empty() {
            // `MG` puts nothing but the sign's place between numbers, so a sign begins the next.
            let end = rest.get(1..)?.find(['-', '+']).map_or(rest.len(), |at| at + 1);
            let number: f64 = rest.get(..end)?.parse().ok()?;
            // "inf" and "nan" are no numbers of a controller.
            all.push(Some(number).filter(|number| number.is_finite())?);
            rest = &rest[end..];
        }
    }
    (!all.is_empty()).then_some(all)
}

/// Joins commands with `;` to as few lines as hold them, each ended by a carriage return. A command that fills a line
/// alone stays whole; the controller will refuse it.
#[must_use]
pub fn pack_lines(commands: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for command in commands {
        match lines.last_mut() {
            Some(line) if line.len() + 1 + command.len() < LINE_MAX => {
                line.push(';');
                line.push_str(command);
            }
            _ => lines.push(command.clone()),
        }
    }
    for line in &mut lines {
        line.push('\r');
    }
    lines
}

/// The reply to `TC1`: number and text.
#[must_use]
pub fn parse_error(reply: &GalilReply) -> Option<GalilError> {
    let text = reply.text();
    let digits = text.find(|c: char| !c.is_ascii_digit());
    let (number, words) = text.split_at(digits.unwrap_or(text.len()));
    Some(GalilError { code: number.parse().ok()?, words: words.trim().to_owned() })
}

#[cfg(test)]
mod tests;
