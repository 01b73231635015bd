//! Arrays and programs: dimension, record, upload and download.

use super::client::ClientMode;
use super::commands::fields;
use super::expression::evaluate;
use super::program::{Program, check_line};
use super::record::RecordSource;
use super::scope::axis_of;
use super::{Answer, GalilEmulator, Origin};
use palpate_drivers::galil::ErrorCode;

/// Ends an upload (DMC-1700/1800 user manual, `QU`).
const END: u8 = 0x1a;

/// What ends a download: `\`, control-Z, control-Q, control-D (DMC-1700/1800 user manual, `DL`, `QD`).
const fn ends_download(byte: u8) -> bool {
    matches!(byte, b'\\' | END | 0x11 | 0x04)
}

impl GalilEmulator {
    /// A command about arrays or programs; `None` when it is another one.
    pub(super) fn transfer_command(
        &mut self,
        origin: Origin,
        word: &str,
        arguments: &str,
    ) -> Option<Result<Answer, ErrorCode>> {
        let result = match word {
            "DM" => self.dimension(arguments),
            "DA" => self.deallocate(arguments),
            "LV" => {
                let format = self.variable_format;
                let line =
                    |(name, value): (&String, f64)| format!("{name}={}", format.write(value));
                Ok(join_lines(self.memory.variables().map(line)))
            }
            "LA" => {
                let line = |(name, length)| format!("{name}[{length}]");
                Ok(join_lines(self.memory.arrays().map(line)))
            }
            "LL" => {
                let line = |(name, line)| format!("#{name}={line}");
                Ok(join_lines(self.program.labels().map(line)))
            }
            "RA" => self.record_arrays(arguments),
            "RD" => self.record_sources(arguments),
            "RC" => self.record(arguments),
            "QU" => self.upload(arguments),
            "UL" => Ok(self.upload_program()),
            "QD" => self.download_values(origin, arguments),
            "DL" => self.download(origin),
            "XQ" => self.run_program(arguments),
            "HX" => self.halt(arguments),
            _ => return None,
        };
        Some(result)
    }

    fn dimension(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        if arguments == "?" {
            let free = self.memory.free(self.settings.model) as f64;
            return Ok(Answer::Text(self.position_format.write(free)));
        }
        for field in fields(arguments) {
            let (name, rest) = field.split_once('[').ok_or(ErrorCode::BRACKETS)?;
            let length = rest.strip_suffix(']').ok_or(ErrorCode::BRACKETS)?;
            let length = evaluate(length, self)?.trunc();
            self.memory.dimension(name.trim(), length, self.settings.model)?;
        }
        Ok(Answer::Done)
    }

    fn deallocate(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        for field in fields(arguments) {
            self.memory.deallocate(field)?;
        }
        Ok(Answer::Done)
    }

    /// `RA force[],pos[]`.
    fn record_arrays(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        let mut names = Vec::new();
        for field in fields(arguments) {
            let name = field.strip_suffix("[]").ok_or(ErrorCode::BRACKETS)?;
            self.memory.array(name)?;
            names.push(name.to_owned());
        }
        self.recorder.set_arrays(names)?;
        Ok(Answer::Done)
    }

    /// `RD _AFX,_TDA`.
    fn record_sources(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        let sources: Result<Vec<RecordSource>, ErrorCode> =
            fields(arguments).into_iter().map(|field| self.source(field)).collect();
        self.recorder.set_sources(sources?)?;
        Ok(Answer::Done)
    }

    fn source(&self, field: &str) -> Result<RecordSource, ErrorCode> {
        let name = field.strip_prefix('_').unwrap_or(field);
        if name == "TIME" {
            return Ok(RecordSource::Time);
        }
        let (word, rest) = name.split_at_checked(2).ok_or(ErrorCode::NO_SOURCE)?;
        let mut letters = rest.chars();
        let index = match (letters.next(), letters.next()) {
            (None, _) => None,
            (Some(letter), None) => Some(axis_of(letter).ok_or(ErrorCode::NO_SOURCE)?),
            _ => return Err(ErrorCode::NO_SOURCE),
        };
        match (word, index) {
            // Inputs go by the letters of axes (DMC-1700/1800 user manual, page 159).
            ("AF", Some(_)) if self.analog.is_none() => Err(ErrorCode::NO_ANALOG),
            ("AF", Some(input)) => Ok(RecordSource::Analog(input)),
            (
                "DE" | "TP" | "TE" | "SH" | "RL" | "TS" | "SC" | "TT" | "RP" | "TD" | "TV",
                Some(axis),
            ) if axis < self.axes.len() => Ok(RecordSource::Axis(word.to_owned(), axis)),
            ("NO", Some(_)) | ("TI" | "OP" | "NO", None) => {
                Ok(RecordSource::Controller(word.to_owned()))
            }
            _ => Err(ErrorCode::NO_SOURCE),
        }
    }

