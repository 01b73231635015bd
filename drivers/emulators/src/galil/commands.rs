//! Carries out statements: assignments, then commands of two letters with their arguments.

use super::expression::{Cursor, evaluate};
use super::memory::is_name;
use super::scope::axis_of;
use super::settings::{AxisSetting, STEPPER_SPEED_MAX};
use super::{Answer, GalilEmulator, Origin};
use palpate_drivers::galil::ErrorCode;

/// Words whose arguments are numbers of axes, in addition to the [`AxisSetting`]s.
const AXIS_WORDS: [&str; 7] = ["PA", "PR", "JG", "DP", "DE", "CD", "PT"];

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Argument {
    /// `?`.
    Query,
    Number(f64),
}

impl GalilEmulator {
    pub(super) fn execute(&mut self, origin: Origin, text: &str) -> Result<Answer, ErrorCode> {
        if !text.is_ascii() {
            return Err(ErrorCode::UNRECOGNIZED);
        }
        match text.as_bytes() {
            // ^R^V, ^R^S.
            [0x12, 0x16, ..] => return Ok(Answer::Text(self.revision().to_owned())),
            [0x12, 0x13, ..] => {
                self.reset();
                return Ok(Answer::Silent);
            }
            _ => {}
        }
        if let Some(answer) = self.assignment(text) {
            return answer;
        }
        let Some((word, arguments)) = text.split_at_checked(2) else {
            return Err(ErrorCode::UNRECOGNIZED);
        };
        let arguments = arguments.trim();
        if let Some(setting) = AxisSetting::from_word(word) {
            return self.set(setting, arguments);
        }
        if let Some(answer) = self.axis_command(origin, word, arguments) {
            return answer;
        }
        if let Some(answer) = self.transfer_command(origin, word, arguments) {
            return answer;
        }
        self.system_command(origin, word, arguments)
    }

