//! How long something has not come, without the pauses of this computer.

use palpate_model::Nanos;

/// Pauses are excused until they come to so much: a computer that looks too seldom for good would see no silence at all.
/// A single pause is excused whatever its length, because the bytes that have come meanwhile are read after it.
const EXCUSED_MAX: Nanos = Nanos::from_millis(1_000);

/// A wait since a time of the host.
#[derive(Clone, Copy, Debug)]
pub struct Waiting {
    since: Nanos,
    excused: Nanos,
}

impl Waiting {
    pub const fn new(now: Nanos) -> Self {
        Self { since: now, excused: Nanos::ZERO }
    }

    /// This computer did not look for so long.
    pub fn excuse(&mut self, pause: Nanos) {
        if self.excused < EXCUSED_MAX {
            self.excused = self.excused + pause;
            self.since = self.since + pause;
        }
    }

    pub fn time(&self, now: Nanos) -> Nanos {
        now.since(self.since)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pause_is_excused_and_endless_ones_are_not() {
        let ms = Nanos::from_millis;
        let mut waiting = Waiting::new(ms(0));
        waiting.excuse(ms(60_000));
        assert_eq!(waiting.time(ms(60_010)), ms(10));
        let mut waiting = Waiting::new(ms(0));
        for _ in 0..400 {
            waiting.excuse(ms(25));
        }
        assert_eq!(waiting.time(ms(10_000)), ms(9_000));
    }
}
