//! Tare: the unloaded signal and its noise, averaged over whole mains cycles.

use super::prelude::*;
use super::self_test::check_unloaded;
use super::stats::{RunningLine, RunningStats};
use crate::engine::{Drift, UnloadedSignal};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tare {
    /// Whole mains cycles: a whole second is 50 or 60 of them.
    pub duration: Seconds,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Average the signal without load. The probe must touch nothing.",
    keys: &[Key::usual(
        "for",
        QuantityKind::Time,
        "4 s",
        "duration in whole seconds, so that mains hum averages out; with 2 s or more the drift is measured too",
    )],
    build: Some(|args| Ok(Tare { duration: args.seconds("for")? }.into())),
    needs: &[Need::Outside],
    gives: &[Need::Tare],
    may_touch: false,
    label: "tare",
    ..StepFacts::of("tare", Phase::Tare, PauseBehaviour::Complete)
};

impl StepKind for Tare {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_span(self.duration);
        walk.wait(self.duration)
    }
}

impl Executable for Tare {
    type Run = TareRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<TareRun, String> {
        cx.set_unloaded(None);
        cx.forget_force_rate();
        Ok(TareRun {
            until_tick: cx.tick_after(self.duration),
            volts: RunningStats::default(),
            line: (self.duration >= DRIFT_SPAN_MIN).then(|| (cx.tick(), RunningLine::default())),
        })
    }
}

/// A shorter tare says nothing of drift: within 2 s a noise of 1 mV leaves 0.04 mV/s open, which in the
/// half minute of an approach is a fifth of the contact criterion.
const DRIFT_SPAN_MIN: Seconds = Seconds(2.0);

/// A tare in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TareRun {
    until_tick: u64,
    volts: RunningStats,
    /// Signal over time, where the tare is long enough to tell drift.
    line: Option<(u64, RunningLine)>,
}

impl RunningStep for TareRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        self.volts.push(reading.volts.0);
        if let Some((start_tick, line)) = &mut self.line {
            let ticks = reading.tick.saturating_sub(*start_tick) as f64;
            line.push(ticks * cx.rig().tick().0, reading.volts.0);
        }
        if reading.tick < self.until_tick {
            return Ok(Progress::Continue);
        }
        let volts = Volts(self.volts.mean());
        check_unloaded(cx, volts)?;
        // Quantisation adds a uniform error of one count; a quiet signal may hide inside it.
        let noise = Volts(self.volts.std_dev().max(cx.volts_per_count() / 12f64.sqrt()));
        let drift = self.line.and_then(|(_, line)| line.slope());
        let drift = drift.map(|(volts_per_s, std_error)| Drift { volts_per_s, std_error });
        cx.set_unloaded(Some(UnloadedSignal { volts, noise, drift }));
        cx.record(Record::Tared { volts, noise, samples: self.volts.count(), drift });
        Ok(Progress::Done)
    }
}
