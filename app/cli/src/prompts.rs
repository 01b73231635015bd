//! Prompts of a run on a wired rig, on the terminal: the operator does what is asked and presses Enter.

use super::Failure;
use super::output::Output;
use super::terminal::read_lines;
use palpate_model::time::Nanos;
use palpate_model::units::Seconds;
use palpate_protocols::engine::{Operator, RunOutcome};
use palpate_runner::{PromptView, RunView, RunnerRequest};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError};

pub(super) struct OperatorPrompts {
    requests: SyncSender<RunnerRequest>,
    lines: Receiver<String>,
    shown_prompt: Option<(String, Seconds)>,
    is_closed: bool,
    retract_question: RetractQuestion,
    /// Whether that question is open, for the handler of Ctrl-C.
    is_question_open: Arc<AtomicBool>,
}

/// The question whether to retract.
#[derive(Clone, Copy, Debug)]
enum RetractQuestion {
    NotAsked,
    /// At this session time.
    Asked(Nanos),
    /// At this session time; the runner has yet to take it.
    Answered(Nanos),
}

/// Longest wait for an answer after a stop: an operator is there within minutes, and an unattended run must end.
const STOPPED_MAX: Seconds = Seconds(300.0);

/// Time after which an answer has been taken: thirty updates of the run.
const ANSWERED_MAX: Seconds = Seconds(1.0);

impl OperatorPrompts {
    /// Listens to standard input and answers to a runner.
    pub fn start(
        requests: SyncSender<RunnerRequest>,
        is_question_open: Arc<AtomicBool>,
    ) -> Result<Self, Failure> {
        let lines = read_lines("answers")?;
        Ok(Self {
            requests,
            lines,
            shown_prompt: None,
            is_closed: false,
            retract_question: RetractQuestion::NotAsked,
            is_question_open,
        })
    }

    /// Prints a new question and passes on the answer. A line typed before the question is no answer.
    pub fn update(&mut self, view: &RunView, output: &Output) {
        let typed = self.newest_line();
        match (&view.holding, &view.outcome) {
            (Some(stop), None) => self.ask_to_retract(view, stop, typed, output),
            _ => {
                self.retract_question = RetractQuestion::NotAsked;
                self.is_question_open.store(false, Ordering::Relaxed);
                self.show_prompt(view.prompt.as_ref(), typed, output);
            }
        }
    }

    fn show_prompt(&mut self, prompt: Option<&PromptView>, typed: Option<String>, output: &Output) {
        let Some(prompt) = prompt else {
            self.shown_prompt = None;
            return;
        };
        let is_same = self.shown_prompt.as_ref().is_some_and(|(message, left)| {
            *message == prompt.message && prompt.time_left.0 <= left.0
        });
        self.shown_prompt = Some((prompt.message.clone(), prompt.time_left));
        if !is_same {
            let instruction = if self.is_closed {
                "no answer is possible: standard input is closed"
            } else {
                "press Enter when done, or type no"
            };
            let left = prompt.time_left.0.round();
            output.note(&format!("{} ({instruction}; {left} s left)", prompt.message));
            return;
        }
        let hint = "press Enter when done, or type no; Ctrl-C stops the run";
        let choice = match parse_answer(typed, hint, output) {
            Some(true) => Operator::Confirm,
            Some(false) => Operator::Decline,
            None => return,
        };
        // A runner that cannot take it ends the run by itself.
        let _ = self.requests.try_send(RunnerRequest::Operator(choice));
    }

    /// After a stop the probe stays where it is, maybe deep in the tissue, until the operator asks for a retract.
    fn ask_to_retract(
        &mut self,
        view: &RunView,
        stop: &RunOutcome,
        typed: Option<String>,
        output: &Output,
    ) {
        if let RetractQuestion::Answered(at) = self.retract_question {
            if view.now.since(at).seconds() < ANSWERED_MAX {
                return;
            }
            // A retract that was stopped at once is another stop.
            self.retract_question = RetractQuestion::NotAsked;
        }
        let choice = match (self.retract_question, &view.can_retract) {
            (_, Err(reason)) => {
                output.note(&format!("the probe stays where it is: {reason}"));
                Operator::Close
            }
            (RetractQuestion::NotAsked, Ok(())) if self.is_closed => Operator::Close,
            (RetractQuestion::NotAsked, Ok(())) => {
                self.retract_question = RetractQuestion::Asked(view.now);
                self.is_question_open.store(true, Ordering::Relaxed);
                let (ending, reason, left) = (&stop.ending, &stop.reason, STOPPED_MAX.0);
                output.note(&format!(
                    "{ending}: {reason}. Retract the probe? (press Enter to retract, or type no to leave it there; {left} s left)"
                ));
                return;
            }
            (RetractQuestion::Asked(since), Ok(()))
                if view.now.since(since).seconds().0 > STOPPED_MAX.0 =>
            {
                output.note("no answer came; the probe stays where it is");
                Operator::Close
            }
            (RetractQuestion::Asked(_) | RetractQuestion::Answered(_), Ok(())) => {
                let hint = "press Enter to retract, or type no to leave the probe where it is";
                match parse_answer(typed, hint, output) {
                    Some(true) => Operator::Retract,
                    Some(false) => Operator::Close,
                    // A last line may come before the end of the input.
                    None if self.is_closed => Operator::Close,
                    None => return,
                }
            }
        };
        // A full queue: the next update tries again.
        if self.requests.try_send(RunnerRequest::Operator(choice)).is_ok() {
            self.retract_question = RetractQuestion::Answered(view.now);
        }
    }

    /// The newest line, if any.
    fn newest_line(&mut self) -> Option<String> {
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

/// A typed line as yes or no; `hint` is printed where it is neither.
fn parse_answer(typed: Option<String>, hint: &str, output: &Output) -> Option<bool> {
    match typed?.trim() {
        "" | "y" | "yes" | "done" => Some(true),
        "n" | "no" => Some(false),
        _ => {
            output.note(hint);
            None
        }
    }
}
