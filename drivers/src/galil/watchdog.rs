//! A program on the controller that stops the axis when palpate falls silent.

use palpate_model::Nanos;
use palpate_model::units::{MmPerS, MmPerS2};

/// The variable that palpate sets to 1 again and again.
pub const VARIABLE: &str = "plpwd";
/// The program's label.
pub const LABEL: &str = "#PLPWD";
/// The thread it runs in: the first one is for other programs and automatic subroutines.
pub const THREAD: u8 = 1;
/// Interval of the program's checks, in the controller's ms. Whether these are samples when `TM` is not 1000 is not
/// confirmed: half as long at 500, renewals are still often enough.
const LOOK_MS: u32 = 250;
/// Interval of renewals: so short that two of them may be lost.
pub const RENEW: Nanos = Nanos::from_millis(40);

/// Its lines. `WT`, `JP`, labels: DMC-40x0 command reference. `ST` of an axis leaves programs running.
#[must_use]
pub fn program(axis: char) -> Vec<String> {
    vec![
        LABEL.to_owned(),
        format!("WT {LOOK_MS}"),
        format!("JP #PLPST,{VARIABLE}=0"),
        format!("{VARIABLE}=0"),
        format!("JP {LABEL}"),
        "#PLPST".to_owned(),
        format!("ST{axis}"),
        format!("JP {LABEL}"),
    ]
}

/// Longest way of the axis after the last byte from palpate, in mm: two looks of the program at full speed, and the way
/// of the brake.
#[must_use]
pub fn worst_case_mm(speed: MmPerS, acceleration: MmPerS2, tick: Nanos) -> f64 {
    let look_secs = f64::from(LOOK_MS) * tick.seconds().0.max(1e-3);
    let silent = 2.0 * look_secs;
    speed.0 * silent + speed.0 * speed.0 / (2.0 * acceleration.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_case_is_two_looks_and_the_brake() {
        let worst = worst_case_mm(MmPerS(20.0), MmPerS2(61.44), Nanos(976_563));
        assert!((worst - (10.0 + 400.0 / 122.88)).abs() < 1e-12);
    }
}
