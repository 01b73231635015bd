//! The WebSocket to the service: opened with a limit, then never waited for.

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;
use tungstenite::{Error, Message, WebSocket};

/// Longest time to connect, to agree on WebSocket and to get the inventory.
const OPENING_MAX: Duration = Duration::from_millis(500);

/// Frames in which the inventory must be.
const OPENING_FRAMES: usize = 16;

/// An open connection.
pub struct Link {
    socket: WebSocket<TcpStream>,
}

fn wrong(text: impl ToString) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, text.to_string())
}

impl Link {
    /// Connects and takes the inventory, the first message of the service.
    pub fn open(address: SocketAddr) -> io::Result<(Self, String)> {
        let stream = TcpStream::connect_timeout(&address, OPENING_MAX)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(OPENING_MAX))?;
        stream.set_write_timeout(Some(OPENING_MAX))?;
        let url = format!("ws://{address}/");
        let (mut socket, _) = tungstenite::client(url, stream).map_err(wrong)?;
        let mut first = None;
        for _ in 0..OPENING_FRAMES {
            if let Message::Text(text) = socket.read().map_err(wrong)? {
                first = Some(text.to_string());
                break;
            }
        }
        let inventory = first.ok_or_else(|| wrong("no inventory comes"))?;
        socket.get_ref().set_nonblocking(true)?;
        Ok((Self { socket }, inventory))
    }

    /// The next message if one is there. Of a frame that is none nothing is waited for: a service that pings without end must not keep a
    /// zero from being sent.
    pub fn receive(&mut self) -> io::Result<Option<String>> {
        match self.socket.read() {
            Ok(Message::Text(text)) => Ok(Some(text.to_string())),
            Ok(Message::Close(_)) => Err(ErrorKind::ConnectionAborted.into()),
            Ok(_) => Ok(None),
            Err(Error::Io(err)) if err.kind() == ErrorKind::WouldBlock => Ok(None),
            Err(err) => Err(wrong(err)),
        }
    }

    /// Sends a message; what the system has no room for waits for the next call.
    pub fn send(&mut self, text: &str) -> io::Result<()> {
        match self.socket.send(Message::text(text)) {
            Ok(()) => Ok(()),
            Err(Error::Io(err)) if err.kind() == ErrorKind::WouldBlock => Ok(()),
            Err(err) => Err(wrong(err)),
        }
    }

    /// Says goodbye. The service needs no answer, and none is waited for.
    pub fn close(mut self) {
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    /// All has arrived before the first look, and yet each look takes one frame.
    #[test]
    fn a_look_takes_one_frame_whatever_a_service_sends() {
        const PINGS: usize = 100;
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let thread = std::thread::Builder::new().name("pinging service".into());
        let service = thread.spawn(move || {
            let mut socket = tungstenite::accept(listener.accept().unwrap().0).unwrap();
            socket.send(Message::text("inventory")).unwrap();
            for _ in 0..PINGS {
                socket.send(Message::Ping(Vec::new().into())).unwrap();
            }
            socket.send(Message::text("report")).unwrap();
            socket
        });
        let service = service.unwrap();
        let (mut link, inventory) = Link::open(address).unwrap();
        assert_eq!(inventory, "inventory");
        let _socket = service.join().unwrap();
        let mut empty = 0;
        let report = loop {
            match link.receive().unwrap() {
                Some(report) => break report,
                None => empty += 1,
            }
        };
        assert_eq!(report, "report");
        assert!(empty >= PINGS, "{empty}");
    }
}
