//! Questions of a run on real wires, asked on the terminal: a person does what is asked and presses Enter.

use super::Failure;
use super::output::Output;
use palpate_model::units::Seconds;
use palpate_protocols::engine::Operator;
use palpate_protocols::runner::{PromptView, Request};
use std::io::BufRead;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};

/// Lines that may wait; a person types them.
const LINES_MAX: usize = 16;

/// The terminal's side of the questions.
pub(super) struct Asking {
    requests: SyncSender<Request>,
    lines: Receiver<String>,
    asked: Option<(String, Seconds)>,
    is_closed: bool,
}

impl Asking {
    /// Listens to standard input and answers to a runner.
    pub fn start(requests: SyncSender<Request>) -> Result<Self, Failure> {
        let (sender, lines) = sync_channel(LINES_MAX);
        std::thread::Builder::new()
            .name("answers".into())
            .spawn(move || {
                for line in std::io::stdin().lock().lines() {
                    let Ok(line) = line else { return };
                    if sender.send(line).is_err() {
                        return;
                    }
                }
            })
            .map_err(Failure::failed)?;
        Ok(Self {
            requests,
            lines,
            asked: None,
            is_closed: false,
        })
    }

    /// Tells a new question and passes on an answer to it. What was typed before the question is no answer.
    pub fn look(&mut self, prompt: Option<&PromptView>, output: &Output) {
        let typed = self.typed();
        let Some(prompt) = prompt else {
            self.asked = None;
            return;
        };
        let is_same = self.asked.as_ref().is_some_and(|(message, left)| {
            *message == prompt.message && prompt.time_left.0 <= left.0
        });
        self.asked = Some((prompt.message.clone(), prompt.time_left));
        if !is_same {
            let how = if self.is_closed {
                "nobody can answer, because standard input is closed"
            } else {
                "press Enter when it is done, or type no"
            };
            let left = prompt.time_left.0.round();
            output.note(&format!("{} ({how}; {left} s left)", prompt.message));
            return;
        }
        let Some(line) = typed else { return };
        let choice = match line.trim() {
            "" | "y" | "yes" | "done" => Operator::Confirm,
            "n" | "no" => Operator::Decline,
            _ => {
                output.note("press Enter when it is done, or type no; Ctrl-C stops the run");
                return;
            }
        };
        // A runner that is swamped or gone ends the run by itself.
        let _ = self.requests.try_send(Request::Operator(choice));
    }

    /// The newest line, if any.
    fn typed(&mut self) -> Option<String> {
        let mut newest = None;
        loop {
            match self.lines.try_recv() {
                Ok(line) => newest = Some(line),
                Err(TryRecvError::Empty) => return newest,
                Err(TryRecvError::Disconnected) => {
                    self.is_closed = true;
                    return newest;
                }
            }
        }
    }
}
