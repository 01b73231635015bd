//! The time that bytes take: the speed of a serial line, the latency timer of a USB converter, late answers.

use palpate_model::Nanos;
use std::collections::VecDeque;

/// A byte has a start bit, eight bits and a stop bit.
const BITS: u64 = 10;
/// A full packet of a USB converter leaves at once: 64 bytes, two of them status (FTDI AN232B-04).
const PACKET: usize = 62;
/// Bytes under way; more than the longest upload.
const BYTES_MAX: usize = 1 << 20;
/// Bytes that an emulated cell or stand holds for a client.
const OUTBOX_MAX: usize = 4096;

/// Bytes for a client. What does not fit is dropped, as on a line that no client reads.
#[derive(Clone, Debug, Default)]
pub struct Outbox(Vec<u8>);

impl Outbox {
    pub fn push(&mut self, bytes: &[u8]) {
        if self.0.len() + bytes.len() <= OUTBOX_MAX {
            self.0.extend_from_slice(bytes);
        }
    }

    pub fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.0)
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }
}

/// One direction of a line.
#[derive(Clone, Debug)]
pub struct LineDirection {
    nanos_per_byte: u64,
    latency: Nanos,
    free_at: Nanos,
    /// Bytes with their arrival at the converter.
    under_way: VecDeque<(Nanos, u8)>,
    /// Bytes in the converter, and since when.
    held: Vec<u8>,
    held_since: Nanos,
}

impl LineDirection {
    /// A line of `baud` bits a second, without delay if `None`, behind a converter that holds an incomplete packet for
    /// `latency`.
    pub fn new(baud: Option<u32>, latency: Nanos) -> Self {
        Self {
            nanos_per_byte: baud.map_or(0, |baud| BITS * 1_000_000_000 / u64::from(baud.max(1))),
            latency,
            free_at: Nanos::ZERO,
            under_way: VecDeque::new(),
            held: Vec::new(),
            held_since: Nanos::ZERO,
        }
    }

    /// Sends bytes, which arrive later than usual by `lateness`.
    pub fn push(&mut self, now: Nanos, bytes: &[u8], lateness: Nanos) {
        if self.under_way.len() + bytes.len() > BYTES_MAX {
            return;
        }
        for byte in bytes {
            self.free_at = self.free_at.max(now) + Nanos(self.nanos_per_byte);
            let arrival = self.free_at + lateness;
            // Late bytes delay those behind them.
            let newest = self.under_way.back().map_or(Nanos::ZERO, |(at, _)| *at);
            self.under_way.push_back((arrival.max(newest), *byte));
        }
    }

    /// Bytes that have arrived at the other end.
    pub fn take(&mut self, now: Nanos) -> Vec<u8> {
        let mut out = Vec::new();
        while let Some((at, byte)) = self.under_way.front().copied().filter(|(at, _)| *at <= now) {
            self.under_way.pop_front();
            self.release(at, &mut out);
            if self.held.is_empty() {
                self.held_since = at;
            }
            self.held.push(byte);
            if self.held.len() >= PACKET {
                out.append(&mut self.held);
            }
        }
        self.release(now, &mut out);
        out
    }

    /// Passes on the packet of the converter once its timer has run out.
    fn release(&mut self, now: Nanos, out: &mut Vec<u8>) {
        if now >= self.held_since + self.latency {
            out.append(&mut self.held);
        }
    }

    /// Time of the next arrival, if anything is under way.
    pub fn next_at(&self) -> Option<Nanos> {
        let held = (!self.held.is_empty()).then(|| self.held_since + self.latency);
        let coming = self.under_way.front().map(|(at, _)| *at);
        match (held, coming) {
            (Some(held), Some(coming)) => Some(held.min(coming)),
            (held, coming) => held.or(coming),
        }
    }

    pub fn clear(&mut self) {
        self.under_way.clear();
        self.held.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_without_speed_delivers_at_once() {
        let mut line = LineDirection::new(None, Nanos::ZERO);
        line.push(Nanos(5), b"abc", Nanos::ZERO);
        assert_eq!(line.next_at(), Some(Nanos(5)));
        assert_eq!(line.take(Nanos(5)), b"abc");
        assert_eq!(line.next_at(), None);
    }

    #[test]
    fn slow_line_delivers_byte_by_byte() {
        let mut line = LineDirection::new(Some(10_000), Nanos::ZERO);
        line.push(Nanos(0), b"abc", Nanos::ZERO);
        assert_eq!(line.take(Nanos(999_999)), b"");
        assert_eq!(line.take(Nanos(2_000_000)), b"ab");
        assert_eq!(line.take(Nanos(3_000_000)), b"c");
    }

    #[test]
    fn converter_waits_for_full_packet_or_timer() {
        let mut line = LineDirection::new(None, Nanos(16_000_000));
        line.push(Nanos(1_000_000), &[b'x'; 70], Nanos::ZERO);
        assert_eq!(line.take(Nanos(1_000_000)).len(), 62);
        assert_eq!(line.next_at(), Some(Nanos(17_000_000)));
        assert_eq!(line.take(Nanos(16_999_999)).len(), 0);
        assert_eq!(line.take(Nanos(17_000_000)).len(), 8);
    }

    #[test]
    fn late_bytes_are_not_overtaken() {
        let mut line = LineDirection::new(None, Nanos::ZERO);
        line.push(Nanos(0), b"a", Nanos(100));
        line.push(Nanos(10), b"b", Nanos::ZERO);
        assert_eq!(line.take(Nanos(99)), b"");
        assert_eq!(line.take(Nanos(100)), b"ab");
    }
}
