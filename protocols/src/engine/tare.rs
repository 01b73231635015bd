//! Tare: the unloaded signal and its noise, averaged over whole mains cycles.

use super::context::{Context, Progress};
use super::input::Record;
use super::self_test::check_unloaded;
use super::state::{Drift, Tare};
use super::stats::{RunningLine, RunningStats};
use palpate_model::rig::Reading;
use palpate_model::units::{Seconds, Volts};

/// A shorter tare says nothing of drift: within 2 s a noise of 1 mV leaves 0.04 mV/s open, which in the
/// half minute of an approach is a fifth of the contact criterion.
const DRIFT_SPAN_MIN: Seconds = Seconds(2.0);

/// Data of a tare in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Taring {
    until_tick: u64,
    volts: RunningStats,
    /// Signal over time, where the tare is long enough to tell drift.
    line: Option<(u64, RunningLine)>,
}

impl Taring {
    pub fn begin(cx: &mut Context<'_>, duration: Seconds) -> Self {
        Self {
            until_tick: cx.state.tick + cx.state.ticks(duration),
            volts: RunningStats::default(),
            line: (duration >= DRIFT_SPAN_MIN).then(|| (cx.state.tick, RunningLine::default())),
        }
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Progress {
        self.volts.push(reading.volts.0);
        if let Some((start_tick, line)) = &mut self.line {
            let ticks = reading.tick.saturating_sub(*start_tick) as f64;
            line.push(ticks * cx.state.config.rig.tick().0, reading.volts.0);
        }
        if reading.tick < self.until_tick {
            return Progress::Continue;
        }
        let volts = Volts(self.volts.mean());
        if let Err(reason) = check_unloaded(cx, volts) {
            return Progress::Fail(format!("tare: {reason}"));
        }
        // Quantisation adds a uniform error of one count; a quiet signal may hide inside it.
        let count = cx
            .state
            .config
            .rig
            .adc
            .map_or(0.0, |adc| adc.volts_per_count);
        let noise = Volts(self.volts.std_dev().max(count / 12f64.sqrt()));
        let drift = self.line.and_then(|(_, line)| line.slope());
        let drift = drift.map(|(volts_per_s, std_error)| Drift {
            volts_per_s,
            std_error,
        });
        cx.state.tare = Some(Tare {
            volts,
            noise,
            drift,
        });
        cx.record(Record::Tared {
            volts,
            noise,
            samples: self.volts.count(),
            drift,
        });
        Progress::Done
    }
}
