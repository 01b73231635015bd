//! Lines of text out of bytes that come in any pieces.

/// Longest line of any device read with this: the settings of a force gauge are half as long.
const LINE_MAX: usize = 160;

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReceivedLine {
    /// A line without its end; never empty.
    Line(String),
    /// A line too long, or with bytes that no text has.
    Garbled,
}

/// Cuts bytes into lines: CR, LF or both end one, empty ones are passed over.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    line: Vec<u8>,
    is_spoiled: bool,
}

impl Lines {
    pub fn take(&mut self, byte: u8) -> Option<ReceivedLine> {
        match byte {
            b'\r' | b'\n' => self.end(),
            b' '..=b'~' if self.line.len() < LINE_MAX => {
                self.line.push(byte);
                None
            }
            _ => {
                self.is_spoiled = true;
                self.line.clear();
                None
            }
        }
    }

    pub fn pending(&self) -> usize {
        self.line.len()
    }

    pub fn clear(&mut self) {
        *self = Self::default();
    }

    fn end(&mut self) -> Option<ReceivedLine> {
        let line = std::mem::take(&mut self.line);
        if std::mem::take(&mut self.is_spoiled) {
            return Some(ReceivedLine::Garbled);
        }
        // Only printable ASCII was taken in.
        (!line.is_empty()).then(|| ReceivedLine::Line(String::from_utf8_lossy(&line).into_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<ReceivedLine> {
        let mut lines = Lines::default();
        bytes.iter().filter_map(|byte| lines.take(*byte)).collect()
    }

    #[test]
    fn cr_or_lf_or_both_end_a_line() {
        let two = [ReceivedLine::Line("4.285 N".into()), ReceivedLine::Line("*10".into())];
        for text in ["4.285 N\r\n*10\r\n", "4.285 N\r*10\r", "\n4.285 N\n\n*10\n"] {
            assert_eq!(all(text.as_bytes()), two, "{text:?}");
        }
    }

    #[test]
    fn a_spoiled_line_is_one_garbled_line_and_the_next_is_whole() {
        let long = [vec![b'x'; 3 * LINE_MAX], b"\r\nok\r\n".to_vec()].concat();
        assert_eq!(all(&long), [ReceivedLine::Garbled, ReceivedLine::Line("ok".into())]);
        assert_eq!(
            all(b"1\xff2\r\n3\r\n"),
            [ReceivedLine::Garbled, ReceivedLine::Line("3".into())]
        );
        assert!(all(b"half").is_empty());
    }
}
