//! Question and answer, one at a time, while a board is set up.

use super::connect::{ANSWER_MAX, ASK_AGAIN};
use super::error::GrblOpenError;
use super::protocol::{self, GrblStatus, Incoming, Parser};
use crate::wire::{HostClock, Link, TappedLink};
use palpate_model::Nanos;
use std::collections::VecDeque;
use std::sync::Arc;

/// A link to a board with nothing else going on.
pub(super) struct Console<'a> {
    pub link: TappedLink<'a>,
    parser: Parser,
    waiting: VecDeque<Incoming>,
}

impl<'a> Console<'a> {
    pub fn new(link: &'a mut dyn Link, clock: &'a HostClock, device: &Arc<str>) -> Self {
        Self {
            link: TappedLink::new(link, clock, device),
            parser: Parser::default(),
            waiting: VecDeque::new(),
        }
    }

    /// The host's clock.
    pub fn now(&self) -> Nanos {
        self.link.now()
    }

    pub fn write(&mut self, bytes: &[u8]) -> Result<(), GrblOpenError> {
        self.link.write(bytes).map_err(lost)
    }

    pub fn next(&mut self, until: Nanos) -> Result<Option<Incoming>, GrblOpenError> {
        loop {
            if let Some(incoming) = self.waiting.pop_front() {
                return Ok(Some(incoming));
            }
            if self.now() >= until {
                return Ok(None);
            }
            for byte in self.link.read().map_err(lost)? {
                self.waiting.extend(self.parser.take(byte));
            }
        }
    }

    pub fn status(&mut self) -> Result<GrblStatus, GrblOpenError> {
        let end = self.now() + ANSWER_MAX;
        while self.now() < end {
            self.write(&[protocol::QUERY])?;
            let until = self.now() + ASK_AGAIN;
            while let Some(incoming) = self.next(until)? {
                if let Incoming::Status(status) = incoming {
                    return Ok(status);
                }
            }
        }
        Err(GrblOpenError::Silent)
    }

    /// Sends a line and gives what comes before its `ok`.
    pub fn ask(&mut self, line: &str) -> Result<Vec<Incoming>, GrblOpenError> {
        self.write(format!("{line}\n").as_bytes())?;
        let until = self.now() + ANSWER_MAX;
        let mut all = Vec::new();
        while let Some(incoming) = self.next(until)? {
            match incoming {
                Incoming::Ok => return Ok(all),
                Incoming::Refused(refusal) => {
                    return Err(GrblOpenError::Refused {
                        line: line.to_owned(),
                        detail: refusal.to_string(),
                    });
                }
                other => all.push(other),
            }
        }
        Err(GrblOpenError::Silent)
    }
}

fn lost(err: std::io::Error) -> GrblOpenError {
    GrblOpenError::Lost { detail: err.to_string() }
}