    /// `RC n,m`, `RC 0`, `RC?`.
    fn record(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        if arguments == "?" {
            let is_running = f64::from(u8::from(self.recorder.is_running()));
            return Ok(Answer::Text(self.position_format.write(is_running)));
        }
        let n = self.first_number(arguments)?;
        if n == 0.0 {
            self.recorder.stop();
            return Ok(Answer::Done);
        }
        let lengths: Result<Vec<usize>, ErrorCode> = self
            .recorder
            .arrays
            .iter()
            .map(|name| self.memory.array(name).map(<[f64]>::len))
            .collect();
        let shortest = lengths?.into_iter().min().unwrap_or(0);
        let m = self.numbers(arguments)?.get(1).copied().flatten();
        let now = self.clock.count();
        self.recorder.start(n, m, shortest, now)?;
        Ok(Answer::Done)
    }

    /// `name[],start,end,delimiter`: the array, first element, element behind the last, and the rest.
    fn range_of(&self, arguments: &str) -> Result<(String, usize, usize, f64), ErrorCode> {
        let mut parts = fields(arguments).into_iter();
        let name = parts.next().unwrap_or("");
        let name = name.strip_suffix("[]").ok_or(ErrorCode::BRACKETS)?;
        let length = self.memory.array(name)?.len();
        let mut number = |usual: f64| match parts.next() {
            None | Some("") => Ok(usual),
            Some(field) => evaluate(field, self),
        };
        let from = number(0.0)?;
        let to = number(length as f64 - 1.0)?;
        let delimiter = number(0.0)?;
        // A recording that holds nothing has `_RD-1` at -1.
        if from < 0.0 || to < from || to >= length as f64 {
            return Err(ErrorCode::ARRAY_INDEX);
        }
        Ok((name.to_owned(), from as usize, to as usize + 1, delimiter))
    }

    /// `QU name[],start,end,delimiter`: 1 is a comma, 0 a carriage return between values. Whether a line end comes
    /// before the end mark is not confirmed.
    fn upload(&self, arguments: &str) -> Result<Answer, ErrorCode> {
        let (name, from, to, delimiter) = self.range_of(arguments)?;
        let between = if delimiter == 1.0 { "," } else { "\r\n" };
        let values: Vec<String> = self.memory.array(&name)?[from..to]
            .iter()
            .map(|value| self.variable_format.write(*value))
            .collect();
        let mut bytes = values.join(between).into_bytes();
        bytes.extend_from_slice(b"\r\n");
        bytes.push(END);
        Ok(Answer::Bytes(bytes))
    }

    fn upload_program(&self) -> Answer {
        let mut bytes = Vec::new();
        for line in &self.program.lines {
            bytes.extend_from_slice(line.as_bytes());
            bytes.extend_from_slice(b"\r\n");
        }
        bytes.push(END);
        Answer::Bytes(bytes)
    }

    fn download_values(&mut self, origin: Origin, arguments: &str) -> Result<Answer, ErrorCode> {
        let channel = origin.client().ok_or(ErrorCode::NOT_IN_PROGRAM)?;
        let (name, next, end, _) = self.range_of(arguments)?;
        self.clients[channel].mode =
            ClientMode::Values { name, next, end, value: Vec::new(), is_wrong: false };
        Ok(Answer::Silent)
    }

    fn download(&mut self, origin: Origin) -> Result<Answer, ErrorCode> {
        let channel = origin.client().ok_or(ErrorCode::NOT_IN_PROGRAM)?;
        if self.running_threads() != 0 {
            return Err(ErrorCode::PROGRAM_RUNNING);
        }
        self.clients[channel].mode = ClientMode::Program { lines: Vec::new(), line: Vec::new() };
        Ok(Answer::Silent)
    }

