//! The queue of the log: callers never wait, one thread writes.

use palpate_sessions::program_log::append;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// Lines that may wait. There are a few a second at most; a stalled disk costs lines, not time.
const LINES_MAX: usize = 1024;
/// How long the program waits at its end, or after a panic, until the waiting lines are written.
const FLUSH_MAX: Duration = Duration::from_secs(1);

enum LogPiece {
    Line(Vec<u8>),
    /// Answered when everything before it is written.
    Flush(SyncSender<()>),
}

#[derive(Clone)]
pub struct Queue {
    pieces: SyncSender<LogPiece>,
    dropped: Arc<AtomicU64>,
}

impl Queue {
    /// Starts the thread that writes; none if the system gives no thread.
    pub fn start(folder: Option<PathBuf>, head: String, is_verbose: bool) -> Option<Self> {
        let (pieces, waiting) = sync_channel(LINES_MAX);
        let dropped = Arc::new(AtomicU64::new(0));
        let mut writer = Writer {
            folder,
            head,
            is_begun: false,
            is_verbose,
            is_failure_reported: false,
            dropped: Arc::clone(&dropped),
        };
        let thread = std::thread::Builder::new().name("log".into());
        thread.spawn(move || writer.run(&waiting)).ok()?;
        Some(Self { pieces, dropped })
    }

    /// Hands over a line. Without room it is dropped and counted.
    pub fn line(&self, line: impl Into<Vec<u8>>) {
        if self.pieces.try_send(LogPiece::Line(line.into())).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Waits until all lines are written, but not for long.
    pub fn flush(&self) {
        let (sender, written) = sync_channel(1);
        if self.pieces.try_send(LogPiece::Flush(sender)).is_ok() {
            // A stalled disk does not keep the program open.
            let _ = written.recv_timeout(FLUSH_MAX);
        }
    }
}

/// An event comes as one write.
impl Write for Queue {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        self.line(line);
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

struct Writer {
    folder: Option<PathBuf>,
    head: String,
    /// Whether this program has a line in the file.
    is_begun: bool,
    is_verbose: bool,
    is_failure_reported: bool,
    dropped: Arc<AtomicU64>,
}

impl Writer {
    fn run(&mut self, waiting: &Receiver<LogPiece>) {
        for piece in waiting {
            match piece {
                LogPiece::Line(line) => self.write(&line),
                LogPiece::Flush(done) => {
                    // The caller may have given up.
                    let _ = done.try_send(());
                }
            }
        }
    }

    fn write(&mut self, line: &[u8]) {
        let dropped = self.dropped.swap(0, Ordering::Relaxed);
        let line = match dropped {
            0 => line.to_vec(),
            _ => [format!("{dropped} log lines were dropped here\n").as_bytes(), line].concat(),
        };
        if self.is_verbose {
            // A closed pipe is the reader's choice.
            let _ = io::stderr().write_all(&line);
        }
        let Some(folder) = self.folder.clone() else {
            return self.report_missing_log("palpate has no library folder");
        };
        match self.append(&folder, &line) {
            Ok(()) => self.is_begun = true,
            Err(err) => self.report_missing_log(&format!("{} ({err})", folder.display())),
        }
    }

    fn append(&self, folder: &Path, line: &[u8]) -> io::Result<()> {
        let line = match self.is_begun {
            true => line.to_vec(),
            false => [self.head.as_bytes(), line].concat(),
        };
        append(folder, if self.is_begun { &self.head } else { "" }, &line)
    }

    /// With `--verbose`, notes once that there is no log file.
    fn report_missing_log(&mut self, reason: &str) {
        if self.is_verbose && !std::mem::replace(&mut self.is_failure_reported, true) {
            let _ = writeln!(io::stderr(), "note: no log is written: {reason}");
        }
    }
}
