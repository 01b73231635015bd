//! Question and answer, one at a time, while a controller is set up.

use super::model::GalilOpenError;
use super::protocol::{GalilMessage, GalilParser, GalilReply, parse_error};
use crate::wire::{HostClock, Link, TappedLink};
use palpate_model::Nanos;
use std::io;
use std::sync::Arc;

/// An answer takes longer only after a download.
pub const ANSWER_MAX: Nanos = Nanos::from_millis(1_000);
/// A link to a controller with nothing else going on.
pub struct GalilConsole<'a> {
    pub link: TappedLink<'a>,
    parser: GalilParser,
}

impl<'a> GalilConsole<'a> {
    pub fn new(link: &'a mut dyn Link, clock: &'a HostClock, device: &Arc<str>) -> Self {
        Self { link: TappedLink::new(link, clock, device), parser: GalilParser::default() }
    }

    /// The host's clock.
    pub fn now(&self) -> Nanos {
        self.link.now()
    }

    pub fn write(&mut self, text: &str) -> Result<(), GalilOpenError> {
        self.link.write(text.as_bytes()).map_err(lost)
    }

    /// Throws away what comes until nothing has come for `quiet`; tells how many prompts were in it. A device that never
    /// falls silent is left after ten times as long.
    pub fn drain(&mut self, quiet: Nanos) -> Result<usize, GalilOpenError> {
        let (start, mut newest, mut prompts) = (self.now(), self.now(), 0);
        while self.now().since(newest) < quiet && self.now().since(start) < Nanos(10 * quiet.0) {
            let bytes = self.read()?;
            if !bytes.is_empty() {
                newest = self.now();
                prompts += bytes.iter().filter(|b| matches!(b, b':' | b'?')).count();
            }
        }
        self.parser.clear();
        Ok(prompts)
    }

    /// Reads so many replies, as many as come until `within` is over.
    pub fn replies(
        &mut self,
        count: usize,
        within: Nanos,
    ) -> Result<Vec<GalilReply>, GalilOpenError> {
        let start = self.now();
        let mut all = Vec::new();
        while all.len() < count && self.now().since(start) < within {
            for byte in self.read()? {
                if let Some(GalilMessage::Reply(reply)) = self.parser.take(byte) {
                    all.push(reply);
                }
            }
        }
        Ok(all)
    }

    /// Asks one command and gives its answer, whether accepted or not.
    pub fn try_ask(&mut self, command: &str) -> Result<GalilReply, GalilOpenError> {
        self.write(&format!("{command}\r"))?;
        self.replies(1, ANSWER_MAX)?.pop().ok_or(GalilOpenError::Silent)
    }

    pub fn ask(&mut self, command: &str) -> Result<GalilReply, GalilOpenError> {
        let reply = self.try_ask(command)?;
        if reply.is_accepted {
            return Ok(reply);
        }
        let why = self.try_ask("TC1")?;
        Err(GalilOpenError::Refused {
            command: command.to_owned(),
            error: parse_error(&why).unwrap_or(super::GalilError { code: 0, words: String::new() }),
        })
    }

    /// The numbers that `MG` gives for a list of expressions, as many as there are.
    pub fn numbers(&mut self, list: &str) -> Result<Vec<f64>, GalilOpenError> {
        let command = format!("MG {list}");
        let reply = self.ask(&command)?;
        let count = list.split(',').count();
        reply.numbers().filter(|numbers| numbers.len() == count).ok_or_else(|| {
            GalilOpenError::SetOtherwise { command, found: format!("'{}'", reply.text()) }
        })
    }

    pub fn number(&mut self, expression: &str) -> Result<f64, GalilOpenError> {
        Ok(self.numbers(expression)?[0])
    }

    /// Sets a number and checks what an expression reads back.
    pub fn set(
        &mut self,
        command: &str,
        expression: &str,
        wanted: f64,
    ) -> Result<(), GalilOpenError> {
        self.ask(command)?;
        let found = self.number(expression)?;
        if found == wanted {
            return Ok(());
        }
        Err(GalilOpenError::SetOtherwise { command: command.to_owned(), found: found.to_string() })
    }

    fn read(&mut self) -> Result<Vec<u8>, GalilOpenError> {
        self.link.read().map_err(lost)
    }
}

fn lost(err: io::Error) -> GalilOpenError {
    GalilOpenError::Lost { detail: err.to_string() }
}