    /// A byte of a program. Silence until the end, then two prompts, one of them that of `DL`; a line that is
    /// refused gives its `?` before (`GalilConnector.cpp` of EPICS, galil-io of TMT).
    pub(super) fn take_program_byte(&mut self, channel: usize, byte: u8) {
        let model = self.settings.model;
        let client = &mut self.clients[channel];
        let ClientMode::Program { lines, line } = &mut client.mode else {
            return;
        };
        let is_end = ends_download(byte);
        let mut answer: &[u8] = b"";
        if byte == b'\r' || (is_end && !line.is_empty()) {
            let text: String = line.iter().map(|byte| char::from(*byte)).collect();
            line.clear();
            let is_full = lines.len() >= model.program_lines();
            match check_line(&text) {
                Ok(()) if is_full => {
                    self.error = ErrorCode::DOWNLOAD;
                    answer = b"?";
                }
                Ok(()) => lines.push(text),
                Err(code) => {
                    self.error = code;
                    answer = b"?";
                }
            }
        } else if !is_end && byte != b'\n' {
            // One character too many is enough to refuse the line.
            if line.len() <= super::input::LINE_MAX {
                line.push(byte);
            }
        }
        let finished = is_end.then(|| std::mem::take(lines));
        client.send(answer);
        if let Some(lines) = finished {
            client.mode = ClientMode::Commands;
            match Program::new(lines, model) {
                Ok(program) => {
                    self.program = program;
                    client.send(b"::");
                }
                Err(code) => {
                    self.error = code;
                    client.send(b"?:");
                }
            }
        }
    }

    /// A byte of an array's values, which a comma or a carriage return ends.
    pub(super) fn take_value_byte(&mut self, channel: usize, byte: u8) {
        let client = &mut self.clients[channel];
        let ClientMode::Values { name, next, end, value, is_wrong } = &mut client.mode else {
            return;
        };
        let is_end = ends_download(byte);
        if is_end || matches!(byte, b'\r' | b',') {
            let text = String::from_utf8_lossy(value).trim().to_owned();
            value.clear();
            if !text.is_empty() {
                match text.parse::<f64>() {
                    Ok(number) if number.is_finite() && *next < *end => {
                        let held = super::format::quantise(number);
                        let is_set = self.memory.set_element(name, *next as f64, held).is_ok();
                        *is_wrong |= !is_set;
                        *next += 1;
                    }
                    Ok(_) => {
                        *is_wrong = true;
                        self.error = ErrorCode::TOO_MANY_ELEMENTS;
                    }
                    Err(_) => {
                        *is_wrong = true;
                        self.error = ErrorCode::NOT_A_NUMBER;
                    }
                }
            }
        } else if byte != b'\n' && value.len() <= super::input::LINE_MAX {
            value.push(byte);
        }
        if is_end {
            let is_wrong = *is_wrong;
            client.mode = ClientMode::Commands;
            client.send(if is_wrong { b"?" } else { b":" });
        }
    }

    /// `XQ #LABEL,thread`, `XQ line,thread`, `XQ`.
    fn run_program(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        let (place, thread) = arguments.split_once(',').unwrap_or((arguments, "0"));
        let line = match place.trim().strip_prefix('#') {
            Some(label) => self.program.find(label).ok_or(ErrorCode::NO_LABEL)?,
            None if place.trim().is_empty() => 0,
            None => evaluate(place, self)?.max(0.0) as usize,
        };
        if line >= self.program.lines.len() {
            return Err(ErrorCode::NO_LABEL);
        }
        let now = self.clock.count();
        let number = evaluate(thread, self)?;
        if number < 0.0 {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        let thread = self.threads.get_mut(number as usize).ok_or(ErrorCode::OUT_OF_RANGE)?;
        if thread.is_running {
            return Err(ErrorCode::STRAND_BUSY);
        }
        thread.start(line, now);
        Ok(Answer::Done)
    }

    fn halt(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        if arguments.is_empty() {
            self.halt_threads();
            return Ok(Answer::Done);
        }
        let number = evaluate(arguments, self)?;
        let is_one = (0.0..self.threads.len() as f64).contains(&number);
        if !is_one {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        self.threads[number as usize] = super::ProgramThread::idle();
        Ok(Answer::Done)
    }
}

fn join_lines(lines: impl Iterator<Item = String>) -> Answer {
    let lines: Vec<String> = lines.collect();
    if lines.is_empty() { Answer::Done } else { Answer::Text(lines.join("\r\n")) }
}
