//! Numbers of an axis that a command sets and reads: ranges, rounding and initial values.

use super::model::GalilModel;
use palpate_drivers::galil::ErrorCode;

macro_rules! settings {
    ($($name:ident = $word:literal, $first:expr, $min:expr, $max:expr, $decimals:literal;)*) => {
        /// A number of an axis.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum AxisSetting {
            $(
                #[doc = $word]
                $name,
            )*
        }

        const TABLE: &[(&str, AxisSetting, f64, f64, f64, usize)] = &[
            $(($word, AxisSetting::$name, $first, $min, $max, $decimals),)*
        ];
    };
}

/// Switches a software limit off, forwards and backwards (DMC-40x0 command reference, `FL`, `BL`).
pub const NO_LIMIT: f64 = 2_147_483_647.0;

/// Fastest pulses in counts/s (DMC-40x0 command reference, `SP`).
pub const STEPPER_SPEED_MAX: f64 = 6_000_000.0;

// First values of a controller after its reset; ranges of the DMC-40x0 and DMC-30010 command references. Those of
// settings that nothing here depends on are only wide enough to hold what clients send.
settings! {
    Speed = "SP", 25_000.0, 0.0, 22_000_000.0, 0;
    Acceleration = "AC", 256_000.0, 1024.0, 1_073_740_800.0, 0;
    Deceleration = "DC", 256_000.0, 1024.0, 1_073_740_800.0, 0;
    LimitDeceleration = "SD", 256_000.0, 1024.0, 1_073_740_800.0, 0;
    HomeSpeed = "HV", 256.0, 0.0, 22_000_000.0, 0;
    Independent = "IT", 1.0, 0.004, 1.0, 4;
    VectorTime = "VT", 1.0, 0.004, 1.0, 4;
    ForwardLimit = "FL", NO_LIMIT, -2_147_483_648.0, NO_LIMIT, 0;
    ReverseLimit = "BL", -2_147_483_648.0, -2_147_483_648.0, NO_LIMIT, 0;
    LimitDisable = "LD", 0.0, 0.0, 3.0, 0;
    ErrorLimit = "ER", 16_384.0, -1.0, NO_LIMIT, 0;
    OffOnError = "OE", 0.0, 0.0, 3.0, 0;
    MotorType = "MT", 1.0, -12.0, 12.0, 1;
    Smoothing = "KS", 1.313, 0.25, 128.0, 3;
    Proportional = "KP", 6.0, 0.0, 1023.875, 3;
    Integral = "KI", 0.0, 0.0, 255.999, 3;
    Derivative = "KD", 64.0, 0.0, 4095.875, 3;
    IntegratorLimit = "IL", 9.9982, -9.9982, 9.9982, 4;
    TorqueLimit = "TL", 9.9982, 0.0, 9.9982, 4;
    PeakTorque = "TK", 0.0, 0.0, 9.9982, 4;
    Offset = "OF", 0.0, -9.9982, 9.9982, 4;
    AccelerationForward = "FA", 0.0, 0.0, 8191.0, 2;
    VelocityForward = "FV", 0.0, 0.0, 8191.0, 0;
    StepSize = "YA", 2.0, 1.0, 9999.0, 0;
    StepsPerTurn = "YB", 200.0, 0.0, 65_535.0, 0;
    CountsPerTurn = "YC", 4000.0, 0.0, 65_535.0, 0;
    Maintenance = "YS", 0.0, 0.0, 1.0, 0;
    LowCurrent = "LC", 0.0, -1.0, 32_767.0, 0;
    AmplifierGain = "AG", 0.0, -1.0, 9.0, 0;
    CurrentGain = "AU", 0.0, 0.0, 10.0, 1;
    Encoder = "CE", 0.0, 0.0, 255.0, 0;
    Brushless = "BR", 0.0, -1.0, 1.0, 0;
    UserVariable = "ZA", 0.0, -2_147_483_648.0, NO_LIMIT, 0;
    NotchB = "NB", 0.5, 0.0, 15.93, 3;
    NotchF = "NF", 0.0, 0.0, 255.0, 3;
    NotchZ = "NZ", 0.5, 0.0, 15.93, 3;
    Pole = "PL", 0.0, 0.0, 0.9999, 4;
    DualLoop = "DV", 0.0, 0.0, 1.0, 0;
}

impl AxisSetting {
    pub const COUNT: usize = TABLE.len();

    /// The setting that a command of two letters sets.
    pub fn from_word(word: &str) -> Option<Self> {
        TABLE.iter().find(|row| row.0 == word).map(|row| row.1)
    }

    /// Decimals of its answer.
    pub fn decimals(self) -> usize {
        TABLE[self as usize].5
    }

    /// The value that the controller sets when `value` is requested.
    pub fn round(self, value: f64, model: GalilModel, tm: f64) -> Result<f64, ErrorCode> {
        let (_, _, _, min, max, _) = TABLE[self as usize];
        let max = match self {
            Self::Acceleration | Self::Deceleration | Self::LimitDeceleration => {
                model.acceleration_max()
            }
            _ => max,
        };
        // Between the least acceleration and nothing there is only refusal.
        if !(min..=max).contains(&value) {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        Ok(match self {
            // Resolution 2 * (1000 / TM) counts/s (DMC-40x0 command reference, `SP`).
            Self::Speed => round_speed(value, tm),
            // "73422 -> 72704": a DMC-30010 as quoted in ESRF BLISS 2.4.0, controllers/motors/galil.
            Self::Acceleration | Self::Deceleration | Self::LimitDeceleration => {
                (value / 1024.0).floor() * 1024.0
            }
            _ => {
                let scale = 10_f64.powi(self.decimals() as i32);
                (value * scale).round() / scale
            }
        })
    }
}

/// A speed with its sign, towards zero to the controller's resolution.
pub fn round_speed(value: f64, tm: f64) -> f64 {
    let quantum = 2.0 * 1000.0 / tm;
    (value / quantum).trunc() * quantum
}

#[derive(Clone, Debug)]
pub struct AxisSettings([f64; AxisSetting::COUNT]);

impl AxisSettings {
    /// As after a reset.
    pub fn new() -> Self {
        Self(std::array::from_fn(|i| TABLE[i].2))
    }

    pub fn get(&self, setting: AxisSetting) -> f64 {
        self.0[setting as usize]
    }

    /// Sets what [`AxisSetting::round`] gave.
    pub fn set(&mut self, setting: AxisSetting, value: f64) {
        self.0[setting as usize] = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_its_names() {
        for (at, row) in TABLE.iter().enumerate() {
            assert_eq!(row.1 as usize, at);
            assert_eq!(AxisSetting::from_word(row.0), Some(row.1));
        }
    }

    #[test]
    fn speeds_and_accelerations_are_rounded_down() {
        let model = GalilModel::Dmc4143;
        let rounded = |setting: AxisSetting, value, tm| setting.round(value, model, tm).unwrap();
        assert_eq!(rounded(AxisSetting::Acceleration, 73_422.0, 1000.0), 72_704.0);
        assert_eq!(rounded(AxisSetting::Speed, 51.9, 1000.0), 50.0);
        assert_eq!(rounded(AxisSetting::Speed, 51.9, 500.0), 48.0);
        assert_eq!(round_speed(-51.9, 1000.0), -50.0);
        for wrong in [1023.0, -1.0, 1.1e9, f64::NAN] {
            assert_eq!(
                AxisSetting::Acceleration.round(wrong, model, 1000.0),
                Err(ErrorCode::OUT_OF_RANGE)
            );
        }
    }
}
