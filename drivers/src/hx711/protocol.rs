//! Lines of palpate's sketch for an HX711 board (`drivers/hx711/palpate_hx711/palpate_hx711.ino`).
//!
//! ```text
//! B,1204,palpate-hx711,1,80,128,bench-1*8C6B      started: micros(), name and version of the format, rate, gain, board
//! H,48320144,palpate-hx711,1,80,128,bench-1*38DD  the same, as the answer to ?
//! D,48332680,-152034*4E04                         one conversion: micros() when it was ready, 24-bit count
//! E,48832680,missing*6E28                         no conversion for half a second: the chip does not answer
//! ```
//!
//! CR LF ends every line. Behind the star stands the CRC-16 of all before it in four hexadecimal digits, so that a
//! garbled line is never a value. `micros()` has 32 bits and wraps every 71.6 minutes. The chip gives its lowest or
//! highest count when its input is beyond its range (HX711 data sheet, Avia Semiconductor, page 4).

const NAME: &str = "palpate-hx711";
const VERSION: &str = "1";
/// Lowest and highest of 24 bits: the input is beyond the range.
pub const COUNT_MIN: i32 = -(1 << 23);
/// See [`COUNT_MIN`].
pub const COUNT_MAX: i32 = (1 << 23) - 1;
/// What is reported when the board cannot read its chip.
pub(super) const NO_CHIP: &str =
    "the HX711 chip does not answer its board; check DOUT, SCK and the chip's supply";
const BOARD_MAX: usize = 16;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// Conversions a second as wired at the chip's RATE pin: 10 or 80; 0 while the chip does not answer.
    pub rate: u8,
    /// Gain of channel A: 128 or 64.
    pub gain: u8,
    /// Name of the board, as it stands in its sketch.
    pub board: String,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Message {
    Started {
        /// The board's clock in microseconds.
        micros: u32,
        header: Header,
    },
    /// The answer to `?`.
    Header {
        /// The board's clock in microseconds.
        micros: u32,
        header: Header,
    },
    Value {
        /// The board's clock when it was ready, in microseconds.
        micros: u32,
        /// The chip's count.
        count: i32,
    },
    Missing {
        /// The board's clock in microseconds.
        micros: u32,
    },
}

/// CRC-16/CCITT-FALSE: polynomial 0x1021, first value 0xFFFF, neither reflected nor inverted.
#[must_use]
pub fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xffff, |sum, byte| {
        (0..8).fold(sum ^ u16::from(*byte) << 8, |sum, _| {
            if sum & 0x8000 == 0 { sum << 1 } else { sum << 1 ^ 0x1021 }
        })
    })
}

/// Reads a line without its end; `None` when it is garbled or of another device.
#[must_use]
pub fn parse(line: &str) -> Option<Message> {
    let (body, sum) = line.rsplit_once('*')?;
    let is_hex = sum.len() == 4 && sum.bytes().all(|b| b.is_ascii_hexdigit());
    if !is_hex || u16::from_str_radix(sum, 16).ok()? != crc(body.as_bytes()) {
        return None;
    }
    let mut fields = body.split(',');
    let kind = fields.next()?;
    let micros = number(fields.next()?)?;
    let message = match kind {
        "B" | "H" => {
            if fields.next()? != NAME || fields.next()? != VERSION {
                return None;
            }
            let header = Header {
                rate: number(fields.next()?)?,
                gain: number(fields.next()?)?,
                board: fields.next().filter(|name| is_board(name))?.to_owned(),
            };
            if !matches!(header.rate, 0 | 10 | 80) || !matches!(header.gain, 64 | 128) {
                return None;
            }
            if kind == "B" {
                Message::Started { micros, header }
            } else {
                Message::Header { micros, header }
            }
        }
        "D" => {
            let count = number::<i32>(fields.next()?)?;
            if !(COUNT_MIN..=COUNT_MAX).contains(&count) {
                return None;
            }
            Message::Value { micros, count }
        }
        "E" if fields.next()? == "missing" => Message::Missing { micros },
        _ => return None,
    };
    fields.next().is_none().then_some(message)
}

