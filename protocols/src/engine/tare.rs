//! Tare: the unloaded signal and its noise, averaged over whole mains cycles.

use super::context::{Context, Progress};
use super::input::Record;
use super::self_test::check_unloaded;
use super::state::Tare;
use super::stats::RunningStats;
use palpate_model::rig::Reading;
use palpate_model::units::{Seconds, Volts};

/// Data of a tare in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Taring {
    until_tick: u64,
    volts: RunningStats,
}

impl Taring {
    pub fn begin(cx: &mut Context<'_>, duration: Seconds) -> Self {
        Self {
            until_tick: cx.state.tick + cx.state.ticks(duration),
            volts: RunningStats::default(),
        }
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Progress {
        self.volts.push(reading.volts.0);
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
        cx.state.tare = Some(Tare { volts, noise });
        cx.record(Record::Tared {
            volts,
            noise,
            samples: self.volts.count(),
        });
        Progress::Done
    }
}
