//! Expressions: numbers, variables, array elements, operands, functions, strictly from left to right.
//!
//! DMC-40x0 user manual, chapter 7: parentheses come first, all operators have equal rank.

use super::format::quantise;
use super::scope::truth;
use palpate_drivers::galil::ErrorCode;

/// Characters of a name (DMC-40x0 user manual: "up to eight").
pub const NAME_MAX: usize = 8;
/// Parentheses and brackets within each other: as many as half a line holds.
const DEPTH_MAX: usize = 40;

/// What a binary operator does to its operands.
type Operator = fn(f64, f64) -> f64;

pub trait Scope {
    fn variable(&self, name: &str) -> Option<f64>;
    /// An element of an array; index -1 is its length.
    fn element(&self, name: &str, index: f64) -> Result<f64, ErrorCode>;
    /// An operand, without its underscore.
    fn operand(&self, name: &str) -> Result<f64, ErrorCode>;
    /// A function, without its at sign.
    fn function(&self, name: &str, argument: f64) -> Result<f64, ErrorCode>;
}

/// A place in a text of ASCII characters.
pub struct Cursor<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

impl<'a> Cursor<'a> {
    /// At the start of a text.
    pub fn new(text: &'a str) -> Self {
        Self { text, at: 0, depth: 0 }
    }

    /// The character here, blanks skipped.
    pub fn peek(&mut self) -> Option<u8> {
        while self.text.as_bytes().get(self.at) == Some(&b' ') {
            self.at += 1;
        }
        self.text.as_bytes().get(self.at).copied()
    }

    /// Goes on if the character here is this one.
    pub fn take(&mut self, wanted: u8) -> bool {
        let is_here = self.peek() == Some(wanted);
        self.at += usize::from(is_here);
        is_here
    }

    /// Goes over characters of a kind and returns them.
    pub fn take_while(&mut self, is_part: impl Fn(u8) -> bool) -> &'a str {
        self.peek();
        let from = self.at;
        let bytes = self.text.as_bytes();
        while bytes.get(self.at).is_some_and(|byte| is_part(*byte)) {
            self.at += 1;
        }
        // Every byte that got here is ASCII.
        self.text.get(from..self.at).unwrap_or("")
    }

    /// Text up to a closing quote; the cursor is behind the opening one.
    pub fn quoted(&mut self) -> Result<&'a str, ErrorCode> {
        let rest = self.text.get(self.at..).unwrap_or("");
        let end = rest.find('"').ok_or(ErrorCode::QUOTE)?;
        self.at += end + 1;
        Ok(&rest[..end])
    }

    fn deeper(&mut self) -> Result<(), ErrorCode> {
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            return Err(ErrorCode::PARENTHESES);
        }
        Ok(())
    }

    /// An expression, up to the first character that cannot belong to it.
    pub fn expression(&mut self, scope: &dyn Scope) -> Result<f64, ErrorCode> {
        self.deeper()?;
        let mut value = self.primary(scope)?;
        while let Some(operator) = self.operator() {
            let right = self.primary(scope)?;
            value = operator(value, right);
            // A division by zero.
            if !value.is_finite() {
                return Err(ErrorCode::OUT_OF_RANGE);
            }
            value = quantise(value);
        }
        self.depth -= 1;
        Ok(value)
    }

    fn operator(&mut self) -> Option<Operator> {
        let first = self.peek()?;
        let second = self.text.as_bytes().get(self.at + 1).copied();
        let (operator, length): (Operator, usize) = match (first, second) {
            (b'<', Some(b'=')) => (|l, r| truth(l <= r), 2),
            (b'>', Some(b'=')) => (|l, r| truth(l >= r), 2),
            (b'<', Some(b'>')) => (|l, r| truth(l != r), 2),
            (b'<', _) => (|l, r| truth(l < r), 1),
            (b'>', _) => (|l, r| truth(l > r), 1),
            (b'=', _) => (|l, r| truth(l == r), 1),
            (b'+', _) => (|l, r| l + r, 1),
            (b'-', _) => (|l, r| l - r, 1),
            (b'*', _) => (|l, r| l * r, 1),
            (b'/', _) => (|l, r| l / r, 1),
            (b'%', _) => (|l, r| l % r, 1),
            // Casts saturate; the numbers are far inside i64.
            (b'&', _) => (|l, r| ((l as i64) & (r as i64)) as f64, 1),
            (b'|', _) => (|l, r| ((l as i64) | (r as i64)) as f64, 1),
            _ => return None,
        };
        self.at += length;
        Some(operator)
    }

    fn primary(&mut self, scope: &dyn Scope) -> Result<f64, ErrorCode> {
        match self.peek().ok_or(ErrorCode::OPERAND)? {
            b'-' => {
                self.at += 1;
                self.deeper()?;
                let value = -self.primary(scope)?;
                self.depth -= 1;
                Ok(value)
            }
            b'+' => {
                self.at += 1;
                self.number()
            }
            b'(' => {
                self.at += 1;
                let value = self.expression(scope)?;
                if !self.take(b')') {
                    return Err(ErrorCode::PARENTHESES);
                }
                Ok(value)
            }
            b'@' => {
                self.at += 1;
                let name = self.take_while(|byte| byte.is_ascii_uppercase());
                let argument = self.bracketed(scope, ErrorCode::BAD_FUNCTION)?;
                scope.function(name, argument).map(quantise)
            }
            b'_' => {
                self.at += 1;
                let name = self.take_while(|byte| byte.is_ascii_alphanumeric());
                scope.operand(name).map(quantise)
            }
            b'$' => {
                self.at += 1;
                let digits = self.take_while(|byte| byte.is_ascii_hexdigit());
                let bits = u32::from_str_radix(digits, 16).map_err(|_| ErrorCode::NOT_A_NUMBER)?;
                // The 32 bits before the point have a sign.
                Ok(f64::from(bits.cast_signed()))
            }
            b'"' => {
                self.at += 1;
                pack_text(self.quoted()?)
            }
            byte if byte.is_ascii_digit() || byte == b'.' => self.number(),
            byte if byte.is_ascii_alphabetic() => {
                let name = self.take_while(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
                if self.peek() == Some(b'[') {
                    let index = self.bracketed(scope, ErrorCode::BRACKETS)?;
                    return scope.element(name, index);
                }
                scope.variable(name).ok_or(ErrorCode::VARIABLE)
            }
            _ => Err(ErrorCode::OPERAND),
        }
    }

    /// `[expression]`.
    pub fn bracketed(&mut self, scope: &dyn Scope, error: ErrorCode) -> Result<f64, ErrorCode> {
        if !self.take(b'[') {
            return Err(error);
        }
        let value = self.expression(scope)?;
        if self.take(b']') { Ok(value) } else { Err(ErrorCode::BRACKETS) }
    }

    fn number(&mut self) -> Result<f64, ErrorCode> {
        let digits = self.take_while(|byte| byte.is_ascii_digit() || byte == b'.');
        digits.parse().map(quantise).map_err(|_| ErrorCode::NOT_A_NUMBER)
    }

    pub fn rest(&mut self) -> &'a str {
        self.peek();
        self.text.get(self.at..).unwrap_or("")
    }
}