/// The line of a message, with its end: what the sketch writes.
#[must_use]
pub fn line(message: &Message) -> String {
    let body = match message {
        Message::Started { micros, header } => format!("B,{micros},{}", fields(header)),
        Message::Header { micros, header } => format!("H,{micros},{}", fields(header)),
        Message::Value { micros, count } => format!("D,{micros},{count}"),
        Message::Missing { micros } => format!("E,{micros},missing"),
    };
    format!("{body}*{:04X}\r\n", crc(body.as_bytes()))
}

/// Whether a name can be a board's: 1 to 16 letters, digits, `-` and `_`.
#[must_use]
pub fn is_board(name: &str) -> bool {
    let is_letter = |b: u8| b.is_ascii_alphanumeric() || b == b'-' || b == b'_';
    (1..=BOARD_MAX).contains(&name.len()) && name.bytes().all(is_letter)
}

fn fields(header: &Header) -> String {
    let Header { rate, gain, board } = header;
    format!("{NAME},{VERSION},{rate},{gain},{board}")
}

/// Digits with at most a minus before them: `parse` alone takes a plus too.
fn number<T: std::str::FromStr>(text: &str) -> Option<T> {
    (!text.starts_with('+')).then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crc_has_the_check_value_of_the_catalogues() {
        // CRC-16/CCITT-FALSE (also IBM-3740): the check value that catalogues of CRCs give.
        assert_eq!(crc(b"123456789"), 0x29b1);
        assert_eq!(crc(b""), 0xffff);
    }

    #[test]
    fn written_lines_are_read_back() {
        let header = Header { rate: 80, gain: 128, board: "bench-1".into() };
        let started = Message::Started { micros: 1204, header: header.clone() };
        assert_eq!(line(&started), "B,1204,palpate-hx711,1,80,128,bench-1*8C6B\r\n");
        for message in [
            started,
            Message::Header { micros: u32::MAX, header },
            Message::Value { micros: 0, count: COUNT_MIN },
            Message::Value { micros: 48_332_680, count: COUNT_MAX },
            Message::Missing { micros: 7 },
        ] {
            assert_eq!(parse(line(&message).trim_end()), Some(message));
        }
    }

    #[test]
    fn no_changed_lost_or_doubled_byte_is_a_value() {
        let whole = line(&Message::Value { micros: 48_332_680, count: -152_034 });
        let whole = whole.trim_end().as_bytes();
        let is_value =
            |bytes: &[u8]| std::str::from_utf8(bytes).ok().is_some_and(|l| parse(l).is_some());
        assert!(is_value(whole));
        for at in 0..whole.len() {
            for other in 0..=255_u8 {
                let mut changed = whole.to_vec();
                changed[at] = other;
                // The sum may be in small letters.
                let is_same = changed.eq_ignore_ascii_case(whole) && changed[0] == b'D';
                assert!(is_same || !is_value(&changed), "{at} {other}");
            }
            let mut shorter = whole.to_vec();
            shorter.remove(at);
            assert!(!is_value(&shorter), "{at} lost");
            let mut longer = whole.to_vec();
            longer.insert(at, whole[at]);
            assert!(!is_value(&longer), "{at} doubled");
        }
    }

    #[test]
    fn lines_with_a_right_sum_and_wrong_fields_are_refused() {
        for body in [
            "D,1,8388608",
            "D,1,+5",
            "D,4294967296,5",
            "D,1,5,6",
            "D,1",
            "D,-1,5",
            "E,1,lost",
            "X,1,2",
            "H,1,other,1,80,128,a",
            "H,1,palpate-hx711,2,80,128,a",
            "H,1,palpate-hx711,1,40,128,a",
            "H,1,palpate-hx711,1,80,32,a",
            "H,1,palpate-hx711,1,80,128,",
            "H,1,palpate-hx711,1,80,128,a b",
            "",
        ] {
            let line = format!("{body}*{:04X}", crc(body.as_bytes()));
            assert_eq!(parse(&line), None, "{line}");
        }
    }
}
