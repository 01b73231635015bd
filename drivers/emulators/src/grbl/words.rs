//! Splits a block of G-code into words (gnea/grbl, gcode.c, step 2; nuts_bolts.c).

use super::gcode::{ModalState, ProgramFlow};
use super::planner::AXES;

/// `MAX_INT_DIGITS` (nuts_bolts.c): later digits are ignored.
const DIGITS_MAX: usize = 8;

/// A number at the start of a text, and the text after it (nuts_bolts.c, `read_float`).
pub fn number(text: &str) -> Option<(f64, &str)> {
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
    let mut has_point = false;
    let end = unsigned
        .find(|c: char| {
            !(c.is_ascii_digit() || c == '.' && !std::mem::replace(&mut has_point, true))
        })
        .unwrap_or(unsigned.len());
    let (digits, rest) = unsigned.split_at(end);
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    if whole.is_empty() && part.is_empty() {
        return None;
    }
    let decimals = DIGITS_MAX.saturating_sub(whole.len()).min(part.len());
    let value: f64 = format!("0{whole}.{}0", &part[..decimals]).parse().ok()?;
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    Some((sign * value, rest))
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum AxisUse {
    Motion,
    NonModal,
    ToolLength,
}

/// Words of one block.
#[derive(Default)]
pub struct BlockWords {
    /// Values of the letters from A on.
    pub values: [Option<f64>; 26],
    /// Modal groups that have a word: `G` words in the lower half, `M` words in the upper one.
    pub groups: u32,
    /// 4, 10, 28, 30, 53, 92, and 281, 301, 921 for those with `.1`.
    pub non_modal: u16,
    pub axes_for: Option<AxisUse>,
    pub has_motion_word: bool,
    pub tool_length: Option<bool>,
}

impl BlockWords {
    pub fn value(&self, letter: char) -> Option<f64> {
        self.values[letter as usize - 'A' as usize]
    }

    /// Takes the value of a letter, so that it counts as used.
    pub fn take(&mut self, letter: char) -> Option<f64> {
        self.values[letter as usize - 'A' as usize].take()
    }

    pub fn axes(&self) -> [Option<f64>; AXES] {
        [self.value('X'), self.value('Y'), self.value('Z')]
    }

    pub fn claim_axes(&mut self, by: AxisUse) -> Result<(), u8> {
        if self.axes_for.replace(by).is_some() {
            return Err(24);
        }
        Ok(())
    }

    pub fn group(&mut self, number: u32) -> Result<(), u8> {
        let bit = 1 << number;
        if self.groups & bit != 0 {
            return Err(21);
        }
        self.groups |= bit;
        Ok(())
    }
}

pub fn take_g(
    block: &mut ModalState,
    words: &mut BlockWords,
    whole: i64,
    part: i64,
) -> Result<(), u8> {
    let mut unused_part = part;
    let group = match whole {
        4 | 10 | 28 | 30 | 53 | 92 => {
            let has_axes = matches!(whole, 10 | 28 | 30 | 92) && part == 0;
            if has_axes {
                words.claim_axes(AxisUse::NonModal)?;
            }
            words.non_modal = whole as u16;
            if matches!(whole, 28 | 30 | 92) {
                if !matches!(part, 0 | 10) {
                    return Err(20);
                }
                if part == 10 {
                    words.non_modal = whole as u16 * 10 + 1;
                }
                unused_part = 0;
            }
            0
        }
        0..=3 | 38 | 80 => {
            if whole != 80 {
                words.claim_axes(AxisUse::Motion)?;
                words.has_motion_word = true;
            }
            block.motion = whole as u16;
            if whole == 38 {
                if !matches!(part, 20 | 30 | 40 | 50) {
                    return Err(20);
                }
                block.motion = 380 + part as u16 / 10;
                unused_part = 0;
            }
            1
        }
        17..=19 => {
            block.plane = whole as u8;
            2
        }
        90 | 91 if part == 0 => {
            block.is_relative = whole == 91;
            3
        }
        91 if part == 10 => {
            unused_part = 0;
            4
        }
        93 | 94 => {
            block.is_inverse = whole == 93;
            5
        }
        20 | 21 => {
            block.is_inch = whole == 20;
            6
        }
        40 => 7,
        43 | 49 => {
            words.claim_axes(AxisUse::ToolLength)?;
            if whole == 43 && part != 10 {
                return Err(20);
            }
            words.tool_length = Some(whole == 43);
            unused_part = 0;
            8
        }
        54..=59 => {
            block.system = whole as usize - 54;
            12
        }
        61 if part == 0 => 13,
        _ => return Err(20),
    };
    if unused_part > 0 {
        return Err(23);
    }
    words.group(group)
}

pub fn take_m(
    block: &mut ModalState,
    words: &mut BlockWords,
    flow: &mut ProgramFlow,
    whole: i64,
    part: i64,
) -> Result<(), u8> {
    if part > 0 {
        return Err(23);
    }
    let group = match whole {
        0 | 1 | 2 | 30 => {
            match whole {
                0 => *flow = ProgramFlow::Pauses,
                2 | 30 => *flow = ProgramFlow::Ends,
                // The optional stop is off.
                _ => {}
            }
            16
        }
        3..=5 => {
            block.spindle = whole as u8;
            17
        }
        8 | 9 => {
            block.has_coolant = whole == 8;
            18
        }
        _ => return Err(20),
    };
    words.group(group)
}

pub fn take_value(words: &mut BlockWords, letter: char, value: f64) -> Result<(), u8> {
    if !matches!(letter, 'F' | 'I'..='L' | 'N' | 'P' | 'R'..='T' | 'X'..='Z') {
        return Err(20);
    }
    if letter == 'T' && value > 255.0 {
        return Err(38);
    }
    if words.values[letter as usize - 'A' as usize].replace(value).is_some() {
        return Err(25);
    }
    if value < 0.0 && matches!(letter, 'F' | 'N' | 'P' | 'S' | 'T') {
        return Err(4);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_the_board_reads_them() {
        assert_eq!(number("1.5X"), Some((1.5, "X")));
        assert_eq!(number("-.5"), Some((-0.5, "")));
        assert_eq!(number("1.2.3"), Some((1.2, ".3")));
        assert_eq!(number("1.123456789"), Some((1.1234567, "")));
        assert_eq!(number("."), None);
        assert_eq!(number("-"), None);
        assert_eq!(number("X"), None);
    }
}
