//! From bytes to statements: one input line per client, as the controller reads it.
//!
//! Carriage return and `;` execute, line feed is white space, a line has 80 characters. Every terminator is
//! answered once, also the one of an empty statement: a client has to send its carriage return
//! "without a preceding ;" (github.com/baileyji/M2FS-Control, `m2fscontrol/galil.py`, a DMC-4183).

pub use palpate_drivers::galil::protocol::LINE_MAX;

/// What a byte completed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Statement {
    /// A statement, trimmed, and whether a carriage return ended it.
    Whole(String),
    /// One that does not fit into the line; it is lost.
    TooLong,
}

/// The line that a client is writing.
#[derive(Clone, Debug, Default)]
pub struct InputLine {
    statement: Vec<u8>,
    /// Characters since the line began.
    length: usize,
    is_quoted: bool,
    is_too_long: bool,
}

impl InputLine {
    /// Takes a byte; returns what it completed.
    pub fn take(&mut self, byte: u8) -> Option<Statement> {
        match byte {
            b'\n' | 0 => None,
            b'\r' => {
                let statement = self.complete();
                *self = Self::default();
                Some(statement)
            }
            // Within a line that is too long nothing ends but the line.
            b';' if !self.is_quoted && !self.is_too_long => {
                self.length += 1;
                Some(self.complete())
            }
            _ => {
                self.length += 1;
                if self.length > LINE_MAX {
                    self.is_too_long = true;
                } else {
                    self.is_quoted ^= byte == b'"';
                    self.statement.push(byte);
                }
                None
            }
        }
    }

    fn complete(&mut self) -> Statement {
        self.is_quoted = false;
        let bytes = std::mem::take(&mut self.statement);
        if self.is_too_long {
            return Statement::TooLong;
        }
        // Characters beyond ASCII stay wrong ones, each one character.
        let text: String = bytes.into_iter().map(char::from).collect();
        Statement::Whole(text.trim().to_owned())
    }

    /// Whether nothing has been written since the last terminator.
    pub fn is_empty(&self) -> bool {
        self.statement.is_empty() && !self.is_too_long
    }

    /// A pause after a `;`: clients that never send a carriage return (ESRF BLISS) begin a new line so.
    pub fn pause(&mut self) {
        if self.is_empty() {
            self.length = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<Statement> {
        let mut input = InputLine::default();
        bytes.iter().filter_map(|byte| input.take(*byte)).collect()
    }

    fn whole(texts: &[&str]) -> Vec<Statement> {
        texts.iter().map(|text| Statement::Whole((*text).to_owned())).collect()
    }

    #[test]
    fn terminators_end_statements() {
        assert_eq!(all(b"TP\r"), whole(&["TP"]));
        assert_eq!(all(b"TP\r\n"), whole(&["TP"]));
        assert_eq!(all(b"TP;"), whole(&["TP"]));
        assert_eq!(all(b"TP;\r"), whole(&["TP", ""]));
        assert_eq!(all(b"a=1; b=2 ;MG a\r"), whole(&["a=1", "b=2", "MG a"]));
        assert_eq!(all(b"MG \"a;b\";TP\r"), whole(&["MG \"a;b\"", "TP"]));
        assert_eq!(all(b"MG \"a\rTP\r"), whole(&["MG \"a", "TP"]));
        assert_eq!(all(b"\n\n"), []);
    }

    #[test]
    fn a_line_has_eighty_characters() {
        let fits = "a".repeat(78);
        assert_eq!(all(format!("{fits};b\r").as_bytes()), whole(&[&fits, "b"]));
        assert_eq!(
            all(format!("{fits};bc;d\rTP\r").as_bytes()),
            [whole(&[&fits]), vec![Statement::TooLong], whole(&["TP"])].concat()
        );
        let mut input = InputLine::default();
        for _ in 0..100 {
            for byte in b"MG _TPA" {
                assert_eq!(input.take(*byte), None);
            }
            assert_eq!(input.take(b';'), whole(&["MG _TPA"]).pop());
            input.pause();
        }
    }
}
