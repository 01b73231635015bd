//! One connection: HTTP requests until one of them asks for a WebSocket.

use super::InverseService;
use palpate_model::Nanos;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use tungstenite::{Message, WebSocket};

/// Longest head of a request; a longer one ends the connection.
const HEAD_MAX: usize = 8192;

/// Bytes of a client and for it, as a stream that never waits.
#[derive(Debug, Default)]
struct Pipe {
    input: VecDeque<u8>,
    output: Vec<u8>,
}

impl Read for Pipe {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if self.input.is_empty() {
            return Err(ErrorKind::WouldBlock.into());
        }
        self.input.read(to)
    }
}

impl Write for Pipe {
    fn write(&mut self, from: &[u8]) -> io::Result<usize> {
        self.output.extend_from_slice(from);
        Ok(from.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A connection.
#[derive(Default)]
pub struct Channel {
    /// Of a request that is not whole.
    head: Vec<u8>,
    socket: Option<WebSocket<Pipe>>,
    /// Reports and when they leave.
    waiting: VecDeque<(Nanos, String)>,
    output: Vec<u8>,
    is_over: bool,
}

/// A request's path, and whether it asks for a WebSocket; `None` while it is not whole.
struct Request {
    path: String,
    is_upgrade: bool,
}

fn parse_request(head: &[u8]) -> Result<Option<(usize, Request)>, httparse::Error> {
    let mut headers = [httparse::EMPTY_HEADER; 64];
    let mut request = httparse::Request::new(&mut headers);
    let httparse::Status::Complete(length) = request.parse(head)? else {
        return Ok(None);
    };
    let is_upgrade = request.headers.iter().any(|header| {
        header.name.eq_ignore_ascii_case("upgrade")
            && header.value.eq_ignore_ascii_case(b"websocket")
    });
    let path = request.path.unwrap_or("/").to_owned();
    Ok(Some((length, Request { path, is_upgrade })))
}

impl Channel {
    /// Bytes of the client at `now`; what they cause leaves at `due`.
    pub fn receive(
        &mut self,
        (now, due): (Nanos, Nanos),
        bytes: &[u8],
        channel: usize,
        service: &mut InverseService,
    ) {
        if self.is_over {
            return;
        }
        match &mut self.socket {
            Some(socket) => socket.get_mut().input.extend(bytes),
            None => self.head.extend_from_slice(bytes),
        }
        self.read_requests((now, due), channel, service);
        self.read_messages((now, due), channel, service);
    }

    fn read_requests(
        &mut self,
        (now, due): (Nanos, Nanos),
        channel: usize,
        service: &mut InverseService,
    ) {
        while self.socket.is_none() && !self.head.is_empty() {
            match parse_request(&self.head) {
                Ok(Some((length, request))) if !request.is_upgrade => {
                    self.head.drain(..length);
                    let (status, body) = service.get(&request.path);
                    let reason = if status == 200 { "OK" } else { "Not Found" };
                    let answer = format!(
                        "HTTP/1.1 {status} {reason}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
                        body.len()
                    );
                    self.output.extend_from_slice(answer.as_bytes());
                }
                Ok(Some(_)) => {
                    let input = std::mem::take(&mut self.head).into();
                    match tungstenite::accept(Pipe { input, output: Vec::new() }) {
                        Ok(socket) => {
                            self.socket = Some(socket);
                            self.waiting.push_back((due, service.open(now, channel)));
                        }
                        Err(_) => self.is_over = true,
                    }
                }
                Ok(None) if self.head.len() <= HEAD_MAX => return,
                Ok(None) | Err(_) => {
                    self.is_over = true;
                    return;
                }
            }
        }
    }

    fn read_messages(
        &mut self,
        (now, due): (Nanos, Nanos),
        channel: usize,
        service: &mut InverseService,
    ) {
        let Some(socket) = &mut self.socket else {
            return;
        };
        loop {
            match socket.read() {
                Ok(Message::Text(text)) => {
                    let reports = service.receive(now, channel, &text);
                    self.waiting.extend(reports.into_iter().map(|report| (due, report)));
                }
                Ok(Message::Close(_)) => service.close(now, channel),
                Ok(_) => {}
                Err(tungstenite::Error::Io(err)) if err.kind() == ErrorKind::WouldBlock => break,
                Err(_) => {
                    self.is_over = true;
                    break;
                }
            }
        }
    }

    /// Bytes for the client that leave up to `now`.
    pub fn transmit(&mut self, now: Nanos) -> Vec<u8> {
        let mut bytes = std::mem::take(&mut self.output);
        if let Some(socket) = &mut self.socket {
            while self.waiting.front().is_some_and(|(due, _)| *due <= now) {
                let Some((_, text)) = self.waiting.pop_front() else {
                    break;
                };
                if socket.send(Message::text(text)).is_err() {
                    self.is_over = true;
                }
            }
            bytes.append(&mut socket.get_mut().output);
        }
        bytes
    }

    /// Ends the connection without a word.
    pub fn hang_up(&mut self) {
        *self = Self { is_over: true, ..Self::default() };
    }

    /// Whether it has ended since the last call.
    pub fn take_hang_up(&mut self) -> bool {
        std::mem::take(&mut self.is_over)
    }
}
