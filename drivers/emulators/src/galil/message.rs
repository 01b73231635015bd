//! `MG`: texts and numbers, each in a form of its own.

use super::expression::{Cursor, unpack_text};
use super::format::NumberFormat;
use super::{Answer, GalilEmulator};
use palpate_drivers::galil::ErrorCode;

/// What braces ask for.
enum Brace {
    /// `{Fm.n}`, `{Zm.n}`, `{$m.n}`.
    Number(NumberFormat),
    /// `{Sn}`: the characters that a number holds.
    Characters(usize),
    /// `{N}`: no line end.
    Open,
    /// `{^n}`: the character with this code.
    Character(u8),
    /// `{P1}`, `{EA}`: a port to send to, which is the asking one here.
    Port,
}

/// How the numbers of a message are written.
#[derive(Clone, Copy)]
enum Form {
    Number(NumberFormat),
    Characters(usize),
}

impl Form {
    fn write(self, value: f64) -> String {
        match self {
            Self::Number(format) => format.write(value),
            Self::Characters(count) => unpack_text(value).chars().take(count).collect(),
        }
    }
}

impl GalilEmulator {
    /// The text of `MG`. A form in front holds for all numbers, one behind a number for that one. Items follow each
    /// other without anything between: the sign's place parts numbers.
    pub(super) fn message(&self, arguments: &str) -> Result<Answer, ErrorCode> {
        let mut cursor = Cursor::new(arguments);
        let mut text = String::new();
        let mut form = Form::Number(self.variable_format);
        let mut is_open = false;
        let mut newest: Option<f64> = None;
        while let Some(byte) = cursor.peek() {
            match byte {
                b',' => {
                    cursor.take(b',');
                    self.write_newest(&mut newest, form, &mut text);
                }
                b'"' => {
                    self.write_newest(&mut newest, form, &mut text);
                    cursor.take(b'"');
                    text.push_str(cursor.quoted()?);
                }
                b'{' => {
                    cursor.take(b'{');
                    let word = cursor.take_while(|byte| byte != b'}');
                    if !cursor.take(b'}') {
                        return Err(ErrorCode::BRACES);
                    }
                    let chosen = match brace(word)? {
                        Brace::Number(format) => Some(Form::Number(format)),
                        Brace::Characters(count) => Some(Form::Characters(count)),
                        Brace::Open => {
                            is_open = true;
                            None
                        }
                        Brace::Character(code) => {
                            self.write_newest(&mut newest, form, &mut text);
                            text.push(char::from(code));
                            None
                        }
                        Brace::Port => None,
                    };
                    match (chosen, newest.take()) {
                        (Some(chosen), Some(value)) => text.push_str(&chosen.write(value)),
                        (Some(chosen), None) => form = chosen,
                        (None, value) => newest = value,
                    }
                }
                _ => {
                    if newest.is_some() {
                        return Err(ErrorCode::OPERAND);
                    }
                    newest = Some(cursor.expression(self)?);
                }
            }
        }
        self.write_newest(&mut newest, form, &mut text);
        Ok(if is_open { Answer::Open(text) } else { Answer::Text(text) })
    }

    fn write_newest(&self, newest: &mut Option<f64>, form: Form, text: &mut String) {
        if let Some(value) = newest.take() {
            text.push_str(&form.write(value));
        }
    }
}

fn brace(word: &str) -> Result<Brace, ErrorCode> {
    let word = word.trim();
    let mut letters = word.chars();
    let kind = letters.next().ok_or(ErrorCode::BRACES)?;
    let rest = letters.as_str();
    let size = || -> Result<NumberFormat, ErrorCode> {
        let (whole, decimals) = rest.split_once('.').unwrap_or((rest, "0"));
        let whole: usize = whole.parse().map_err(|_| ErrorCode::BRACES)?;
        let decimals: usize = decimals.parse().map_err(|_| ErrorCode::BRACES)?;
        if whole > 15 || decimals > 4 {
            return Err(ErrorCode::BRACES);
        }
        Ok(NumberFormat::decimal(whole, decimals))
    };
    Ok(match kind {
        'F' => Brace::Number(NumberFormat { has_zeros: true, ..size()? }),
        'Z' => Brace::Number(size()?),
        '$' => Brace::Number(NumberFormat { is_hex: true, ..size()? }),
        'S' if rest.is_empty() => Brace::Characters(6),
        'S' => {
            let count = size()?.whole;
            Brace::Characters(count)
        }
        'N' if rest.is_empty() => Brace::Open,
        '^' => match rest.parse() {
            Ok(code @ 0..=127) => Brace::Character(code),
            _ => return Err(ErrorCode::BRACES),
        },
        'P' | 'E' | 'U' => Brace::Port,
        _ => return Err(ErrorCode::BRACES),
    })
}
