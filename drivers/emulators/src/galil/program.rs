//! Application programs: lines, labels and threads.

use super::input::LINE_MAX;
use super::model::GalilModel;
use palpate_drivers::galil::ErrorCode;

/// Subroutines within each other (`TC` 12).
const STACK_MAX: usize = 16;

/// Line and statement within it.
pub type StatementPlace = (usize, usize);

#[derive(Clone, Debug, PartialEq)]
pub enum ThreadWait {
    None,
    /// `WT`, `AT`: a sample.
    Until(u64),
    /// `AM`: these profiles have ended.
    Rest(Vec<usize>),
    /// `MC`: these axes have given all their pulses.
    Pulses(Vec<usize>),
    /// `WC`: the contour buffer.
    Contour,
    /// `AI`: an input is high or low.
    Input(usize, bool),
}

/// A thread of the program.
#[derive(Clone, Debug)]
pub struct ProgramThread {
    pub is_running: bool,
    /// The next statement.
    pub at: StatementPlace,
    pub wait: ThreadWait,
    /// Where subroutines return to, and what was waited for there.
    stack: Vec<(StatementPlace, ThreadWait)>,
    /// Reference of `AT`.
    pub since: u64,
    /// Depth of the stack below which an automatic subroutine runs.
    pub automatic: Option<usize>,
}

impl ProgramThread {
    pub const fn idle() -> Self {
        Self {
            is_running: false,
            at: (0, 0),
            wait: ThreadWait::None,
            stack: Vec::new(),
            since: 0,
            automatic: None,
        }
    }

    /// Starts at a line.
    pub fn start(&mut self, line: usize, now: u64) {
        *self = Self { is_running: true, at: (line, 0), since: now, ..Self::idle() };
    }

    /// `JS`, and the automatic subroutines.
    pub fn call(&mut self, line: usize) -> Result<(), ErrorCode> {
        if self.stack.len() >= STACK_MAX {
            return Err(ErrorCode::SUBROUTINES);
        }
        let wait = std::mem::replace(&mut self.wait, ThreadWait::None);
        self.stack.push((self.at, wait));
        self.at = (line, 0);
        Ok(())
    }

    /// `#LIMSWI` and the like: a call that is not made within itself.
    pub fn call_automatic(&mut self, line: usize) {
        if self.is_running && self.automatic.is_none() {
            let depth = self.stack.len();
            if self.call(line).is_ok() {
                self.automatic = Some(depth);
            }
        }
    }

    /// `EN`, `RE`: back to the caller, or the end.
    pub fn return_from_call(&mut self) {
        match self.stack.pop() {
            Some((at, wait)) => {
                self.at = at;
                self.wait = wait;
                if self.automatic == Some(self.stack.len()) {
                    self.automatic = None;
                }
            }
            None => self.is_running = false,
        }
    }

    /// `ZS`.
    pub fn clear_stack(&mut self) {
        self.stack.clear();
        self.automatic = None;
    }
}

/// The program that was downloaded.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Its lines as they were sent.
    pub lines: Vec<String>,
    statements: Vec<Vec<String>>,
}

impl Program {
    /// A program of lines that [`check_line`] accepted, or what is wrong with it as a whole.
    pub fn new(lines: Vec<String>, model: GalilModel) -> Result<Self, ErrorCode> {
        if lines.len() > model.program_lines() {
            return Err(ErrorCode::DOWNLOAD);
        }
        let statements: Vec<Vec<String>> = lines.iter().map(|line| split(line)).collect();
        let program = Self { lines, statements };
        let mut labels: Vec<&str> = program.labels().map(|(name, _)| name).collect();
        labels.sort_unstable();
        if labels.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(ErrorCode::DUPLICATE_LABEL);
        }
        Ok(program)
    }

    /// Labels with their lines.
    pub fn labels(&self) -> impl Iterator<Item = (&str, usize)> {
        self.statements.iter().enumerate().filter_map(|(at, line)| {
            let name = line.first()?.strip_prefix('#')?;
            Some((name.split_whitespace().next().unwrap_or(""), at))
        })
    }

    /// The line of a label, given without `#`.
    pub fn find(&self, label: &str) -> Option<usize> {
        self.labels().find(|(name, _)| *name == label).map(|(_, at)| at)
    }

    /// The statement at a place and the place behind it, empty lines skipped; `None` behind the end.
    pub fn fetch(&self, (mut line, mut at): StatementPlace) -> Option<(&str, StatementPlace)> {
        loop {
            let statements = self.statements.get(line)?;
            match statements.get(at) {
                Some(text) => return Some((text, (line, at + 1))),
                None => (line, at) = (line + 1, 0),
            }
        }
    }

    /// Behind the `ENDIF` of the `IF` before a place, or with `may_else` behind its `ELSE`.
    pub fn skip(&self, from: StatementPlace, may_else: bool) -> Result<StatementPlace, ErrorCode> {
        let mut at = from;
        let mut depth = 0;
        while let Some((text, next)) = self.fetch(at) {
            at = next;
            if text.starts_with("IF") {
                depth += 1;
            } else if text.starts_with("ENDIF") {
                if depth == 0 {
                    return Ok(at);
                }
                depth -= 1;
            } else if text.starts_with("ELSE") && depth == 0 && may_else {
                return Ok(at);
            }
        }
        Err(ErrorCode::NO_ENDIF)
    }
}

