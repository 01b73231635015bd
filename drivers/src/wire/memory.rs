//! Two ends of a wire within one program, for tests and demonstrations.

use super::link::Link;
use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Bytes that may be under way, as many as an operating system keeps for a serial port.
const BYTES_MAX: usize = 4096;

#[derive(Default)]
struct Pipe {
    bytes: VecDeque<u8>,
    is_closed: bool,
}

type Shared = Arc<(Mutex<Pipe>, Condvar)>;

/// One end; dropped it is unplugged.
pub struct MemoryLink {
    incoming: Shared,
    outgoing: Shared,
}

#[must_use]
pub fn pair() -> (MemoryLink, MemoryLink) {
    let (one, other) = (Shared::default(), Shared::default());
    let first = MemoryLink { incoming: Arc::clone(&one), outgoing: Arc::clone(&other) };
    let second = MemoryLink { incoming: other, outgoing: one };
    (first, second)
}

impl Link for MemoryLink {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let (pipe, came) = &*self.incoming;
        let pipe = pipe.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut pipe, _) = came
            .wait_timeout_while(pipe, wait, |pipe| pipe.bytes.is_empty() && !pipe.is_closed)
            .unwrap_or_else(PoisonError::into_inner);
        if pipe.bytes.is_empty() && pipe.is_closed {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        let count = pipe.bytes.len().min(buffer.len());
        for (place, byte) in buffer.iter_mut().zip(pipe.bytes.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let (pipe, came) = &*self.outgoing;
        let mut pipe = pipe.lock().unwrap_or_else(PoisonError::into_inner);
        if pipe.is_closed {
            return Err(ErrorKind::BrokenPipe.into());
        }
        if pipe.bytes.len() + bytes.len() > BYTES_MAX {
            return Err(ErrorKind::TimedOut.into());
        }
        pipe.bytes.extend(bytes);
        came.notify_all();
        Ok(())
    }
}

impl Drop for MemoryLink {
    fn drop(&mut self) {
        for shared in [&self.incoming, &self.outgoing] {
            let (pipe, came) = &**shared;
            pipe.lock().unwrap_or_else(PoisonError::into_inner).is_closed = true;
            came.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAIT: Duration = Duration::from_millis(1);

    #[test]
    fn what_one_end_writes_the_other_reads_until_it_is_unplugged() {
        let (mut here, mut there) = pair();
        let mut buffer = [0_u8; 4];
        assert_eq!(there.read(&mut buffer, WAIT).unwrap(), 0);
        here.write(b"STA\r;").unwrap();
        assert_eq!(there.read(&mut buffer, WAIT).unwrap(), 4);
        assert_eq!(&buffer, b"STA\r");
        drop(here);
        // What was written before is still there.
        assert_eq!(there.read(&mut buffer, WAIT).unwrap(), 1);
        assert!(there.read(&mut buffer, WAIT).is_err());
        assert!(there.write(b"x").is_err());
    }

    #[test]
    fn a_wire_that_nobody_reads_fills_up() {
        let (mut here, _there) = pair();
        here.write(&[b'x'; BYTES_MAX]).unwrap();
        assert_eq!(here.write(b"x").unwrap_err().kind(), ErrorKind::TimedOut);
    }
}
