//! What is wrong with a protocol: where, what, what to do.

use serde::Serialize;
use std::fmt;

/// Most problems reported of one file. More would hide the first.
pub const PROBLEMS_MAX: usize = 20;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProblemSeverity {
    Error,
    /// The protocol can run, but perhaps not as intended.
    Warning,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ProtocolProblem {
    /// Line of the file, from 1; 0 where it is not in the file.
    pub line: u32,
    pub severity: ProblemSeverity,
    pub message: String,
}

impl ProtocolProblem {
    /// Something that keeps the protocol from running.
    #[must_use]
    pub fn error(line: u32, message: impl Into<String>) -> Self {
        Self { line, severity: ProblemSeverity::Error, message: message.into() }
    }

    #[must_use]
    pub fn warning(line: u32, message: impl Into<String>) -> Self {
        Self { severity: ProblemSeverity::Warning, ..Self::error(line, message) }
    }

    pub fn is_error(&self) -> bool {
        self.severity == ProblemSeverity::Error
    }
}

impl fmt::Display for ProtocolProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line > 0 {
            write!(f, "line {}: ", self.line)?;
        }
        if self.severity == ProblemSeverity::Warning {
            f.write_str("warning: ")?;
        }
        f.write_str(&self.message)
    }
}

/// The problems found so far: each once, and not too many.
#[derive(Debug, Default)]
pub struct Problems {
    found: Vec<ProtocolProblem>,
    dropped: usize,
    /// How often something was wrong, repeats included.
    count: usize,
}

impl Problems {
    pub fn error(&mut self, line: u32, message: impl Into<String>) {
        self.push(ProtocolProblem::error(line, message));
    }

    /// Every pass of a loop finds the same problem: it is listed once.
    pub fn push(&mut self, problem: ProtocolProblem) {
        self.count += 1;
        if self.found.contains(&problem) {
            return;
        }
        if self.found.len() < PROBLEMS_MAX {
            self.found.push(problem);
        } else {
            self.dropped += 1;
        }
    }

    pub fn take<T>(&mut self, line: u32, result: Result<T, String>) -> Option<T> {
        result.map_err(|message| self.error(line, message)).ok()
    }

    /// How often something was wrong, for comparing before and after.
    pub fn count(&self) -> usize {
        self.count
    }

    pub fn has_errors(&self) -> bool {
        self.found.iter().any(ProtocolProblem::is_error)
    }

    pub fn is_full(&self) -> bool {
        self.dropped > 0
    }

    /// All of them in the order of the text.
    pub fn into_list(mut self) -> Vec<ProtocolProblem> {
        self.found.sort_by_key(|problem| problem.line);
        if self.dropped > 0 {
            let message =
                format!("only {PROBLEMS_MAX} problems are listed; correct these and check again");
            self.found.push(ProtocolProblem::error(0, message));
        }
        self.found
    }
}

/// The known word nearest to one that is not known, if it is near.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let near = known.into_iter().map(|candidate| (distance(word, candidate), candidate));
    let best = near.min_by_key(|(distance, _)| *distance)?;
    // Half of a short word may be wrong, never more than three letters.
    (best.0 <= (best.1.chars().count() / 2).clamp(1, 3)).then_some(best.1)
}

/// "; did you mean 'x'?" or, with nothing near, the list of what is known.
pub fn suggestion(word: &str, known: &[&str]) -> String {
    match nearest(word, known.iter().copied()) {
        Some(near) => format!("did you mean '{near}'?"),
        None if known.is_empty() => "none is defined here".into(),
        None => format!("choose from {}", known.join(", ")),
    }
}

/// Edits between two words (Levenshtein 1966), `-` and `_` taken for the same.
fn distance(a: &str, b: &str) -> usize {
    let letters = |word: &str| -> Vec<char> {
        let same = |letter| if letter == '_' { '-' } else { letter };
        word.to_lowercase().chars().take(40).map(same).collect()
    };
    let (a, b) = (letters(a), letters(b));
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_words_are_found_and_far_ones_are_not() {
        let known = ["ramp", "retract", "rest", "find-contact"];
        for (word, near) in [
            ("rmap", Some("ramp")),
            ("find_contact", Some("find-contact")),
            ("Ramp", Some("ramp")),
            ("retrat", Some("retract")),
            ("calibrate", None),
        ] {
            assert_eq!(nearest(word, known), near, "{word}");
        }
        assert_eq!(distance("kitten", "sitting"), 3);
        assert!(suggestion("zzzzzz", &known).contains("choose from ramp"));
    }

    #[test]
    fn problems_are_listed_once_and_up_to_a_limit() {
        let mut problems = Problems::default();
        for _ in 0..3 {
            problems.error(7, "twice");
        }
        for line in 0..100 {
            problems.error(line, "each");
        }
        assert!(problems.is_full());
        let list = problems.into_list();
        assert_eq!(list.len(), PROBLEMS_MAX + 1);
        assert_eq!(list.iter().filter(|problem| problem.message == "twice").count(), 1);
    }
}
