//! Question and answer, one at a time, while a board is set up.

use super::connect::{ANSWER_MAX, ASK_AGAIN};
use super::error::GrblOpenError;
use super::protocol::{self, GrblLine, GrblParser, GrblStatus};
use crate::wire::SetupConsole;
use palpate_model::Nanos;

pub(super) type GrblConsole<'a> = SetupConsole<'a, GrblParser, GrblLine>;

impl GrblConsole<'_> {
    /// The next line, if one comes in time.
    pub fn next_line(&mut self, until: Nanos) -> Result<Option<GrblLine>, GrblOpenError> {
        Ok(self.next(until)?.map(|(_, line)| line))
    }

    /// Asks for a status until one comes.
    pub fn status(&mut self) -> Result<GrblStatus, GrblOpenError> {
        let end = self.now() + ANSWER_MAX;
        while self.now() < end {
            self.write([protocol::QUERY])?;
            let until = self.now() + ASK_AGAIN;
            while let Some(incoming) = self.next_line(until)? {
                if let GrblLine::Status(status) = incoming {
                    return Ok(status);
                }
            }
        }
        Err(GrblOpenError::Silent)
    }

    /// Sends a line and gives what comes before its `ok`.
    pub fn ask(&mut self, line: &str) -> Result<Vec<GrblLine>, GrblOpenError> {
        self.write(format!("{line}\n"))?;
        let until = self.now() + ANSWER_MAX;
        let mut all = Vec::new();
        while let Some(incoming) = self.next_line(until)? {
            match incoming {
                GrblLine::Ok => return Ok(all),
                GrblLine::Refused(refusal) => {
                    let detail = refusal.to_string();
                    return Err(GrblOpenError::Refused { line: line.to_owned(), detail });
                }
                other => all.push(other),
            }
        }
        Err(GrblOpenError::Silent)
    }
}
