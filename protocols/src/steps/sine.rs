//! A sine from where the probe stands to deeper and back, beginning and ending at rest.

use super::FORCE_FLOOR;
use super::prelude::*;
use palpate_model::rig::{Oscillation, RigDescription};

/// A sine from where the probe stands to deeper and back, beginning and ending at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sine {
    /// Half of the distance between the turning points, in mm.
    pub amplitude_mm: f64,
    /// Frequency in Hz.
    pub frequency_hz: f64,
    pub cycles: u32,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Oscillate between the present depth and a depth that is greater by twice the amplitude. The motion begins and ends at rest.",
    keys: &[
        Key::needed(
            "amplitude",
            QuantityKind::Length,
            "half of the distance between the turning points",
        ),
        Key::needed("frequency", QuantityKind::Frequency, "frequency of the oscillation"),
        Key::needed("cycles", QuantityKind::Count, "number of whole cycles"),
    ],
    build: Some(|args| {
        Ok(Sine {
            amplitude_mm: args.number("amplitude")?,
            frequency_hz: args.number("frequency")?,
            cycles: args.count("cycles")?,
        }
        .into())
    }),
    needs: FROM_SURFACE,
    gives: &[Need::Inside],
    is_measuring: true,
    ..StepFacts::of(
        "sine",
        Phase::Sine,
        PauseBehaviour::Measure("the tissue relaxes while an oscillation is interrupted"),
    )
};

/// The lowest force of a sine is the lowest mean over this share of a period: short beside it, and long beside noise.
const MEAN_SHARE: f64 = 0.02;

/// and over so many samples at most, which hide any noise.
const MEAN_SAMPLES_MAX: f64 = 1000.0;

impl Sine {
    /// In whole pulses and whole ticks, as a rig takes it.
    pub fn command(&self, rig: &RigDescription) -> Oscillation {
        Oscillation {
            amplitude_pulses: (self.amplitude_mm / rig.mm_per_pulse).round() as i64,
            period_ticks: (1.0 / (self.frequency_hz * rig.tick().0)).round() as u32,
            cycles: self.cycles,
            acceleration: rig.acceleration,
        }
    }
}

impl StepKind for Sine {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_span(Seconds(f64::from(self.cycles) / self.frequency_hz));
        walk.check_sizes(&[self.amplitude_mm]);
        if self.cycles == 0 || self.amplitude_mm <= 0.0 {
            walk.refuse("a sine needs at least one cycle and an amplitude above 0 mm".into());
        }
        if walk.is_refused() {
            return DurationEstimate(0.0, 0.0, true);
        }
        let command = self.command(walk.rig);
        if let Err(reason) = walk.rig.check_oscillation(&command) {
            walk.refuse(reason);
        }
        let deepest = 2.0 * command.amplitude_pulses as f64 * walk.rig.mm_per_pulse;
        walk.check_travel("sine", deepest);
        let from = Depth(walk.expected.depth());
        if walk.expected.oscillate(walk.phase, self).0 <= 0.0 {
            walk.note(format!(
                "the expected tissue exerts too little force at a depth of {from:.1} for an amplitude of {} mm: the force would fall to zero and the probe would lose contact; go deeper or reduce the amplitude",
                self.amplitude_mm
            ));
        }
        // The rig counts whole ticks of each period.
        let ticks = u64::from(command.cycles) * u64::from(command.period_ticks);
        let secs = walk.secs(ticks + walk.answer_ticks());
        DurationEstimate(secs, secs, walk.is_answer_exact())
    }

    fn force_mean_samples(&self, rig: &RigDescription) -> Option<usize> {
        let samples = MEAN_SHARE / (self.frequency_hz * rig.tick().0);
        Some(samples.min(MEAN_SAMPLES_MAX) as usize)
    }

    fn judge(&self, done: &mut StepResult<'_>) {
        done.amplitude(self.amplitude_mm);
        done.frequency(self.frequency_hz, self.cycles);
    }

    fn doubt(&self, done: &StepResult<'_>) -> Option<String> {
        let lowest = done.lowest_force().filter(|lowest| *lowest <= FORCE_FLOOR)?;
        Some(format!(
            "the force fell to {lowest:.3} N, and below {FORCE_FLOOR} N contact is uncertain: the probe may have left the tissue; go deeper or reduce the amplitude"
        ))
    }
}

impl Executable for Sine {
    type Run = MoveRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<MoveRun, String> {
        let command = self.command(cx.rig());
        cx.oscillate(command).map(|()| MoveRun)
    }
}
