//! The numbered settings (gnea/grbl, doc/markdown/settings.md).

use std::collections::BTreeMap;

/// After `$RST=*` (doc/markdown/interface.md, print-out of `$$`; `$10` as in defaults.h of 1.1h).
const FACTORY: &str = "0=10 1=25 2=0 3=0 4=0 5=0 6=0 10=1 11=0.010 12=0.002 13=0 20=0 21=0 22=0 23=0 24=25 25=500 \
    26=250 27=1 30=1000 31=0 32=0 100=250 101=250 102=250 110=500 111=500 112=500 120=10 121=10 122=10 130=200 \
    131=200 132=200";

/// What the slide of this bench needs: a motor that stays on, steps, speed, acceleration and travel.
const SLIDE: [(u16, f64); 6] =
    [(1, 255.0), (23, 1.0), (100, 400.0), (110, 1500.0), (120, 60.0), (130, 150.0)];

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Eeprom {
    values: BTreeMap<u16, f64>,
    /// The text of `$I=`.
    pub build_info: String,
    /// `$N0` and `$N1`.
    pub startup: [String; 2],
}

impl Eeprom {
    /// After `$RST=*`.
    pub fn factory() -> Self {
        Self {
            values: FACTORY
                .split_whitespace()
                .filter_map(|line| line.split_once('='))
                .filter_map(|(number, value)| Some((number.parse().ok()?, value.parse().ok()?)))
                .collect(),
            ..Self::default()
        }
    }

    /// Set up for the slide.
    pub fn slide() -> Self {
        let mut eeprom = Self::factory();
        eeprom.values.extend(SLIDE);
        eeprom
    }

    pub fn copy_numbers_from(&mut self, other: &Self) {
        self.values.clone_from(&other.values);
    }

    /// A value; zero for an unknown number.
    pub fn value(&self, number: u16) -> f64 {
        self.values.get(&number).copied().unwrap_or(0.0)
    }

    pub fn is_set(&self, number: u16) -> bool {
        self.value(number) != 0.0
    }

    /// Stores a value, or returns the error number (settings.c, `settings_store_global_setting`).
    pub fn set(&mut self, number: u16, value: f64) -> Result<(), u8> {
        if value < 0.0 {
            return Err(4);
        }
        if !self.values.contains_key(&number) {
            return Err(3);
        }
        match number {
            0 if value < 3.0 => return Err(6),
            20 if value != 0.0 && !self.is_set(22) => return Err(10),
            // Without homing there are no soft limits.
            22 if value == 0.0 => {
                self.values.insert(20, 0.0);
            }
            _ => {}
        }
        // Positions are steps a millimetre; the rest of the whole numbers are bytes.
        let is_whole = number < 11 || matches!(number, 13 | 20..=23 | 32);
        let value = if is_whole { value.trunc().min(255.0) } else { value };
        self.values.insert(number, value);
        Ok(())
    }

    /// The lines of `$$`.
    pub fn listing(&self) -> String {
        let mut text = String::new();
        for (number, value) in &self.values {
            let is_real = matches!(number, 11 | 12 | 24 | 25 | 27) || *number >= 100;
            let decimals = if is_real { 3 } else { 0 };
            text.push_str(&format!("${number}={value:.decimals$}\r\n"));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn listing_is_that_of_the_manual() {
        let listing = Eeprom::factory().listing();
        assert!(listing.starts_with("$0=10\r\n$1=25\r\n$2=0\r\n"), "{listing}");
        assert!(listing.contains("$10=1\r\n$11=0.010\r\n$12=0.002\r\n$13=0\r\n$20=0\r\n"));
        assert!(listing.ends_with("$130=200.000\r\n$131=200.000\r\n$132=200.000\r\n"));
    }

    #[test]
    fn forbidden_values_have_their_error_number() {
        let mut eeprom = Eeprom::factory();
        assert_eq!(eeprom.set(0, 2.0), Err(6));
        assert_eq!(eeprom.set(20, 1.0), Err(10));
        assert_eq!(eeprom.set(9, 1.0), Err(3));
        assert_eq!(eeprom.set(100, -1.0), Err(4));
        assert_eq!(eeprom.set(22, 1.0), Ok(()));
        assert_eq!(eeprom.set(20, 1.0), Ok(()));
        assert_eq!(eeprom.set(22, 0.0), Ok(()));
        assert!(!eeprom.is_set(20));
        assert_eq!(eeprom.set(100, 66.667), Ok(()));
        assert!(eeprom.listing().contains("$100=66.667\r\n"));
    }
}
