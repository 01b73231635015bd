//! Opening an HX711 board.

use super::Hx711Settings;
use super::dialogue::Hx711Dialogue;
use super::protocol::{COUNT_MAX, COUNT_MIN, Header, Message, NO_CHIP, parse};
use crate::cell::{CellDescription, CellDevice};
use crate::text::{DeviceError, OpenedCell, TextConsole};
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::rig::AdcDescription;
use std::sync::Arc;

const DEVICE: &str = "HX711 board";
/// Opening the port resets an Arduino Uno, whose boot loader then waits up to two seconds; the chip needs another 0.4 s
/// (data sheet, page 3).
const START_MAX: Nanos = Nanos::from_millis(5_000);
const ASK_EVERY: Nanos = Nanos::from_millis(400);
/// Conversions that a value is a mean of: after so many the output has settled (data sheet, page 3).
const SETTLING: f64 = 4.0;
const MEASURED: usize = 9;
/// Longest time for these conversions, at 10 a second.
const MEASURE_MAX: Nanos = Nanos::from_millis(2_500);

impl CellDevice for Hx711Settings {
    /// Waits for the board, checks its identity and measures its rate.
    fn open(
        &self,
        link: &mut dyn Link,
        clock: &HostClock,
        name: &Arc<str>,
    ) -> Result<OpenedCell, DeviceError> {
        let is_scale = self.full_scale.0.is_finite() && self.full_scale.0 > 0.0;
        if !is_scale {
            return Err(DeviceError::unfit(DEVICE, "its full scale must be above 0 V"));
        }
        let mut console = TextConsole::new(link, clock, name, DEVICE);
        let header = identify(&mut console)?;
        DeviceError::check_serial(DEVICE, Some(&header.board), self.board.as_deref())?;
        let rate = measure(&mut console)?;
        let volts_per_count = self.volts_per_count(header.gain);
        let description = CellDescription {
            identity: format!(
                "HX711 board {}, {rate:.1} values per second, gain {}, full scale {}",
                header.board, header.gain, self.full_scale
            ),
            adc: AdcDescription { counts_min: COUNT_MIN, counts_max: COUNT_MAX, volts_per_count },
            noise_expected: self.noise,
            rate,
            delay: Nanos((0.5 * SETTLING / rate * 1e9) as u64),
            newtons_per_volt: None,
        };
        Ok(OpenedCell {
            description,
            dialogue: Box::new(Hx711Dialogue::new(header, volts_per_count, console.now())),
            raw: console.into_raw(),
            closing_bytes: Vec::new(),
        })
    }
}

fn identify(console: &mut TextConsole<'_>) -> Result<Header, DeviceError> {
    let start = console.now();
    while console.now().since(start) < START_MAX {
        console.write("?\r\n")?;
        let found = console.find(ASK_EVERY, |line| match parse(line) {
            Some(Message::Header { header, .. }) => Some(header),
            _ => None,
        })?;
        // The rate is 0 while the board has not measured the chip yet.
        if let Some(header) = found.filter(|header| header.rate > 0) {
            return Ok(header);
        }
    }
    let is_missing = |line: &str| matches!(parse(line), Some(Message::Missing { .. }));
    Err(if console.received().lines().any(is_missing) {
        DeviceError::unfit(DEVICE, NO_CHIP)
    } else {
        console.no_answer(
            "check port and cable, and that the board runs palpate's sketch at 115200 baud",
        )
    })
}

/// Values a second by the board's clock.
fn measure(console: &mut TextConsole<'_>) -> Result<f64, DeviceError> {
    let mut micros: Vec<u32> = Vec::new();
    console.find(MEASURE_MAX, |line| {
        if let Some(Message::Value { micros: at, .. }) = parse(line) {
            micros.push(at);
        }
        (micros.len() == MEASURED).then_some(())
    })?;
    let mut steps: Vec<u32> = micros.windows(2).map(|w| w[1].wrapping_sub(w[0])).collect();
    // The median forgives lines that were lost.
    steps.sort_unstable();
    match steps.get(steps.len() / 2) {
        Some(step) if *step > 0 && micros.len() == MEASURED => Ok(1e6 / f64::from(*step)),
        _ => Err(DeviceError::unfit(DEVICE, NO_CHIP)),
    }
}
