//! Commands about the controller as a whole: identity, status, formats, inputs and outputs, connections.

use super::analog::Analog;
use super::data_record::lengths;
use super::expression::evaluate;
use super::format::NumberFormat;
use super::{Answer, GalilEmulator, Origin};
use palpate_drivers::galil::ErrorCode;
use palpate_model::Nanos;

/// A write to flash "takes seconds" (TMT galil-io raises its time limit for it).
const BURN: Nanos = Nanos(2_000_000_000);
/// Longest sample period of `TM` in us (DMC-40x0 command reference, `TM`).
const TM_MAX: f64 = 20_000.0;
/// Shortest interval of pushed records: 2 ms, and 8 ms on econo boards (`GalilController.cpp` of EPICS).
const PUSH_MIN: f64 = 2.0;

impl GalilEmulator {
    /// What `^R^V` answers.
    pub(super) fn revision(&self) -> &'static str {
        if self.is_wrong { "RIO47120 Rev 1.1b" } else { self.settings.model.revision() }
    }

    /// All commands that are about no axis and move no data.
    pub(super) fn system_command(
        &mut self,
        origin: Origin,
        word: &str,
        arguments: &str,
    ) -> Result<Answer, ErrorCode> {
        match word {
            "MG" => return self.message(arguments),
            "TC" => return self.query_error(arguments),
            "TB" | "TI" => {
                let value = self.controller_operand(word).unwrap_or(0.0);
                let format = NumberFormat { whole: 3, ..self.position_format };
                return Ok(Answer::Text(format.write(value)));
            }
            "ID" => return Ok(Answer::Text(self.identity())),
            "WH" => return Ok(Answer::Text(self.connection_name(origin))),
            "TH" => return Ok(Answer::Text(self.list_handles())),
            "QZ" => return Ok(Answer::Text(lengths(self.settings.model))),
            // Which blocks a client asks for is ignored: all come.
            "QR" if origin.client().is_some() => {
                return Ok(Answer::Bytes(self.data_record()));
            }
            "QR" => return Err(ErrorCode::NOT_IN_PROGRAM),
            "RS" => {
                self.reset();
                return Ok(Answer::Silent);
            }
            "TM" | "PF" | "VF" | "LZ" if arguments == "?" => {
                let value = self.controller_operand(word).unwrap_or(0.0);
                return Ok(Answer::Text(self.variable_format.write(value)));
            }
            "TM" => self.set_tm(arguments)?,
            "PF" | "VF" | "LZ" => self.set_format(word, arguments)?,
            "EO" => {
                let has_echo = self.allowed_number(arguments, &[0.0, 1.0])? == 1.0;
                // Echo is for the serial line.
                if self.settings.is_serial {
                    self.clients[0].has_echo = has_echo;
                }
            }
            "CW" => {
                // A second field, for terminals without hardware handshake, changes nothing here.
                self.is_marked = match self.first_number(arguments)? {
                    1.0 => true,
                    2.0 | 0.0 => false,
                    _ => return Err(ErrorCode::OUT_OF_RANGE),
                };
            }
            "CF" => self.unsolicited_to = self.parse_handle(origin, arguments)?,
            "CN" => self.configure_inputs(arguments)?,
            "AQ" => self.set_analog(arguments)?,
            "SB" | "CB" => self.set_output(word == "SB", arguments)?,
            "OB" => match self.numbers(arguments)?.as_slice() {
                [Some(number), Some(value)] => {
                    let number = number.to_string();
                    self.set_output(*value != 0.0, &number)?;
                }
                _ => return Err(ErrorCode::FEW_FIELDS),
            },
            "OP" => match self.numbers(arguments)?.first().copied().flatten() {
                Some(value) if (0.0..=65_535.0).contains(&value) => self.outputs = value as u16,
                _ => return Err(ErrorCode::OUT_OF_RANGE),
            },
            // As in the DMC-30010's answer to `TH`.
            "IA" if arguments == "?" => {
                return Ok(Answer::Text("127, 0, 0, 1".to_owned()));
            }
            "CO" if !self.settings.model.is_40x0() => return Err(ErrorCode::UNRECOGNIZED),
            // Stored on the controller; nothing here depends on them.
            "CO" | "AO" | "DQ" | "TW" | "TR" | "IA" | "IK" | "SM" | "DH" | "PW" => {
                self.numbers(arguments)?;
            }
            "DR" => self.push(origin, arguments)?,
            "BN" | "BV" => self.burn(origin)?,
            "BP" => {
                self.burn(origin)?;
                self.burned = Some(self.program.clone());
            }
            "IH" => self.close_handles(origin, arguments)?,
            "NO" => {}
            // Interrupts are for boards on a computer's bus.
            "EI" | "UI" => return Err(ErrorCode::NOT_SUPPORTED),
            "ED" | "LS" if origin.client().is_some() => return Err(ErrorCode::NOT_SUPPORTED),
            "AM" | "MC" | "WT" | "WC" | "AT" | "AI" | "JP" | "JS" | "IF" | "EN" | "RE" | "ZS" => {
                return Err(ErrorCode::PROGRAM_ONLY);
            }
            _ => return Err(ErrorCode::UNRECOGNIZED),
        }
        Ok(Answer::Done)
    }

    fn allowed_number(&self, arguments: &str, allowed: &[f64]) -> Result<f64, ErrorCode> {
        match self.numbers(arguments)?.as_slice() {
            [Some(value)] if allowed.contains(value) => Ok(*value),
            [Some(_)] => Err(ErrorCode::OUT_OF_RANGE),
            _ => Err(ErrorCode::FEW_FIELDS),
        }
    }

    /// `TC`, `TC0`: the number; `TC1`: number and text. The answer clears it.
    fn query_error(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        let has_text = match arguments {
            "" | "0" | "?" => false,
            "1" => true,
            _ => return Err(ErrorCode::OUT_OF_RANGE),
        };
        let code = std::mem::replace(&mut self.error, ErrorCode(0));
        let text = if has_text { code.text() } else { "" };
        Ok(Answer::Text(format!("{} {text}", code.0).trim_end().to_owned()))
    }

    /// Of this form on 41x3 and 40x0 boards; the words are this emulator's.
    fn identity(&self) -> String {
        let analog = self.settings.converter.map_or_else(
            || "no analog inputs".to_owned(),
            |bits| format!("{} analog inputs, {bits} bit", super::analog::INPUTS),
        );
        format!(
            "{}, serial number {}\r\n{analog}\r\nemulated: axis A stepper, others without motors",
            self.revision(),
            self.serial_number()
        )
    }

    fn connection_name(&self, origin: Origin) -> String {
        match origin {
            Origin::Client(channel) if !self.settings.is_serial => {
                format!("IH{}", handle_letter(channel))
            }
            _ => "RS232".to_owned(),
        }
    }

    /// Of the form that a DMC-30010 gave in ESRF BLISS 2.4.0, `controllers/motors/galil`.
    fn list_handles(&self) -> String {
        let mut text =
            "CONTROLLER IP ADDRESS 127,0,0,1 ETHERNET ADDRESS 00-50-4C-00-07-1C".to_owned();
        if self.settings.is_serial {
            return text;
        }
        for (at, client) in self.clients.iter().enumerate() {
            let state = if client.is_open {
                "TCP PORT 23 TO IP ADDRESS 127,0,0,1 PORT 0"
            } else {
                "AVAILABLE"
            };
            text.push_str(&format!("\r\nIH{} {state}", handle_letter(at)));
        }
        text
    }

    fn set_tm(&mut self, arguments: &str) -> Result<(), ErrorCode> {
        // The period is a whole number of 1/16 us (62.5 and 187.5 are among the least ones).
        let tm = (self.first_number(arguments)? * 16.0).round() / 16.0;
        if tm > 0.0 && !(self.settings.model.tm_min()..=TM_MAX).contains(&tm) {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        self.clock.set_tm(self.now, tm);
        Ok(())
    }

    fn set_format(&mut self, word: &str, arguments: &str) -> Result<(), ErrorCode> {
        let number = match self.numbers(arguments)?.as_slice() {
            [Some(number)] if number.abs() < 16.0 => (number * 10.0).round() / 10.0,
            _ => return Err(ErrorCode::OUT_OF_RANGE),
        };
        match word {
            "PF" => self.format_numbers.0 = number,
            "VF" => self.format_numbers.1 = number,
            _ => self.format_numbers.2 = number,
        }
        let (position, variable, removes_zeros) = self.format_numbers;
        let has_zeros = removes_zeros == 0.0;
        self.position_format = NumberFormat::from_number(position, has_zeros);
        self.variable_format = NumberFormat::from_number(variable, has_zeros);
        Ok(())
    }

    /// `A` to `H`, `S` for the serial line, `I` for the connection that asks.
    fn parse_handle(&self, origin: Origin, name: &str) -> Result<Option<usize>, ErrorCode> {
        match name.as_bytes() {
            b"I" => Ok(origin.client()),
            b"S" => Ok(self.settings.is_serial.then_some(0)),
            [letter @ b'A'..=b'H'] if !self.settings.is_serial => {
                Ok(Some(usize::from(letter - b'A')))
            }
            _ => Err(ErrorCode::OUT_OF_RANGE),
        }
    }

    fn configure_inputs(&mut self, arguments: &str) -> Result<(), ErrorCode> {
        let numbers = self.numbers(arguments)?;
        if numbers.len() > 5 || numbers.iter().flatten().any(|n| ![-1.0, 0.0, 1.0].contains(n)) {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        for (at, number) in numbers.into_iter().enumerate() {
            let Some(number) = number else { continue };
            match at {
                0 => self.polarity.limit = number,
                1 => self.polarity.home = number,
                _ => self.other_inputs[at - 2] = number,
            }
        }
        Ok(())
    }

    fn set_analog(&mut self, arguments: &str) -> Result<(), ErrorCode> {
        let numbers = self.numbers(arguments)?;
        let analog: &mut Analog = self.analog.as_mut().ok_or(ErrorCode::NO_ANALOG)?;
        match numbers.as_slice() {
            [Some(input), Some(range)] => analog.set_range(*input, *range),
            _ => Err(ErrorCode::FEW_FIELDS),
        }
    }

    fn set_output(&mut self, is_on: bool, arguments: &str) -> Result<(), ErrorCode> {
        let number = evaluate(arguments, self)?;
        if !(1.0..=16.0).contains(&number) {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        let bit = 1 << (number as u32 - 1);
        if is_on {
            self.outputs |= bit;
        } else {
            self.outputs &= !bit;
        }
        Ok(())
    }

    /// `DR n,h`: refused on a serial line, as gclib does.
    fn push(&mut self, origin: Origin, arguments: &str) -> Result<(), ErrorCode> {
        let (interval, handle) = arguments.split_once(',').unwrap_or((arguments, "I"));
        let interval = evaluate(interval, self)?;
        if interval == 0.0 {
            self.pushed = None;
            return Ok(());
        }
        if self.settings.is_serial {
            return Err(ErrorCode::NOT_SUPPORTED);
        }
        if !(PUSH_MIN..=30_000.0).contains(&interval) {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        let to = self.parse_handle(origin, handle.trim())?;
        let to = to.filter(|to| self.clients[*to].is_open);
        self.pushed = Some((interval as u64, to.ok_or(ErrorCode::CLOSED_HANDLE)?));
        Ok(())
    }

    fn burn(&mut self, origin: Origin) -> Result<(), ErrorCode> {
        if self.running_threads() != 0 {
            return Err(ErrorCode::PROGRAM_RUNNING);
        }
        if let Some(channel) = origin.client() {
            self.clients[channel].busy_until = Some(self.now + BURN);
        }
        Ok(())
    }

    /// `IHT=>-3` closes all other handles, `IHS=>-2` the one that sent it, `IHN=>-2` all but that one, `IHC=>-1` one
    /// (DMC-1400 command reference, `IH`; `GalilConnector.cpp` of EPICS).
    fn close_handles(&mut self, origin: Origin, arguments: &str) -> Result<(), ErrorCode> {
        let Some((selection, how)) = arguments.split_once("=>") else {
            // Opening a connection of its own to another device.
            return Err(ErrorCode::NOT_SUPPORTED);
        };
        if !["-1", "-2", "-3"].contains(&how.trim()) {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        let asking = origin.client();
        let closed: Vec<usize> = match selection.trim().as_bytes() {
            b"S" => asking.into_iter().collect(),
            b"T" | b"N" => (0..self.clients.len()).filter(|at| Some(*at) != asking).collect(),
            [letter @ b'A'..=b'H'] => vec![usize::from(letter - b'A')],
            _ => return Err(ErrorCode::OPERAND),
        };
        if self.settings.is_serial {
            return Ok(());
        }
        for channel in closed {
            let client = &mut self.clients[channel];
            if client.is_open {
                client.is_open = false;
                client.is_hung_up = true;
            }
        }
        Ok(())
    }
}

fn handle_letter(channel: usize) -> char {
    char::from(b'A' + (channel % super::HANDLES) as u8)
}