    /// `name=expression`, `name[index]=expression`, `name=` to read it; `None` when it is a command.
    fn assignment(&mut self, text: &str) -> Option<Result<Answer, ErrorCode>> {
        let mut cursor = Cursor::new(text);
        let name = cursor.take_while(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
        if !name.starts_with(|first: char| first.is_ascii_alphabetic()) {
            return None;
        }
        let index = if cursor.peek() == Some(b'[') {
            if is_word(name) {
                return None;
            }
            match cursor.bracketed(self, ErrorCode::BRACKETS) {
                Ok(index) => Some(index),
                // `QU a[],...`: not an element.
                Err(_) if !text.contains(']') || !text.contains('=') => return None,
                Err(code) => return Some(Err(code)),
            }
        } else {
            None
        };
        if !cursor.take(b'=') || cursor.peek() == Some(b'>') {
            return None;
        }
        if index.is_none() && is_axis_command(name) {
            return None;
        }
        Some(self.assign(name, index, cursor.rest()))
    }

    fn assign(&mut self, name: &str, index: Option<f64>, rest: &str) -> Result<Answer, ErrorCode> {
        let model = self.settings.model;
        if rest.is_empty() || rest == "?" {
            let value = match index {
                Some(index) => self.memory.element(name, index)?,
                None => self.memory.variable(name).ok_or(ErrorCode::VARIABLE)?,
            };
            return Ok(Answer::Text(self.variable_format.write(value)));
        }
        let value = evaluate(rest, self)?;
        match index {
            Some(index) => self.memory.set_element(name, index, value)?,
            None if is_name(name) && name != "TIME" => self.memory.set(name, value, model)?,
            None => return Err(ErrorCode::VARIABLE),
        }
        Ok(Answer::Done)
    }

    /// Arguments for axes: `A=1`, `*=1`, or one field per axis.
    pub(super) fn axis_arguments(
        &self,
        arguments: &str,
    ) -> Result<Vec<(usize, Argument)>, ErrorCode> {
        let axes = self.axes.len();
        if let Some((letter, value)) = arguments.split_once('=') {
            let mut letters = letter.trim().chars();
            if let (Some(letter), None) = (letters.next(), letters.next()) {
                let argument = self.argument(value.trim())?;
                if letter == '*' {
                    return Ok((0..axes).map(|axis| (axis, argument)).collect());
                }
                if let Some(axis) = axis_of(letter) {
                    return if axis < axes {
                        Ok(vec![(axis, argument)])
                    } else {
                        Err(ErrorCode::OPERAND)
                    };
                }
            }
        }
        let mut all = Vec::new();
        for (axis, field) in fields(arguments).into_iter().enumerate() {
            if field.is_empty() {
                continue;
            }
            if axis >= axes {
                // ESRF BLISS asks eight axes of whatever board it has.
                if field == "?" {
                    continue;
                }
                return Err(ErrorCode::OPERAND);
            }
            all.push((axis, self.argument(field)?));
        }
        if all.is_empty() {
            return Err(ErrorCode::FEW_FIELDS);
        }
        Ok(all)
    }

    fn argument(&self, field: &str) -> Result<Argument, ErrorCode> {
        if field == "?" {
            return Ok(Argument::Query);
        }
        if field.contains('?') {
            return Err(ErrorCode::QUESTION_MARK);
        }
        evaluate(field, self).map(Argument::Number)
    }

    /// Numbers in fields; an empty field is `None`.
    pub(super) fn numbers(&self, arguments: &str) -> Result<Vec<Option<f64>>, ErrorCode> {
        if arguments.is_empty() {
            return Ok(Vec::new());
        }
        fields(arguments)
            .into_iter()
            .map(|field| match field {
                "" => Ok(None),
                _ => evaluate(field, self).map(Some),
            })
            .collect()
    }

    /// The number in the first field.
    pub(super) fn first_number(&self, arguments: &str) -> Result<f64, ErrorCode> {
        self.numbers(arguments)?.first().copied().flatten().ok_or(ErrorCode::FEW_FIELDS)
    }

    /// A list of axes such as `AC`; an empty list is all of them.
    pub(super) fn axis_list(&self, arguments: &str) -> Result<Vec<usize>, ErrorCode> {
        let letters: Vec<char> =
            arguments.chars().filter(|letter| !matches!(letter, ' ' | ',')).collect();
        if letters.is_empty() || letters == ['*'] {
            return Ok((0..self.axes.len()).collect());
        }
        letters
            .into_iter()
            .map(|letter| {
                axis_of(letter).filter(|axis| *axis < self.axes.len()).ok_or(ErrorCode::OPERAND)
            })
            .collect()
    }

    fn set(&mut self, setting: AxisSetting, arguments: &str) -> Result<Answer, ErrorCode> {
        let mut values = Vec::new();
        for (axis, argument) in self.axis_arguments(arguments)? {
            match argument {
                Argument::Query => {
                    let format = super::NumberFormat {
                        decimals: setting.decimals(),
                        ..self.position_format
                    };
                    values.push(format.write(self.axes[axis].settings.get(setting)));
                }
                Argument::Number(value) => {
                    let value = setting.round(value, self.settings.model, self.clock.tm())?;
                    if setting == AxisSetting::Speed
                        && self.axes[axis].is_stepper()
                        && value > STEPPER_SPEED_MAX
                    {
                        return Err(ErrorCode::OUT_OF_RANGE);
                    }
                    if setting == AxisSetting::MotorType && self.axes[axis].is_running() {
                        return Err(ErrorCode::RUNNING);
                    }
                    self.axes[axis].settings.set(setting, value);
                }
            }
        }
        Ok(join_values(values))
    }
}

/// Values of several axes in one line, separated by commas; each begins with the place of its sign.
pub fn join_values(values: Vec<String>) -> Answer {
    if values.is_empty() { Answer::Done } else { Answer::Text(values.join(",")) }
}

/// Fields between commas outside brackets and parentheses.
pub fn fields(text: &str) -> Vec<&str> {
    let mut depth = 0_i32;
    text.split(|c: char| {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => {}
        }
        c == ',' && depth == 0
    })
    .map(str::trim)
    .collect()
}

/// Whether a name before `=` is two letters of a command and an axis, as in `SPA=1000`.
fn is_axis_command(name: &str) -> bool {
    let Some((word, axis)) = name.split_at_checked(2) else {
        return false;
    };
    let mut letters = axis.chars();
    let is_axis = match (letters.next(), letters.next()) {
        (None, _) => true,
        (Some(letter), None) => axis_of(letter).is_some(),
        _ => false,
    };
    is_axis && (AxisSetting::from_word(word).is_some() || AXIS_WORDS.contains(&word))
}

/// Whether a name before `[` begins with the letters of a command that takes arrays.
fn is_word(name: &str) -> bool {
    ["QU", "QD", "DM", "DA", "RA"].iter().any(|word| name.starts_with(word))
}
