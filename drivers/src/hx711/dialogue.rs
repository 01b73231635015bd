//! An HX711 board in progress: it sends values by itself.

use super::protocol::{COUNT_MAX, COUNT_MIN, Header, Message, NO_CHIP, parse};
use crate::board_clock::{BoardClock, BoardTime};
use crate::cell::{CellProtocol, CellReports, LineCell};
use palpate_model::Nanos;

/// Ten conversions of the slow chip: longer than an answer of the board can be late.
const SILENCE_MAX: Nanos = Nanos::from_millis(1_000);
/// `micros()`.
const NANOS_PER_TICK: u64 = 1_000;
const RESTARTED: &str = "the HX711 board has restarted; check its supply";

pub type Hx711Dialogue = LineCell<Hx711LineReader>;

pub struct Hx711LineReader {
    header: Header,
    volts_per_count: f64,
    clock: BoardClock,
    is_missing: bool,
    other: Option<String>,
}

impl Hx711Dialogue {
    /// Goes on with the board of a header from `now`.
    #[must_use]
    pub fn new(header: Header, volts_per_count: f64, now: Nanos) -> Self {
        let lines = Hx711LineReader {
            header,
            volts_per_count,
            clock: BoardClock::new(NANOS_PER_TICK),
            is_missing: false,
            other: None,
        };
        Self::start(lines, now)
    }
}

impl Hx711LineReader {
    /// `false` for a value that was there already.
    fn value(&mut self, now: Nanos, micros: u32, count: i32, reports: &mut CellReports) -> bool {
        let time = match self.clock.take(now, micros) {
            BoardTime::Repeated => return false,
            BoardTime::At(time) => time,
            BoardTime::Restarted(time) => {
                // The line that reports it was lost.
                reports.push_trouble(RESTARTED);
                time
            }
        };
        self.is_missing = false;
        let is_beyond = count == COUNT_MIN || count == COUNT_MAX;
        reports.set_beyond_range(
            is_beyond,
            "the bridge's signal is beyond the HX711's range; check the cell's wires, or set gain 64 in the sketch",
        );
        reports.push_counts(now, Some(time), count, self.volts_per_count);
        true
    }

    fn check(&mut self, header: Header) {
        if header.board != self.header.board || header.gain != self.header.gain {
            self.other = Some(format!(
                "another HX711 board answers: '{}' with gain {} instead of '{}' with gain {}; check the cables and open the rig again",
                header.board, header.gain, self.header.board, self.header.gain
            ));
        }
    }
}

impl CellProtocol for Hx711LineReader {
    fn take(&mut self, now: Nanos, line: &str, reports: &mut CellReports) -> bool {
        match parse(line) {
            Some(Message::Value { micros, count }) => {
                return self.value(now, micros, count, reports);
            }
            Some(Message::Started { micros, header }) => {
                reports.push_trouble(RESTARTED);
                self.clock.restart(now, micros);
                self.check(header);
            }
            Some(Message::Header { header, .. }) => self.check(header),
            Some(Message::Missing { .. }) => {
                if !std::mem::replace(&mut self.is_missing, true) {
                    reports.push_trouble(NO_CHIP);
                }
            }
            None => return false,
        }
        true
    }

