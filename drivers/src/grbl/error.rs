//! What Grbl says when it refuses a line or locks itself, with what to do about it.

use std::fmt;

/// `error:N`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The number, where there is one.
    pub code: Option<u8>,
    /// The words of firmware that has words.
    pub words: String,
}

/// `ALARM:N`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alarm {
    /// The number, where there is one.
    pub code: Option<u8>,
    /// The words of firmware that has words.
    pub words: String,
}

fn split(text: &str) -> (Option<u8>, String) {
    let text = text.trim();
    match text.parse() {
        Ok(code) => (Some(code), String::new()),
        Err(_) => (None, text.to_owned()),
    }
}

impl Refusal {
    /// Reads what is behind `error:`.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let (code, words) = split(text);
        Self { code, words }
    }

    /// What it means and what to do (doc/markdown/interface.md, table of error codes).
    fn meaning(&self) -> &'static str {
        match self.code {
            Some(1 | 2 | 23..=29) => "a line was garbled on its way; check the cable",
            Some(3 | 20) => "this firmware does not know the command; use Grbl 1.1",
            Some(4) => "a number must not be negative",
            Some(5) => "its homing is off; set $22=1 or let palpate look for home",
            Some(7) => {
                "its memory could not be read and holds the factory settings now; set them again and open the rig"
            }
            Some(8) => "it is not at rest; wait",
            Some(9) => "it is locked; look at the axis, then open the rig again",
            Some(10) => "soft limits need homing ($22=1)",
            Some(11) => "a line was too long; bytes were lost, check the cable",
            Some(12) => "so many steps a second it does not make; lower the speed",
            Some(13) => "the safety door is open; close it",
            Some(15) => {
                "the target is outside the travel that it knows ($130 to $132); home it or correct the travel"
            }
            Some(16) => "the jog was garbled on its way; check the cable",
            Some(22) => "the speed was lost on its way; check the cable",
            _ => "",
        }
    }
}

impl Alarm {
    /// Reads what is behind `ALARM:`.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let (code, words) = split(text);
        Self { code, words }
    }

    /// What it means and what to do (doc/markdown/interface.md, table of alarm codes).
    fn meaning(&self) -> &'static str {
        match self.code {
            Some(1) => {
                "a limit switch has closed and the axis was stopped at once; free it by hand, then open the rig again and home it"
            }
            Some(2) => "a target was outside the travel that it knows; open the rig again",
            Some(3) => {
                "it was reset in motion and its position is lost; open the rig again and home it"
            }
            Some(4 | 5) => "a search for the probe has failed; check the probe's wiring",
            Some(6..=9) => "its own homing has failed; check the limit switch and its cable",
            _ => "it is locked; look at the axis, then open the rig again",
        }
    }
}

fn write(
    f: &mut fmt::Formatter<'_>,
    name: &str,
    code: Option<u8>,
    words: &str,
    meaning: &str,
) -> fmt::Result {
    match code {
        Some(code) => write!(f, "{name}:{code}")?,
        None => write!(f, "{name}: {words}")?,
    }
    if !meaning.is_empty() {
        write!(f, ", {meaning}")?;
    }
    Ok(())
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write(f, "error", self.code, &self.words, self.meaning())
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write(f, "ALARM", self.code, &self.words, self.meaning())
    }
}
