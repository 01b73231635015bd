//! A program of this computer as a device: its standard input and output are the link.

use super::link::{Link, SocketLink};
use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, WaitIdStatus, kill_process_group, waitid,
};
use std::io::{self, ErrorKind, Read};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A program and those that it has started have so long to end by themselves after the end of their input, before they
/// are killed.
const END_MAX: Duration = Duration::from_millis(500);
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Lines of its standard error that are logged, and their longest length.
const LOG_LINES_MAX: usize = 1_000;
const LOG_LINE_MAX: usize = 500;

/// A child process on a pair of sockets. Dropping it closes its input, waits for its end, and kills it with all that it
/// has started.
pub struct ProgramLink {
    /// `None` only while it is dropped.
    link: Option<SocketLink<UnixStream>>,
    child: Child,
    log: ErrorLog,
}

impl ProgramLink {
    /// Starts a program in a folder, without a shell. A path with a slash counts from the folder, another name is
    /// looked for as usual.
    pub fn start(words: &[String], folder: &Path) -> io::Result<Self> {
        let (program, arguments) = words.split_first().ok_or(ErrorKind::InvalidInput)?;
        let folder = folder.canonicalize()?;
        let program = if program.contains('/') { folder.join(program) } else { program.into() };
        let (ours, theirs) = UnixStream::pair()?;
        let (errors, their_errors) = UnixStream::pair()?;
        for end in [&ours, &errors] {
            end.set_nonblocking(true)?;
        }
        let output = OwnedFd::from(theirs.try_clone()?);
        let child = Command::new(program)
            .args(arguments)
            .current_dir(folder)
            // Ctrl-C in a terminal is for palpate, which stops the axis and then ends the program.
            .process_group(0)
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(Stdio::from(output))
            .stderr(Stdio::from(OwnedFd::from(their_errors)))
            .spawn()?;
        let log = ErrorLog { stream: errors, line: Vec::new(), lines: 0, is_over: false };
        Ok(Self { link: Some(SocketLink::new_nonblocking(ours)), child, log })
    }

    /// The number of its process.
    pub fn process(&self) -> u32 {
        self.child.id()
    }

    fn link(&mut self) -> io::Result<&mut SocketLink<UnixStream>> {
        self.link.as_mut().ok_or_else(|| ErrorKind::NotConnected.into())
    }

    /// What has become of a program that no longer talks.
    fn ending(&mut self, err: io::Error) -> io::Error {
        self.log.pass_on();
        self.end_of_child().map_or(err, |status| io::Error::other(describe_end(&status)))
    }

    /// How the child has ended, if it has. Its number stays its own until it is waited for, so that no other process gets
    /// the signal for its group.
    fn end_of_child(&self) -> Option<WaitIdStatus> {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        waitid(WaitId::Pid(Pid::from_child(&self.child)), options).ok().flatten()
    }
}

fn describe_end(status: &WaitIdStatus) -> String {
    match status.exit_status() {
        Some(code) => {
            format!(
                "the program has ended with exit code {code}; its last words are in the program's log"
            )
        }
        None => "the program was killed".to_owned(),
    }
}

impl Link for ProgramLink {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.log.pass_on();
        let result = self.link()?.read(buffer, wait);
        result.map_err(|err| self.ending(err))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let result = self.link()?.write(bytes);
        result.map_err(|err| self.ending(err))
    }

    fn close_input(&mut self) -> io::Result<()> {
        self.link()?.stream().shutdown(Shutdown::Write)
    }

    fn is_program(&self) -> bool {
        true
    }
}

impl Drop for ProgramLink {
    fn drop(&mut self) {
        self.link = None;
        let looks = END_MAX.as_millis() / LOOK_EVERY.as_millis();
        for _ in 0..looks {
            self.log.pass_on();
            // Whoever was started by the child has its standard error, unless it has closed it.
            if self.log.is_over && self.end_of_child().is_some() {
                break;
            }
            std::thread::sleep(LOOK_EVERY);
        }
        if self.end_of_child().is_none() {
            tracing::warn!("the program did not end by itself and is killed");
        } else if !self.log.is_over {
            tracing::warn!("what the program has started did not end by itself and is killed");
        }
        // They may have ended at this moment, and the child may have left its group.
        let _ = self.child.kill();
        let _ = kill_process_group(Pid::from_child(&self.child), Signal::KILL);
        let _ = self.child.wait();
        self.log.pass_on();
    }
}

/// Standard error of a program, line by line.
struct ErrorLog {
    stream: UnixStream,
    line: Vec<u8>,
    lines: usize,
    /// No process has the other end.
    is_over: bool,
}

impl ErrorLog {
    /// Logs what has come. Never waits; what is beyond the bounds is read and thrown away, so that the program never
    /// waits either.
    fn pass_on(&mut self) {
        let mut buffer = [0_u8; 4096];
        let count = match self.stream.read(&mut buffer) {
            Ok(count @ 1..) => count,
            Ok(0) => return self.is_over = true,
            Err(_) => return,
        };
        for byte in &buffer[..count] {
            match byte {
                b'\n' => self.end_line(),
                byte if self.line.len() < LOG_LINE_MAX => self.line.push(*byte),
                _ => {}
            }
        }
    }