/// Whether a line may be part of a program.
pub fn check_line(line: &str) -> Result<(), ErrorCode> {
    if line.len() > LINE_MAX || !line.is_ascii() {
        return Err(ErrorCode::DOWNLOAD);
    }
    if let Some(label) = line.trim_start().strip_prefix('#') {
        let name = label.split([';', ' ']).next().unwrap_or("");
        // Seven characters, and #LIMSWI's are six; `#!CMDERR` in a message is no label.
        if name.is_empty() || name.len() > 8 {
            return Err(ErrorCode::DUPLICATE_LABEL);
        }
    }
    Ok(())
}

/// Statements of a line; `;` within quotes joins nothing, comments are skipped.
fn split(line: &str) -> Vec<String> {
    let mut all = Vec::new();
    let mut is_quoted = false;
    let parts = line.split(|c: char| {
        is_quoted ^= c == '"';
        c == ';' && !is_quoted
    });
    for part in parts {
        let text = part.trim();
        let is_comment = text.starts_with('\'') || text.starts_with("REM") || is_word(text, "NO");
        if is_comment {
            break;
        }
        if !text.is_empty() {
            all.push(text.to_owned());
        }
    }
    all
}

/// Whether a statement begins with a command, and not with a name that begins like it.
fn is_word(text: &str, word: &str) -> bool {
    text.strip_prefix(word).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(lines: &[&str]) -> Result<Program, ErrorCode> {
        let lines = lines.iter().map(|line| (*line).to_owned()).collect();
        Program::new(lines, GalilModel::Dmc4143)
    }

    #[test]
    fn labels_and_statements_are_found() {
        let program = program(&["#A;a=1;MG \"x;y\"", "NO note", "#B", "EN"]).unwrap();
        assert_eq!(program.find("B"), Some(2));
        assert_eq!(program.find("C"), None);
        assert_eq!(program.fetch((0, 2)), Some(("MG \"x;y\"", (0, 3))));
        assert_eq!(program.fetch((0, 3)), Some(("#B", (2, 1))));
        assert_eq!(program.fetch((3, 1)), None);
        assert_eq!(self::program(&["#A", "#A"]).unwrap_err(), ErrorCode::DUPLICATE_LABEL);
        assert_eq!(check_line(&"a".repeat(81)), Err(ErrorCode::DOWNLOAD));
        assert_eq!(check_line("#"), Err(ErrorCode::DUPLICATE_LABEL));
    }

    #[test]
    fn branches_are_skipped_with_those_inside() {
        let program =
            program(&["IF a", "IF b", "ELSE", "ENDIF", "ELSE", "c=1", "ENDIF;d=1"]).unwrap();
        assert_eq!(program.skip((0, 1), true), Ok((4, 1)));
        assert_eq!(program.skip((0, 1), false), Ok((6, 1)));
        assert_eq!(program.skip((6, 1), true), Err(ErrorCode::NO_ENDIF));
    }

    #[test]
    fn subroutines_return_with_what_was_waited_for() {
        let mut thread = ProgramThread::idle();
        thread.start(3, 0);
        thread.wait = ThreadWait::Until(9);
        thread.call_automatic(7);
        thread.call_automatic(8);
        assert_eq!((thread.at, &thread.wait), ((7, 0), &ThreadWait::None));
        thread.return_from_call();
        assert_eq!((thread.at, &thread.wait), ((3, 0), &ThreadWait::Until(9)));
        for _ in 0..16 {
            thread.call(1).unwrap();
        }
        assert_eq!(thread.call(1), Err(ErrorCode::SUBROUTINES));
        for _ in 0..17 {
            assert!(thread.is_running);
            thread.return_from_call();
        }
        assert!(!thread.is_running);
    }
}
