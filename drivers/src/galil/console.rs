//! Question and answer, one at a time, while a controller is set up.

use super::model::GalilOpenError;
use super::protocol::{GalilMessage, GalilParser, GalilReply, parse_error};
use crate::wire::SetupConsole;
use palpate_model::Nanos;

/// An answer takes longer only after a download.
pub const ANSWER_MAX: Nanos = Nanos::from_millis(1_000);

pub type GalilConsole<'a> = SetupConsole<'a, GalilParser, GalilMessage>;

impl GalilConsole<'_> {
    /// Ends what the line carries and returns how many prompts were in it.
    pub fn drain_prompts(&mut self, quiet: Nanos) -> Result<usize, GalilOpenError> {
        let bytes = self.drain(quiet)?;
        Ok(bytes.iter().filter(|byte| matches!(byte, b':' | b'?')).count())
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
            all.extend(self.take_chunk()?.filter_map(|message| match message {
                GalilMessage::Reply(reply) => Some(reply),
                GalilMessage::Unsolicited(_) | GalilMessage::Flood => None,
            }));
        }
        Ok(all)
    }

    /// Asks one command and gives its answer, whether accepted or not.
    pub fn try_ask(&mut self, command: &str) -> Result<GalilReply, GalilOpenError> {
        self.write(format!("{command}\r"))?;
        self.replies(1, ANSWER_MAX)?.pop().ok_or(GalilOpenError::Silent)
    }

    pub fn ask(&mut self, command: &str) -> Result<GalilReply, GalilOpenError> {
        let reply = self.try_ask(command)?;
        if reply.is_accepted {
            return Ok(reply);
        }
        let error = parse_error(&self.try_ask("TC1")?)
            .unwrap_or(super::GalilError { code: 0, words: String::new() });
        Err(GalilOpenError::Refused { command: command.to_owned(), error })
    }

    /// The numbers that `MG` gives for a list of expressions, as many as there are.
    pub fn numbers(&mut self, list: &str) -> Result<Vec<f64>, GalilOpenError> {
        let command = format!("MG {list}");
        let reply = self.ask(&command)?;
        let count = list.split(',').count();
        reply
            .numbers()
            .filter(|numbers| numbers.len() == count)
            .ok_or_else(|| GalilOpenError::set_otherwise(command, format!("'{}'", reply.text())))
    }

    pub fn number(&mut self, expression: &str) -> Result<f64, GalilOpenError> {
        Ok(self.numbers(expression)?[0])
    }

    /// Checks the numbers that a list of expressions reads back after a command.
    pub fn check(
        &mut self,
        command: &str,
        list: &str,
        wanted: &[f64],
    ) -> Result<(), GalilOpenError> {
        let found = self.numbers(list)?;
        if found == wanted {
            return Ok(());
        }
        let found: Vec<String> = found.iter().map(f64::to_string).collect();
        Err(GalilOpenError::set_otherwise(command, found.join(" and ")))
    }
}
