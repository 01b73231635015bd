//! Connections that carry bytes: a serial port, a TCP connection, a pair of sockets within one program.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::AsFd;
use rustix::io::Errno;
use serialport::SerialPort;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// A connection to a device. An error means that it is gone.
pub trait Link: Send {
    /// Waits so long for bytes, and gives how many there are; 0 when none came in time.
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize>;

    /// Writes all bytes. A device that takes none for [`WRITE_MAX`] is gone.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Tells the device that nothing more will be written, where the link can: the end of a program's input, half of a
    /// TCP connection. What the device still sends can be read.
    fn close_input(&mut self) -> io::Result<()> {
        Err(ErrorKind::Unsupported.into())
    }

    /// Whether it is a program that was started for this link, and ends with it.
    fn is_program(&self) -> bool {
        false
    }
}

/// Nothing that palpate writes is as long as what operating systems keep for a device (4 kB), so a write that waits
/// this long is stuck.
pub const WRITE_MAX: Duration = Duration::from_millis(250);

fn hung_up_error() -> io::Error {
    io::Error::new(ErrorKind::UnexpectedEof, "the device has disconnected")
}

pub struct SerialLink(pub Box<dyn SerialPort>);

impl Link for SerialLink {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.0.set_timeout(wait)?;
        match self.0.read(buffer) {
            Ok(0) => Err(hung_up_error()),
            Ok(count) => Ok(count),
            Err(err) if matches!(err.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            Err(err) => Err(err),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.set_timeout(WRITE_MAX)?;
        self.0.write_all(bytes)
    }
}

/// A link over a socket.
pub struct SocketLink<S>(S);

/// A TCP connection that sends each write at once.
pub type TcpLink = SocketLink<TcpStream>;

/// One end of a wire within the program, for tests and demonstrations; dropping it unplugs the other end.
pub type MemoryLink = SocketLink<PairedStream>;

#[cfg(unix)]
type PairedStream = std::os::unix::net::UnixStream;
#[cfg(not(unix))]
type PairedStream = TcpStream;

#[cfg(unix)]
fn stream_pair() -> io::Result<(PairedStream, PairedStream)> {
    PairedStream::pair()
}

#[cfg(not(unix))]
fn stream_pair() -> io::Result<(PairedStream, PairedStream)> {
    let listener = std::net::TcpListener::bind("127.0.0.1:0")?;
    let one = TcpStream::connect(listener.local_addr()?)?;
    Ok((one, listener.accept()?.0))
}

/// Both ends of a wire.
pub fn memory_link_pair() -> (MemoryLink, MemoryLink) {
    let (one, other) = stream_pair().expect("the operating system has a pair of sockets");
    for end in [&one, &other] {
        end.set_nonblocking(true).expect("a new socket takes its settings");
    }
    (SocketLink(one), SocketLink(other))
}

impl TcpLink {
    pub fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_nonblocking(true)?;
        Ok(Self(stream))
    }
}

impl<S: AsFd> SocketLink<S> {
    /// Over a socket that does not block.
    #[cfg(unix)]
    pub(super) const fn new_nonblocking(stream: S) -> Self {
        Self(stream)
    }

    #[cfg(unix)]
    pub(super) const fn stream(&self) -> &S {
        &self.0
    }

    /// Waits for one of `flags`. `poll` counts nanoseconds where a socket's own timeout counts the kernel's ticks; on Windows it
    /// counts milliseconds.
    fn wait(&self, flags: PollFlags, wait: Duration) -> io::Result<()> {
        let timeout = Timespec::try_from(wait).map_err(|_| ErrorKind::InvalidInput)?;
        let mut watched = [PollFd::from_borrowed_fd(self.0.as_fd(), flags)];
        match poll(&mut watched, Some(&timeout)) {
            Ok(_) | Err(Errno::INTR) => Ok(()),
            Err(err) => Err(err.into()),
        }
    }
}

impl<S: AsFd + Read + Write + Send> Link for SocketLink<S> {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.wait(PollFlags::IN, wait)?;
        match self.0.read(buffer) {
            Ok(0) => Err(hung_up_error()),
            Ok(count) => Ok(count),
            Err(err) if matches!(err.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                Ok(0)
            }
            Err(err) => Err(err),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut rest = bytes;
        let mut is_second_try = false;
        while !rest.is_empty() {
            match self.0.write(rest) {
                Ok(0) => return Err(hung_up_error()),
                Ok(count) => {
                    rest = &rest[count..];
                    is_second_try = false;
                }
                Err(err) if err.kind() == ErrorKind::Interrupted => {}
                Err(err) if err.kind() == ErrorKind::WouldBlock && !is_second_try => {
                    is_second_try = true;
                    self.wait(PollFlags::OUT, WRITE_MAX)?;
                }
                Err(err) if err.kind() == ErrorKind::WouldBlock => {
                    return Err(ErrorKind::TimedOut.into());
                }
                Err(err) => return Err(err),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAIT: Duration = Duration::from_millis(1);

    #[test]
    fn bytes_of_one_end_arrive_at_the_other_until_it_is_unplugged() {
        let (mut here, mut there) = memory_link_pair();
        let mut buffer = [0_u8; 4];
        assert_eq!(there.read(&mut buffer, WAIT).unwrap(), 0);
        here.write(b"STA\r;").unwrap();
        assert_eq!(there.read(&mut buffer, WAIT).unwrap(), 4);
        assert_eq!(&buffer, b"STA\r");
        drop(here);
        // Bytes written before still arrive.
        assert_eq!(there.read(&mut buffer, WAIT).unwrap(), 1);
        assert!(there.read(&mut buffer, WAIT).is_err());
        assert!(there.write(b"x").is_err());
    }

    #[test]
    fn write_to_a_link_that_is_never_read_times_out() {
        let (mut here, _there) = memory_link_pair();
        let result = here.write(&vec![b'x'; 1 << 24]);
        assert_eq!(result.unwrap_err().kind(), ErrorKind::TimedOut);
    }
}
