//! Output of a command: text for people or one JSON object for machines.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use palpate_analysis::progress::Progress;
use palpate_analysis::report::catalog::one_line;
use serde::Serialize;
use serde_json::Value;
use std::cell::RefCell;
use std::io::Write;
use std::ops::ControlFlow;

pub(super) struct Output {
    is_json: bool,
    /// What is kept instead of printed, for a front end in the same process.
    kept: Option<RefCell<KeptOutput>>,
}

/// Objects and remarks of a command.
#[derive(Debug, Default)]
pub(super) struct KeptOutput {
    pub objects: Vec<Value>,
    pub notes: Vec<String>,
}

/// A result and the command that it answers.
#[derive(Serialize)]
struct Answer<'a, T> {
    command: &'a str,
    #[serde(flatten)]
    result: &'a T,
}

impl Output {
    pub fn new(is_json: bool) -> Self {
        Self { is_json, kept: None }
    }

    /// Prints nothing; [`Self::take`] hands out what would have been printed.
    pub fn kept() -> Self {
        Self { is_json: true, kept: Some(RefCell::default()) }
    }

    /// What was kept so far.
    pub fn take(&self) -> KeptOutput {
        self.kept.as_ref().map(RefCell::take).unwrap_or_default()
    }

    /// Prints the result of a command: `text` for people, the fields of `result` for machines.
    pub fn answer(&self, command: &str, result: &impl Serialize, text: impl FnOnce() -> String) {
        self.object(&Answer { command, result });
        self.text_only(text);
    }

    /// Prints a result that names its command itself.
    pub fn result(&self, object: &impl Serialize, text: impl FnOnce() -> String) {
        self.object(object);
        self.text_only(text);
    }

    /// Prints an object, with `--json` only.
    pub fn object(&self, object: &impl Serialize) {
        if let Some(kept) = &self.kept {
            kept.borrow_mut().objects.extend(serde_json::to_value(object));
        } else if self.is_json {
            let line = serde_json::to_string(object)
                .unwrap_or_else(|err| format!("{{\"error\":\"{err}\"}}"));
            print(&line);
        }
    }

    /// Prints text, without `--json` only.
    pub fn text_only(&self, text: impl FnOnce() -> String) {
        if !self.is_json {
            print(&harmless(&text()));
        }
    }

    pub fn note(&self, text: &str) {
        if let Some(kept) = &self.kept {
            return kept.borrow_mut().notes.push(text.to_owned());
        }
        let _ = writeln!(std::io::stderr(), "note: {}", one_line(text));
    }

    pub fn error(&self, sentence: &str, exit: u8) {
        let _ = writeln!(std::io::stderr(), "error: {}", harmless(sentence));
        if self.is_json {
            let object = serde_json::json!({ "error": sentence, "exit": exit });
            let _ = writeln!(std::io::stdout(), "{object}");
        }
    }

    /// A progress bar on the terminal; silent in JSON and without a terminal.
    pub fn bar(&self, length: u64) -> Bar {
        self.bar_like(length, "{bar:30} {percent:>3} %  {msg}")
    }

    /// A progress bar that counts pieces of like size, with the time left.
    pub fn count_bar(&self, length: u64) -> Bar {
        self.bar_like(length, "{bar:30} {pos} of {len}  {eta} left  {msg}")
    }

    /// A progress bar over one long piece of work, with the time left.
    pub fn share_bar(&self) -> Bar {
        self.bar_like(0, "{bar:30} {percent:>3} %  {eta} left  {msg}")
    }

    /// Runs work with a bar over its share.
    #[cfg(feature = "haptics")]
    pub fn with_share_bar<T>(&self, work: impl FnOnce(&Bar) -> T) -> T {
        work(&self.share_bar())
    }

    fn bar_like(&self, length: u64, template: &str) -> Bar {
        let bar = ProgressBar::new(length);
        if self.is_json {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Bar(bar)
    }
}

/// An object with the fields of another.
pub(super) fn merged(mut object: Value, more: &impl Serialize) -> Value {
    if let (Value::Object(fields), Ok(Value::Object(more))) =
        (&mut object, serde_json::to_value(more))
    {
        fields.extend(more);
    }
    object
}

/// A bar on the terminal that disappears when it is dropped. It never cancels the work.
pub(super) struct Bar(ProgressBar);

impl std::ops::Deref for Bar {
    type Target = ProgressBar;

    fn deref(&self) -> &ProgressBar {
        &self.0
    }
}

impl Progress for Bar {
    fn report(&self, done: usize, of: usize, what: &str) -> ControlFlow<()> {
        self.0.set_length(of as u64);
        self.0.set_position(done as u64);
        self.0.set_message(what.to_owned());
        ControlFlow::Continue(())
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Lines without control characters, which could move the cursor or command the terminal: text of a session may hold
/// anything.
fn harmless(text: &str) -> String {
    let is_order = |letter: char| letter.is_control() && letter != '\n';
    text.replace(is_order, " ")
}

fn print(line: &str) {
    // A closed pipe (`palpate info x | head`) is the reader's choice, not an error.
    let _ = writeln!(std::io::stdout(), "{line}");
}
