//! What a command prints: text for people or one JSON object for machines.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use palpate_analysis::progress::Progress;
use palpate_analysis::report::catalog::one_line;
use serde::Serialize;
use std::io::Write;
use std::ops::ControlFlow;

/// Where results go.
pub(super) struct Output {
    is_json: bool,
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
        Self { is_json }
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

    /// Prints what only machines read.
    pub fn object(&self, object: &impl Serialize) {
        if self.is_json {
            let line = serde_json::to_string(object)
                .unwrap_or_else(|err| format!("{{\"error\":\"{err}\"}}"));
            print(&line);
        }
    }

    /// Prints what only people read.
    pub fn text_only(&self, text: impl FnOnce() -> String) {
        if !self.is_json {
            print(&harmless(&text()));
        }
    }

    /// Prints a remark that is not the result.
    pub fn note(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "note: {}", one_line(text));
    }

    /// Prints why the command failed.
    pub fn error(&self, sentence: &str, exit: u8) {
        let _ = writeln!(std::io::stderr(), "error: {}", harmless(sentence));
        if self.is_json {
            let object = serde_json::json!({ "error": sentence, "exit": exit });
            let _ = writeln!(std::io::stdout(), "{object}");
        }
    }

    /// A progress bar on the terminal; silent in JSON and where nobody watches.
    pub fn bar(&self, length: u64) -> Bar {
        self.bar_like(length, "{bar:30} {percent:>3} %  {msg}")
    }

    /// A progress bar that counts pieces of like size and tells the time left.
    pub fn count_bar(&self, length: u64) -> Bar {
        self.bar_like(length, "{bar:30} {pos} of {len}  {eta} left  {msg}")
    }

    /// A progress bar over one long piece of work that tells the time left.
    pub fn share_bar(&self) -> Bar {
        self.bar_like(0, "{bar:30} {percent:>3} %  {eta} left  {msg}")
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

/// A bar on the terminal that goes when it is dropped. Nobody ends the work that it watches.
pub(super) struct Bar(ProgressBar);

impl std::ops::Deref for Bar {
    type Target = ProgressBar;

    fn deref(&self) -> &ProgressBar {
        &self.0
    }
}

impl Progress for Bar {
    fn tell(&self, done: usize, of: usize, what: &str) -> ControlFlow<()> {
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

/// A text of lines without anything that moves the cursor or gives the terminal an order: words of a session may hold
/// whatever somebody typed.
fn harmless(text: &str) -> String {
    let is_order = |letter: char| letter.is_control() && letter != '\n';
    text.replace(is_order, " ")
}

fn print(line: &str) {
    // A closed pipe (`palpate info x | head`) is the reader's choice, not an error.
    let _ = writeln!(std::io::stdout(), "{line}");
}
