//! Servers on free ports of this computer, each ended with the test that started it.

use palpate_notifications::{Notice, NoticeKind, Target, TargetAddress, WebhookTarget};
use palpate_test_support::skip::{TestNeed, lacks_program, skip};
use palpate_test_support::wait::PATIENCE;
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// Lines that may wait for a test.
const LINES_MAX: usize = 1000;

/// A notice of a kind.
pub fn notice(kind: NoticeKind) -> Notice {
    let now = chrono::DateTime::from_timestamp(1_780_000_000, 0).unwrap();
    Notice {
        kind,
        rig: "bench".into(),
        text: format!("bench: a notice of {kind}"),
        ..Notice::test(now)
    }
}

/// A target for every notice.
pub fn target(address: TargetAddress, ca_file: Option<&Path>) -> Target {
    let ca_file = ca_file.map(|path| std::fs::read(path).unwrap());
    Target { address, when: BTreeSet::from(NoticeKind::RULES), ca_file }
}

/// A program whose lines are read, killed at the end.
pub struct Program {
    child: Child,
    lines: Receiver<String>,
}

impl Program {
    pub fn start(command: &mut Command) -> Self {
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let output = child.stdout.take().unwrap();
        let (sender, lines) = sync_channel(LINES_MAX);
        let read = move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("lines".into()).spawn(read).unwrap();
        Self { child, lines }
    }

    /// The next line, which must come.
    pub fn line(&self) -> String {
        self.lines.recv_timeout(PATIENCE).expect("a line")
    }

    /// Whether a line comes within a moment; it is taken.
    pub fn has_line(&self) -> bool {
        self.lines.recv_timeout(Duration::from_millis(300)).is_ok()
    }

    /// Whether this line comes, with less than ten seconds between lines; those before it are taken.
    pub fn hears(&self, wanted: &str) -> bool {
        let next = || self.lines.recv_timeout(Duration::from_secs(10)).ok();
        std::iter::from_fn(next).any(|line| line == wanted)
    }

    pub fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A port that is free now.
pub fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// Waits until something takes connections at a port.
pub fn wait_for_port(port: u16) {
    let deadline = palpate_test_support::wait::Deadline::new();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(!deadline.is_over(), "nothing at port {port}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A certificate authority of a test and a server's certificate for this computer.
pub struct Certificates {
    pub authority: PathBuf,
    pub certificate: PathBuf,
    pub key: PathBuf,
}

/// Makes certificates; `None` skips the test.
pub fn certificates(folder: &Path) -> Option<Certificates> {
    if lacks_program("openssl") {
        return None;
    }
    std::fs::write(folder.join("names"), "subjectAltName=DNS:localhost,IP:127.0.0.1\n").unwrap();
    for line in [
        "req -x509 -newkey rsa:2048 -nodes -keyout ca.key -out ca.pem -days 2 -subj /CN=test-authority",
        "req -newkey rsa:2048 -nodes -keyout server.key -out server.csr -subj /CN=localhost",
        "x509 -req -in server.csr -CA ca.pem -CAkey ca.key -CAcreateserial -out server.pem -days 2 -extfile names",
    ] {
        let done = Command::new("openssl").args(line.split(' ')).current_dir(folder).output();
        let done = done.expect("openssl runs");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    Some(Certificates {
        authority: folder.join("ca.pem"),
        certificate: folder.join("server.pem"),
        key: folder.join("server.key"),
    })
}

/// Whether Python's mail server is missing; if so the test is skipped.
pub fn lacks_mail_server() -> bool {
    if lacks_program("python3") {
        return true;
    }
    let imports = Command::new("python3").args(["-c", "import aiosmtpd"]).output();
    let is_missing = !imports.is_ok_and(|done| done.status.success());
    if is_missing {
        skip(TestNeed::Python("aiosmtpd"), "python3 does not import it");
    }
    is_missing
}

/// What a web server does with a request.
#[derive(Clone, Copy, Debug)]
pub enum Reaction {
    Answer(u16),
    /// Says nothing and keeps the connection.
    Hang,
    /// Closes after the request without an answer.
    Close,
    /// Closes in the middle of the answer's first line.
    Break,
}

/// A request that a web server got.
#[derive(Debug)]
pub struct WebRequest {
    pub head: String,
    pub object: Value,
}

/// A web server that does one thing after the other and the last thing from then on.
pub struct WebServer {
    pub port: u16,
    pub requests: Receiver<WebRequest>,
}

impl WebServer {
    pub fn start(reactions: &[Reaction]) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let (sender, requests) = sync_channel(LINES_MAX);
        let reactions = reactions.to_vec();
        let serve = move || {
            let mut held = Vec::new();
            for (index, stream) in listener.incoming().flatten().enumerate() {
                let reaction = reactions[index.min(reactions.len() - 1)];
                match react(stream, reaction, &sender) {
                    Some(stream) => held.push(stream),
                    None => continue,
                }
            }
        };
        std::thread::Builder::new().name("web-server".into()).spawn(serve).unwrap();
        Self { port, requests }
    }

    pub fn target(&self) -> Target {
        let url = format!("http://127.0.0.1:{}/hooks/secret-path", self.port);
        let url = url.parse().unwrap();
        target(TargetAddress::Webhook(WebhookTarget { url, token: None }), None)
    }

    pub fn request(&self) -> WebRequest {
        self.requests.recv_timeout(PATIENCE).expect("a request")
    }
}

/// Reads a request and does what is wanted; returns a connection that stays open.
fn react(
    mut stream: TcpStream,
    reaction: Reaction,
    sender: &SyncSender<WebRequest>,
) -> Option<TcpStream> {
    let mut bytes = Vec::new();
    let mut piece = [0; 4096];
    let request = loop {
        let count = stream.read(&mut piece).unwrap_or(0);
        if count == 0 {
            return None;
        }
        bytes.extend_from_slice(&piece[..count]);
        let text = String::from_utf8_lossy(&bytes);
        let Some((head, content)) = text.split_once("\r\n\r\n") else { continue };
        let length = head.lines().find_map(|line| {
            let (name, value) = line.split_once(':')?;
            name.eq_ignore_ascii_case("content-length")
                .then(|| value.trim().parse::<usize>().ok())?
        });
        if content.len() == length.unwrap_or(0) {
            let object = serde_json::from_str(content).unwrap_or_default();
            break WebRequest { head: head.to_owned(), object };
        }
    };
    let _ = sender.try_send(request);
    match reaction {
        Reaction::Answer(code) => {
            let answer =
                format!("HTTP/1.1 {code} Word\r\nlocation: /other\r\ncontent-length: 0\r\n\r\n");
            let _ = stream.write_all(answer.as_bytes());
            None
        }
        Reaction::Hang => Some(stream),
        Reaction::Close => None,
        Reaction::Break => {
            let _ = stream.write_all(b"HTTP/1.");
            None
        }
    }
}
