//! Record arrays: `RA`, `RD`, `RC`.

use palpate_drivers::galil::ErrorCode;

/// Arrays recorded at once (DMC-1700/1800 user manual, page 159).
const ARRAYS_MAX: usize = 8;
/// `RC n`: one sample in 2^n, n up to 8 (DMC-1600 user manual, page 142).
const INTERVAL_MAX: f64 = 8.0;

/// Which number an array records.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RecordSource {
    /// `TIME`.
    Time,
    /// An analog input, in counts.
    Analog(usize),
    /// Two letters and an axis.
    Axis(String, usize),
    /// `_TI`, `_OP` and others without an axis.
    Controller(String),
}

/// What is recorded, where, and how far it is.
#[derive(Clone, Debug, Default)]
pub struct ArrayRecorder {
    /// Names of `RA`.
    pub arrays: Vec<String>,
    /// Sources of `RD`.
    pub sources: Vec<RecordSource>,
    /// Samples from one element to the next; 0 while nothing is recorded.
    interval: u64,
    /// Elements recorded before it ends.
    length: usize,
    is_circular: bool,
    /// The next element: `_RD`.
    pub next: usize,
    started: u64,
}

impl ArrayRecorder {
    /// `_RC`.
    pub fn is_running(&self) -> bool {
        self.interval > 0
    }

    /// `RC 0`.
    pub fn stop(&mut self) {
        self.interval = 0;
    }

    fn check_change(&self, count: usize) -> Result<(), ErrorCode> {
        match count {
            _ if self.is_running() => Err(ErrorCode::RECORDING),
            ..=ARRAYS_MAX => Ok(()),
            _ => Err(ErrorCode::TOO_MANY_ELEMENTS),
        }
    }

    /// `RA`.
    pub fn set_arrays(&mut self, names: Vec<String>) -> Result<(), ErrorCode> {
        self.check_change(names.len())?;
        self.arrays = names;
        Ok(())
    }

    /// `RD`.
    pub fn set_sources(&mut self, sources: Vec<RecordSource>) -> Result<(), ErrorCode> {
        self.check_change(sources.len())?;
        self.sources = sources;
        Ok(())
    }

    /// `RC n,m` at a sample: `shortest` is the length of the smallest array; without `m` that many, a negative `m`
    /// goes round.
    pub fn start(
        &mut self,
        n: f64,
        m: Option<f64>,
        shortest: usize,
        now: u64,
    ) -> Result<(), ErrorCode> {
        if self.is_running() {
            return Err(ErrorCode::RECORDING);
        }
        if self.arrays.is_empty() || self.arrays.len() != self.sources.len() {
            return Err(ErrorCode::NO_SOURCE);
        }
        if !(1.0..=INTERVAL_MAX).contains(&n) || n.fract() != 0.0 {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        let wanted = m.unwrap_or(0.0);
        if wanted.abs() > shortest as f64 {
            return Err(ErrorCode::TOO_MANY_ELEMENTS);
        }
        self.length = if wanted == 0.0 { shortest } else { wanted.abs() as usize };
        self.interval = 1 << n as u32;
        self.is_circular = wanted < 0.0;
        self.next = 0;
        self.started = now;
        Ok(())
    }

    /// The element to be written at a sample, if one is due; the last one ends the recording.
    pub fn due(&mut self, now: u64) -> Option<usize> {
        if !self.is_running() || !(now - self.started).is_multiple_of(self.interval) {
            return None;
        }
        let at = self.next;
        self.next += 1;
        if self.next == self.length {
            if self.is_circular {
                self.next = 0;
            } else {
                self.interval = 0;
            }
        }
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ready() -> ArrayRecorder {
        let mut recorder = ArrayRecorder::default();
        recorder.set_arrays(vec!["a".into(), "b".into()]).unwrap();
        recorder.set_sources(vec![RecordSource::Time, RecordSource::Analog(0)]).unwrap();
        recorder
    }

    #[test]
    fn every_second_sample_until_it_is_full() {
        let mut recorder = ready();
        recorder.start(1.0, None, 5, 1000).unwrap();
        let due: Vec<_> = (1001..1100).filter_map(|now| Some((now, recorder.due(now)?))).collect();
        assert_eq!(due, [(1002, 0), (1004, 1), (1006, 2), (1008, 3), (1010, 4)]);
        assert!(!recorder.is_running());
        assert_eq!(recorder.next, 5);
    }

    #[test]
    fn a_negative_number_goes_round() {
        let mut recorder = ready();
        recorder.start(3.0, Some(-2.0), 5, 0).unwrap();
        let due: Vec<_> = (1..=32).filter_map(|now| recorder.due(now)).collect();
        assert_eq!(due, [0, 1, 0, 1]);
        assert!(recorder.is_running());
        assert_eq!(recorder.start(1.0, None, 5, 40), Err(ErrorCode::RECORDING));
        assert_eq!(recorder.set_arrays(Vec::new()), Err(ErrorCode::RECORDING));
        recorder.stop();
        assert_eq!(recorder.due(40), None);
    }

    #[test]
    fn mistakes_have_their_numbers() {
        let mut recorder = ArrayRecorder::default();
        assert_eq!(recorder.start(1.0, None, 5, 0), Err(ErrorCode::NO_SOURCE));
        recorder = ready();
        assert_eq!(recorder.start(9.0, None, 5, 0), Err(ErrorCode::OUT_OF_RANGE));
        assert_eq!(recorder.start(1.0, Some(6.0), 5, 0), Err(ErrorCode::TOO_MANY_ELEMENTS));
        recorder.set_sources(vec![RecordSource::Time]).unwrap();
        assert_eq!(recorder.start(1.0, None, 5, 0), Err(ErrorCode::NO_SOURCE));
    }
}
