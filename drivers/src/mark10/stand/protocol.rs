//! Commands to the stand and its answers (ESM301 user's guide, page 24; ESM303 user's guide, pages 31 and 32).
//!
//! Commands are single small letters, some with a number of a fixed form, and have no end. The guides do not show the
//! answers. What is taken here, and is to be confirmed on a device: every answer is a line that ends with CR LF; `n`
//! gives the reading of the gauge, then the travel, a line each; numbers may have a unit behind them; commands that
//! set something are silent. Lower and upper limits say that travel grows upwards.

use crate::mark10::protocol::{FixedDecimal, GaugeForce, GaugeLine};

pub const STOP: &str = "s";
/// Highest speed that can be written, in tenths of mm/min.
const SPEED_MAX: i64 = 99_999;
/// Furthest limit that can be written, in hundredths of mm.
const LIMIT_MAX: i64 = 99_999;
const INCH: f64 = 25.4;

/// `e0200.3`: the speed in tenths of mm/min; `None` when it has no such form.
#[must_use]
pub fn set_speed(tenths: i64) -> Option<String> {
    (1..=SPEED_MAX).contains(&tenths).then(|| format!("e{:04}.{}", tenths / 10, tenths % 10))
}

/// `g-007.52` or `h010.70`: the lower or upper limit in hundredths of mm; `None` when it has no such form.
#[must_use]
pub fn set_limit(is_upper: bool, hundredths: i64) -> Option<String> {
    let letter = if is_upper { 'h' } else { 'g' };
    let sign = if hundredths < 0 { "-" } else { "" };
    let size = hundredths.abs();
    (size <= LIMIT_MAX).then(|| format!("{letter}{sign}{:03}.{:02}", size / 100, size % 100))
}

/// Asks for the limit that [`set_limit`] sets.
#[must_use]
pub const fn ask_limit(is_upper: bool) -> &'static str {
    if is_upper { "v" } else { "w" }
}

#[must_use]
pub fn to_gauge(command: &str) -> String {
    format!("/{command}\r\\")
}

/// The answer to `p`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StandStatus {
    /// The crosshead goes up (`U`) or down (`D`); `S` is stopped.
    pub is_moving: bool,
    /// Whether it keeps to its travel limits (`L`); `None` when it does not report it.
    pub is_limit_mode: Option<bool>,
    pub is_at_upper: bool,
    pub is_at_lower: bool,
}

impl StandStatus {
    /// Reads the letters, whatever stands between them: crosshead, mode, limit switch, in the order of the guide.
    #[must_use]
    pub fn parse(line: &str) -> Option<Self> {
        let is_filler = |c: char| matches!(c, ' ' | ',' | ';' | '\t');
        let letters: String = line.chars().filter(|c| !is_filler(*c)).collect();
        let mut rest = letters.chars();
        let is_moving = match rest.next()? {
            'U' | 'D' => true,
            'S' => false,
            _ => return None,
        };
        let rest = rest.as_str();
        let (is_limit_mode, rest) = match rest.chars().next() {
            Some('L') => (Some(true), &rest[1..]),
            Some('C' | 'M') => (Some(false), &rest[1..]),
            _ => (None, rest),
        };
        if !matches!(rest, "" | "UL" | "DL") {
            return None;
        }
        Some(Self {
            is_moving,
            is_limit_mode,
            is_at_upper: rest == "UL",
            is_at_lower: rest == "DL",
        })
    }
}

/// A travel with its unit, in hundredths of mm: `-7.52 mm`, `0.125 in`.
#[must_use]
pub fn travel(line: &str) -> Option<i64> {
    let (number, unit) = line.trim().split_once(' ')?;
    let number = FixedDecimal::parse(number)?.value();
    match unit.trim() {
        "mm" => Some((number * 100.0).round() as i64),
        "in" => Some((number * INCH * 100.0).round() as i64),
        _ => None,
    }
}

/// A number that was asked for, with whatever unit behind it.
#[must_use]
pub fn number(line: &str) -> Option<f64> {
    let number = line.trim().split(' ').next()?;
    FixedDecimal::parse(number).map(FixedDecimal::value)
}

/// Reads the two lines of `n` out of lines that come one by one.
#[derive(Clone, Debug, Default)]
pub struct ForceTravelPair {
    force: Option<GaugeForce>,
}

impl ForceTravelPair {
    /// The next line: a force and the travel behind it make a pair. Others are thrown away, as is a force that another
    /// one follows: a gauge that still sends by itself.
    pub fn take(&mut self, line: &str) -> Option<(GaugeForce, i64)> {
        if let Some(travel) = travel(line) {
            return self.force.take().map(|force| (force, travel));
        }
        self.force = GaugeLine::parse(line).force();
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_have_the_form_of_the_guide() {
        // ESM301 user's guide, page 24; ESM303 user's guide, page 31.
        assert_eq!(set_speed(2003).as_deref(), Some("e0200.3"));
        assert_eq!(set_limit(false, -752).as_deref(), Some("g-007.52"));
        assert_eq!(set_limit(false, 1070).as_deref(), Some("g010.70"));
        assert_eq!(set_limit(true, -752).as_deref(), Some("h-007.52"));
        assert_eq!(set_limit(true, 1070).as_deref(), Some("h010.70"));
        assert_eq!(set_limit(true, -5).as_deref(), Some("h-000.05"));
        assert_eq!(
            (set_limit(true, 100_000), set_speed(0), set_speed(100_000)),
            (None, None, None)
        );
        assert_eq!(to_gauge("N"), "/N\r\\");
    }

    #[test]
    fn status_is_read_from_its_letters() {
        let parsed = |line: &str| {
            StandStatus::parse(line)
                .map(|s| (s.is_moving, s.is_limit_mode, s.is_at_upper, s.is_at_lower))
        };
        for line in ["SLUL", "S L UL", "S,L,UL"] {
            assert_eq!(parsed(line), Some((false, Some(true), true, false)), "{line}");
        }
        assert_eq!(parsed("UL"), Some((true, Some(true), false, false)));
        assert_eq!(parsed("DM"), Some((true, Some(false), false, false)));
        assert_eq!(parsed("S"), Some((false, None, false, false)));
        assert_eq!(parsed("SDL"), Some((false, None, false, true)));
        for wrong in ["", "L", "X", "SX", "4.285 N", "SLU"] {
            assert_eq!(parsed(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_pair_is_a_force_and_the_travel_behind_it() {
        let mut pair = ForceTravelPair::default();
        let found: Vec<i64> = [
            "99.0 N",
            "2.500 lbF",
            "0.125 in",
            "1.00 mm",
            "*10",
            "-4.285 N",
            "-7.52 mm",
            "1.0 N",
            "x",
        ]
        .iter()
        .filter_map(|line| pair.take(line))
        .map(|(_, travel)| travel)
        .collect();
        assert_eq!(found, [318, -752]);
        assert_eq!(pair.take("OVER"), None);
        assert_eq!(pair.take("0.01 mm"), Some((GaugeForce::Overload, 1)));
    }
}
