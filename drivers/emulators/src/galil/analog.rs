//! Analog inputs: ranges, converter, and which of them the load cell is on.

use palpate_drivers::galil::ErrorCode;

/// Analog inputs of a controller that has them.
pub const INPUTS: usize = 8;

/// A converter with so many bits, and the range of each input.
#[derive(Clone, Debug)]
pub struct Analog {
    bits: u32,
    ranges: [i8; INPUTS],
}

impl Analog {
    /// All inputs at +-10 V, range 2, the first setting of `AQ`.
    pub fn new(bits: u32) -> Self {
        Self { bits, ranges: [2; INPUTS] }
    }

    /// `_AQn`; inputs count from 0 here.
    pub fn range(&self, input: usize) -> Option<f64> {
        self.ranges.get(input).map(|range| f64::from(*range))
    }

    /// `AQ n,m`: 1 is +-5 V, 2 is +-10 V, 3 is 0 to 5 V, 4 is 0 to 10 V; negative makes a pair of an odd input and
    /// the next.
    pub fn set_range(&mut self, input: f64, range: f64) -> Result<(), ErrorCode> {
        let is_input = (1.0..=INPUTS as f64).contains(&input);
        let is_range = (1.0..=4.0).contains(&range.abs()) && range.fract() == 0.0;
        let is_pair = range > 0.0 || input as usize % 2 == 1;
        if !(is_input && is_range && is_pair) {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        self.ranges[input as usize - 1] = range as i8;
        Ok(())
    }

    /// The reading of an input in volts, to the converter's resolution. The second of a pair is at zero.
    pub fn volts(&self, input: usize, signal: f64) -> f64 {
        let (low, span) = self.span(input);
        let step = span / f64::from(1_u32 << self.bits);
        let steps = ((signal - low) / step).round();
        low + step * steps.clamp(0.0, f64::from((1_u32 << self.bits) - 1))
    }

    /// The 16-bit number that data records and record arrays hold: signed where the range has two sides, unsigned
    /// where it has one, whatever the converter's bits (drvGalil of EPICS, `GalilController.cpp`).
    pub fn counts(&self, input: usize, signal: f64) -> u16 {
        let (low, span) = self.span(input);
        let counts = self.volts(input, signal) / span * 65_536.0;
        if low < 0.0 {
            // Casts saturate.
            (counts.round() as i16).cast_unsigned()
        } else {
            counts.round() as u16
        }
    }

    /// Lower end and width of an input's range, in volts.
    fn span(&self, input: usize) -> (f64, f64) {
        match self.ranges.get(input).map_or(2, |range| range.abs()) {
            1 => (-5.0, 10.0),
            3 => (0.0, 5.0),
            4 => (0.0, 10.0),
            _ => (-10.0, 20.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolution_is_range_over_counts() {
        let coarse = Analog::new(12);
        assert_eq!(coarse.volts(0, 0.003), 20.0 / 4096.0);
        assert_eq!(coarse.volts(0, 0.002), 0.0);
        let mut fine = Analog::new(16);
        assert_eq!(fine.volts(0, 99.0), 10.0 - 20.0 / 65_536.0);
        assert_eq!(fine.volts(0, -99.0), -10.0);
        assert_eq!(fine.counts(0, 5.0), 16_384);
        assert_eq!(fine.counts(0, -5.0), (-16_384_i16).cast_unsigned());
        fine.set_range(1.0, 4.0).unwrap();
        assert_eq!(fine.volts(0, -1.0), 0.0);
        assert_eq!(fine.counts(0, 5.0), 32_768);
        assert_eq!(fine.range(0), Some(4.0));
    }

    #[test]
    fn ranges_that_are_none_are_refused() {
        let mut analog = Analog::new(16);
        for (input, range) in
            [(0.0, 2.0), (9.0, 2.0), (1.0, 5.0), (1.0, 0.0), (2.0, -2.0), (1.0, 1.5)]
        {
            assert_eq!(analog.set_range(input, range), Err(ErrorCode::OUT_OF_RANGE));
        }
        assert_eq!(analog.set_range(1.0, -2.0), Ok(()));
    }
}