/// The whole text as one expression.
pub fn evaluate(text: &str, scope: &dyn Scope) -> Result<f64, ErrorCode> {
    let mut cursor = Cursor::new(text);
    let value = cursor.expression(scope)?;
    match cursor.peek() {
        None => Ok(value),
        Some(b')') => Err(ErrorCode::PARENTHESES),
        Some(_) => Err(ErrorCode::OPERAND),
    }
}

/// A string of up to six characters as a number holds it: four bytes before and two behind the point.
fn pack_text(text: &str) -> Result<f64, ErrorCode> {
    if text.len() > 6 {
        return Err(ErrorCode::QUOTE);
    }
    let mut bytes = [0_u8; 8];
    bytes[2..2 + text.len()].copy_from_slice(text.as_bytes());
    Ok(u64::from_be_bytes(bytes) as f64 / 65_536.0)
}

/// The characters that a number holds.
pub fn unpack_text(value: f64) -> String {
    let bits = (value * 65_536.0) as u64;
    bits.to_be_bytes()[2..]
        .iter()
        .filter(|byte| byte.is_ascii_graphic() || **byte == b' ')
        .map(|byte| char::from(*byte))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Names;

    impl Scope for Names {
        fn variable(&self, name: &str) -> Option<f64> {
            (name == "a").then_some(2.0)
        }

        fn element(&self, name: &str, index: f64) -> Result<f64, ErrorCode> {
            if name == "d" { Ok(10.0 * index) } else { Err(ErrorCode::NO_ARRAY) }
        }

        fn operand(&self, name: &str) -> Result<f64, ErrorCode> {
            if name == "TPA" { Ok(7.0) } else { Err(ErrorCode::BAD_RESPONSE) }
        }

        fn function(&self, name: &str, argument: f64) -> Result<f64, ErrorCode> {
            if name == "ABS" { Ok(argument.abs()) } else { Err(ErrorCode::BAD_FUNCTION) }
        }
    }

    #[test]
    fn operators_have_equal_rank() {
        for (text, value) in [
            ("1+2*3", 9.0),
            ("1+(2*3)", 7.0),
            ("-a+5", 3.0),
            ("(a=2)&(1<2)", 1.0),
            ("@ABS[-3]+d[a]", 23.0),
            ("_TPA-$10", -9.0),
            ("$FFFFFFFF", -1.0),
            (" 1.5 * 2 ", 3.0),
            ("5<>4", 1.0),
        ] {
            assert_eq!(evaluate(text, &Names), Ok(value), "{text}");
        }
        assert_eq!(unpack_text(pack_text("GO 12").unwrap()), "GO 12");
    }

    #[test]
    fn mistakes_have_their_numbers() {
        for (text, code) in [
            ("", ErrorCode::OPERAND),
            ("b", ErrorCode::VARIABLE),
            ("(1", ErrorCode::PARENTHESES),
            ("1)", ErrorCode::PARENTHESES),
            ("d[1", ErrorCode::BRACKETS),
            ("e[1]", ErrorCode::NO_ARRAY),
            ("@XX[1]", ErrorCode::BAD_FUNCTION),
            ("_GNX", ErrorCode::BAD_RESPONSE),
            ("1..2", ErrorCode::NOT_A_NUMBER),
            ("1/0", ErrorCode::OUT_OF_RANGE),
            ("1 2", ErrorCode::OPERAND),
            (&"(".repeat(4000), ErrorCode::PARENTHESES),
            (&"-".repeat(4000), ErrorCode::PARENTHESES),
        ] {
            assert_eq!(evaluate(text, &Names), Err(code), "{text}");
        }
    }
}