    fn end_line(&mut self) {
        let line = std::mem::take(&mut self.line);
        self.lines += 1;
        if self.lines <= LOG_LINES_MAX {
            let text = String::from_utf8_lossy(&line);
            let text: String = text.chars().filter(|c| !c.is_control()).collect();
            tracing::info!("program: {text}");
        }
        if self.lines == LOG_LINES_MAX {
            tracing::warn!("the program writes too much; its further lines are not logged");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAIT: Duration = Duration::from_millis(100);

    fn start(script: &str) -> ProgramLink {
        let words = ["sh", "-c", script].map(str::to_owned);
        ProgramLink::start(&words, Path::new(".")).unwrap()
    }

    fn read_until(link: &mut ProgramLink, end: &[u8]) -> Vec<u8> {
        let mut all = Vec::new();
        let mut buffer = [0_u8; 64];
        while !all.ends_with(end) {
            let count = link.read(&mut buffer, WAIT).unwrap();
            all.extend_from_slice(&buffer[..count]);
        }
        all
    }

    fn has_process(process: u32) -> bool {
        Path::new(&format!("/proc/{process}")).exists()
    }

    #[test]
    fn bytes_go_to_a_program_and_back_and_it_ends_with_its_input() {
        let mut link = start("cat; echo bye");
        link.write(b"one\n").unwrap();
        assert_eq!(read_until(&mut link, b"\n"), b"one\n");
        link.close_input().unwrap();
        assert_eq!(read_until(&mut link, b"bye\n"), b"bye\n");
        let mut buffer = [0_u8; 4];
        let ending =
            std::iter::from_fn(|| Some(link.read(&mut buffer, WAIT))).find_map(Result::err);
        assert!(ending.is_some());
    }

    #[test]
    fn a_program_that_does_not_end_is_killed_and_reaped() {
        if !cfg!(target_os = "linux") {
            return;
        }
        let mut link = start("trap '' TERM; echo here; while :; do sleep 1; done");
        read_until(&mut link, b"here\n");
        let process = link.process();
        assert!(has_process(process));
        drop(link);
        assert!(!has_process(process), "it is still there, perhaps as a zombie");
    }

    /// Whether a process runs; one that has ended and was not waited for by its new parent does not.
    fn runs(process: u32) -> bool {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat"));
        stat.is_ok_and(|text| !text.contains(") Z") && !text.contains(") X"))
    }

    #[test]
    fn what_a_program_has_started_is_killed_with_it_also_after_its_own_end() {
        if !cfg!(target_os = "linux") {
            return;
        }
        for ending in ["exit 0", "while :; do sleep 1; done"] {
            let mut link = start(&format!("(while :; do sleep 1; done) & echo $!; {ending}"));
            let text = read_until(&mut link, b"\n");
            let grandchild: u32 = String::from_utf8(text).unwrap().trim().parse().unwrap();
            if ending == "exit 0" {
                palpate_test_support::wait::until(
                    || link.end_of_child().map(|_| ()),
                    || "it does not end".into(),
                );
            }
            assert!(runs(grandchild));
            drop(link);
            // The signal is sent; the system ends it when it next has its turn.
            palpate_test_support::wait::until(
                || (!runs(grandchild)).then_some(()),
                || format!("{ending}: {grandchild} still runs"),
            );
        }
    }

    #[test]
    fn a_program_that_closes_its_errors_is_waited_for() {
        let mut link = start("exec 2>&-; cat; sleep 0.1; echo end");
        link.write(b"one\n").unwrap();
        assert_eq!(read_until(&mut link, b"\n"), b"one\n");
        link.close_input().unwrap();
        assert_eq!(read_until(&mut link, b"end\n"), b"end\n");
        drop(link);
    }

    #[test]
    fn a_flood_of_errors_does_not_stop_it_and_its_exit_code_is_named() {
        let mut link = start(
            "i=0; while [ $i -lt 20000 ]; do echo a line of errors >&2; i=$((i+1)); done; exit 7",
        );
        let mut buffer = [0_u8; 4];
        let err = std::iter::from_fn(|| Some(link.read(&mut buffer, WAIT))).find_map(Result::err);
        let err = err.unwrap().to_string();
        // Its output may close a moment before the system knows its exit code.
        assert!(err.contains("exit code 7") || err.contains("disconnected"), "{err}");
        assert!(link.log.lines > LOG_LINES_MAX);
    }

    #[test]
    fn a_program_that_does_not_exist_is_an_error() {
        let words = ["there-is-no-such-program".to_owned()];
        assert!(ProgramLink::start(&words, Path::new(".")).is_err());
        assert!(ProgramLink::start(&[], Path::new(".")).is_err());
    }
}