    fn is_dead(&self, now: Nanos, newest: Nanos) -> Option<String> {
        if self.other.is_some() {
            return self.other.clone();
        }
        if now.since(newest) <= SILENCE_MAX {
            return None;
        }
        Some(if self.is_missing {
            NO_CHIP.into()
        } else {
            "the HX711 board has sent no value for a second; check its cable and supply".into()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::protocol::line;
    use super::*;
    use crate::cell::CellDialogue;

    fn header(board: &str) -> Header {
        Header { rate: 80, gain: 128, board: board.into() }
    }

    fn dialogue() -> Hx711Dialogue {
        Hx711Dialogue::new(header("a"), 5.0 / f64::from(1 << 23), Nanos::ZERO)
    }

    fn ms(ms: u64) -> Nanos {
        Nanos::from_millis(ms)
    }

    fn say(to: &mut Hx711Dialogue, at: Nanos, message: &Message) {
        to.handle_bytes(at, line(message).as_bytes());
    }

    fn value(micros: u32, count: i32) -> Message {
        Message::Value { micros, count }
    }

    #[test]
    fn the_clock_of_the_board_wraps_and_its_time_does_not() {
        let mut dialogue = dialogue();
        let mut micros = u32::MAX - 30_000;
        let mut times = Vec::new();
        for i in 0..6 {
            say(&mut dialogue, ms(12 * i + 12), &value(micros, 5));
            micros = micros.wrapping_add(12_500);
            times.push(dialogue.take_sample().unwrap().device_time.unwrap());
        }
        assert!(times.windows(2).all(|w| w[1].since(w[0]) == Nanos(12_500_000)));
        assert_eq!(dialogue.take_trouble(), None);
    }

    #[test]
    fn restart_is_reported_and_time_goes_on() {
        let mut dialogue = dialogue();
        say(&mut dialogue, ms(10), &value(900_000_000, 5));
        say(&mut dialogue, ms(500), &Message::Started { micros: 1_000, header: header("a") });
        say(&mut dialogue, ms(513), &value(13_500, 6));
        let times = [(); 2].map(|()| dialogue.take_sample().unwrap().device_time.unwrap());
        assert_eq!(times[1].since(times[0]), Nanos(490_000_000 + 12_500_000));
        assert!(dialogue.take_trouble().unwrap().contains("restarted"));
        // The line that reports it may be lost.
        say(&mut dialogue, ms(600), &value(700, 6));
        assert!(dialogue.take_trouble().unwrap().contains("restarted"));
        let last = dialogue.take_sample().unwrap().device_time.unwrap();
        assert_eq!(last.since(times[1]), Nanos(87_000_000));
    }

    #[test]
    fn a_host_that_stood_still_is_no_restart() {
        let mut dialogue = dialogue();
        say(&mut dialogue, ms(10), &value(1_000, 5));
        for i in 1..=400_u32 {
            say(&mut dialogue, ms(5_010), &value(1_000 + 12_500 * i, 5));
        }
        say(&mut dialogue, ms(5_020), &value(1_000 + 12_500 * 401, 5));
        assert_eq!(dialogue.take_trouble(), None);
    }

    #[test]
    fn value_beyond_range_and_missing_chip_are_reported_once() {
        let mut dialogue = dialogue();
        for i in 0..3 {
            say(&mut dialogue, ms(12 * i), &value(12_500 * i as u32 + 1, COUNT_MAX));
        }
        let sample = dialogue.take_sample().unwrap();
        assert!((sample.volts.0 - 5.0).abs() < 1e-6 && sample.counts == COUNT_MAX);
        assert!(dialogue.take_trouble().unwrap().contains("range"));
        assert_eq!(dialogue.take_trouble(), None);
        for i in 0..3_u32 {
            let micros = 600_000 + 500_000 * i;
            say(&mut dialogue, ms(600 + 500 * u64::from(i)), &Message::Missing { micros });
        }
        assert!(dialogue.take_trouble().unwrap().contains("DOUT"));
        assert_eq!(dialogue.take_trouble(), None);
        assert!(dialogue.is_dead(ms(1_000)).is_none());
        assert!(dialogue.is_dead(ms(1_600)).unwrap().contains("DOUT"));
        say(&mut dialogue, ms(1_700), &value(1_700_000, 1));
        assert!(dialogue.is_dead(ms(1_710)).is_none());
        assert!(dialogue.is_dead(ms(2_800)).unwrap().contains("no value"));
    }

    #[test]
    fn another_board_in_its_place_ends_it() {
        let mut dialogue = dialogue();
        let other = Message::Started { micros: 9, header: header("b") };
        say(&mut dialogue, ms(1), &other);
        assert!(dialogue.is_dead(ms(2)).unwrap().contains("another HX711 board"));
    }

    #[test]
    fn a_line_that_came_twice_is_one_value() {
        let mut dialogue = dialogue();
        for _ in 0..2 {
            say(&mut dialogue, ms(1), &value(1_000, 5));
        }
        dialogue.handle_bytes(ms(2), b"D,2000,5*0000\r\n\xff\r\n");
        assert!(dialogue.take_sample().is_some() && dialogue.take_sample().is_none());
        assert_eq!(dialogue.garbled(), 3);
    }
}
