//! Settings of the simulated rig that are amounts, each with its unit and range.

use super::settings::SimSettingError;
use palpate_model::Newtons;
use std::fmt;
use std::str::FromStr;

macro_rules! amount {
    ($(#[$doc:meta])* $name:ident, $word:literal, $usual:literal, $range:expr, $choices:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name(u32);

        impl Default for $name {
            fn default() -> Self {
                Self($usual)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        impl FromStr for $name {
            type Err = SimSettingError;
            fn from_str(text: &str) -> Result<Self, Self::Err> {
                let amount = text.parse().ok().filter(|amount| $range.contains(amount));
                amount
                    .map(Self)
                    .ok_or_else(|| SimSettingError::new($word, text, $choices))
            }
        }

        #[allow(dead_code, reason = "each amount needs one of them")]
        impl $name {
            /// The amount in hundredths of its unit, such as a share from percent. Quotients of whole numbers are the
            /// nearest doubles to decimal fractions.
            pub(super) fn hundredths(self) -> f64 {
                f64::from(self.0) / 100.0
            }

            /// The amount in thousandths of its unit, such as N from mN.
            pub(super) fn thousandths(self) -> f64 {
                f64::from(self.0) / 1000.0
            }

            /// The amount, unless it is 0.
            pub(super) fn positive(self) -> Option<f64> {
                (self.0 > 0).then(|| f64::from(self.0))
            }
        }
    };
}

amount!(
    /// White noise of the ideal load cell, rms, in whole mN. Without any, every sample would be the same, and the
    /// engine takes such a cell for a dead one.
    SimNoise, "noise", 20, (1..=1000), "1 to 1000 (whole millinewtons; a signal without noise would look like a failed load cell)"
);
amount!(
    /// Stiffness of the tissue in whole percent of what it usually is: `mu` and `tau_sig` alike, so that
    /// forces scale and times do not.
    SimStiffness, "stiffness", 100, (10..=1000), "10 to 1000 (whole percent)"
);
amount!(
    /// Machine compliance in whole um/N.
    SimCompliance, "compliance", 0, (0..=1000), "0 to 1000 (whole micrometres per newton)"
);

amount!(
    /// Final temperature of the specimen's bath in whole °C, from 21 as the rig is switched on; 0 is a rig without one.
    SimBath, "bath", 0, (0..=60), "0 to 60 (whole degrees Celsius; 0 for no bath)"
);
amount!(
    /// The time at which digital input 1 goes high, in whole seconds after the rig is switched on; 0 is a rig without
    /// inputs.
    SimInput, "input", 0, (0..=86_400), "0 to 86400 (whole seconds; 0 for no input)"
);

amount!(
    /// Softening of the simulated tissue where it has been deeper: the largest share of its elastic force that is
    /// lost, in whole percent. Tissue that lost more than 90 would not come back by itself.
    SimSoftening, "softening", 0, (0..=90), "0 to 90 (whole percent)"
);
amount!(
    /// Percent of the greatest depth by which the surface recedes in the end, where that is far beyond a centimetre.
    /// One that recedes further than 30 is no longer found where a second cycle looks for it.
    SimPreconditioning, "preconditioning", 0, (0..=30), "0 to 30 (whole percent)"
);

amount!(
    /// Samples a second that the controller takes, one a tick. Each has the same noise. A tick of either clock
    /// divides by each of the choices into whole nanoseconds.
    SimRate, "rate", 1000, RATES, "1000, 2000, 4000, 5000, 8000, 10000, 16000 or 20000 (samples a second)"
);

const RATES: [u32; 8] = [1000, 2000, 4000, 5000, 8000, 10_000, 16_000, 20_000];

impl SimRate {
    #[must_use]
    pub const fn per_usual_tick(self) -> u64 {
        self.0 as u64 / 1000
    }
}

impl SimNoise {
    #[must_use]
    pub fn newtons(self) -> Newtons {
        Newtons(self.thousandths())
    }
}

/// From the surface of the specimen a rig begins with to the stiff base behind it, in mm to a tenth.
///
/// Usually 100 mm, so far behind that only a search without specimen meets it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SimThickness {
    tenths: u32,
}

/// Thinnest: fresh specimens differ by up to 4 mm in where their surface is, and each has to be before the base.
const TENTHS_MIN: u32 = 50;
/// Thickest: the base is then behind the travel.
const TENTHS_MAX: u32 = 2000;

impl SimThickness {
    #[must_use]
    pub fn mm(self) -> f64 {
        f64::from(self.tenths) / 10.0
    }
}

impl Default for SimThickness {
    fn default() -> Self {
        Self { tenths: 1000 }
    }
}

impl fmt::Display for SimThickness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.mm().fmt(f)
    }
}

impl FromStr for SimThickness {
    type Err = SimSettingError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let tenths = text.parse::<f64>().ok().map(|mm| 10.0 * mm);
        // A decimal number misses its tenth by rounding only.
        let is_tenth = |tenths: &f64| (tenths - tenths.round()).abs() < 1e-9;
        let whole = tenths.filter(is_tenth).map(|tenths| tenths.round() as u32);
        whole
            .filter(|tenths| (TENTHS_MIN..=TENTHS_MAX).contains(tenths))
            .map(|tenths| Self { tenths })
            .ok_or_else(|| {
                SimSettingError::new("thickness", text, "5 to 200 (millimetres, to a tenth)")
            })
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::SimClock;
    use super::*;

    #[test]
    fn amounts_are_read_within_their_range() {
        assert_eq!(SimNoise::default().newtons(), Newtons(0.02));
        assert_eq!("50".parse::<SimNoise>().unwrap().newtons(), Newtons(0.05));
        assert_eq!("50".parse::<SimStiffness>().unwrap().hundredths(), 0.5);
        assert_eq!("40".parse::<SimCompliance>().unwrap().thousandths(), 0.04);
        assert_eq!("12.3".parse::<SimThickness>().unwrap().mm(), 12.3);
        let err = "0".parse::<SimNoise>().unwrap_err();
        assert_eq!((err.setting, err.value.as_str()), ("noise", "0"));
        for wrong in ["", "-1", "1001", "2.5", "nan", "1e9"] {
            assert!(wrong.parse::<SimNoise>().is_err(), "{wrong}");
            assert!(wrong.parse::<SimThickness>().is_err(), "{wrong}");
        }
        for samples in RATES {
            let rate: SimRate = samples.to_string().parse().unwrap();
            assert_eq!(rate.to_string(), samples.to_string());
            for clock in [SimClock::Nominal, SimClock::Galil] {
                assert_eq!(clock.tick_nanos() % rate.per_usual_tick(), 0);
            }
        }
        for wrong in ["", "0", "1", "500", "3000", "20001", "40000", "1e3"] {
            assert!(wrong.parse::<SimRate>().is_err(), "{wrong}");
        }
        let err = "5".parse::<SimStiffness>().unwrap_err();
        assert_eq!((err.setting, err.value.as_str()), ("stiffness", "5"));
    }
}
