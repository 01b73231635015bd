//! How far a slave is behind, and how well the force at the handle agrees with the force of its cell.

use super::{FILTER_MS, SlaveSettings};
use crate::SlaveSample;
use crate::haptics::timing::LoopTiming;
use palpate_haptics::margin::{LoopDevice, MarginSettings};
use palpate_model::Nanos;
use palpate_model::signal::MovingMean;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use serde::Serialize;
use std::collections::VecDeque;

/// The lag is taken once a millisecond: a move takes tens of them.
const LAG_EVERY: Nanos = Nanos::from_millis(1);

/// Stored master positions: five seconds, after which a slave without a lead has ended.
const PLACES_MAX: usize = 5000;

/// An hour of lags.
const LAGS_MAX: usize = 3_600_000;

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LagSpread {
    pub median: f64,
    pub worst: f64,
}

impl LagSpread {
    fn of(values: &[f32]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f32::total_cmp);
        Some(Self {
            median: f64::from(*sorted.get(sorted.len() / 2)?),
            worst: f64::from(*sorted.last()?),
        })
    }
}

/// How two forces differ, in N.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ForceDifference {
    /// The largest either way.
    pub worst_n: f64,
    /// Root of the mean square.
    pub rms_n: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlaveReport {
    pub samples: u64,
    /// Greatest depth of the slave in mm.
    pub depth_max_mm: f64,
    /// Greatest force commanded at the handle, the mean of 50 ms as of all forces here, in N.
    pub handle_max_n: f64,
    /// Greatest force of the model at the depth of the slave.
    pub model_max_n: f64,
    /// Greatest force of the slave's cell.
    pub cell_max_n: f64,
    /// The model at the depth of the slave minus the cell: how the body differs from the specimen.
    pub model_less_cell: ForceDifference,
    /// The handle minus the cell: the same, plus the lag of the slave.
    pub handle_less_cell: ForceDifference,
    /// How long ago the master was where the slave is, in ms, while the slave is more than a pulse behind; none if it never is.
    pub lag_ms: Option<LagSpread>,
    /// How far the slave is from the master, in mm.
    pub lag_mm: LagSpread,
    /// How often the slave's cell detected contact or its loss.
    pub contact_changes: u64,
    /// Damping that the device would need at the greatest depth if its force came through the slave, at the median lag,
    /// in N s/m.
    pub damping_through_slave: Option<f64>,
    /// Damping it needs there as it is: the model at the master's place, in N s/m.
    pub damping_needed: f64,
    /// Damping it has, in N s/m.
    pub damping_has: f64,
    /// The master's loop; none where it ticks with the samples.
    pub master_loop: Option<MasterLoop>,
}

/// A master's loop in real time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MasterLoop {
    /// The priority that the system granted, in words.
    pub priority: String,
    #[serde(flatten)]
    pub timing: LoopTiming,
}

/// A sum of squares and the largest.
#[derive(Clone, Copy, Debug, Default)]
struct DifferenceSums {
    worst: f64,
    squares: f64,
    count: u64,
}

impl DifferenceSums {
    fn push(&mut self, difference: f64) {
        self.worst = self.worst.max(difference.abs());
        self.squares += difference * difference;
        self.count += 1;
    }

    fn summary(&self) -> ForceDifference {
        ForceDifference {
            worst_n: self.worst,
            rms_n: (self.squares / self.count.max(1) as f64).sqrt(),
        }
    }
}

/// Where both were at one time, in mm.
#[derive(Clone, Copy, Debug)]
struct Places {
    at: Nanos,
    master: f64,
    slave: f64,
}

/// When the master last passed the newest place of the slave, if the slave comes after it: it goes the way that the master went,
/// and has not been there since. `None` for a slave that is ahead, as at a turn.
fn unanswered(places: &VecDeque<Places>, pulse_mm: f64) -> Option<Nanos> {
    let Places { master, slave, .. } = *places.back()?;
    let behind = master - slave;
    let is_there = |before: &Places| (before.slave - slave).abs() <= pulse_mm;
    let came_from = places.iter().rev().find(|before| !is_there(before))?.slave;
    if (slave - came_from) * behind <= 0.0 {
        return None;
    }
    let mut has_left = false;
    for before in places.iter().rev().skip(1) {
        if (before.master - slave) * behind <= 0.0 {
            return Some(before.at);
        }
        if has_left && is_there(before) {
            return None;
        }
        has_left |= !is_there(before);
    }
    None
}

#[derive(Debug)]
pub(super) struct SlaveMeter {
    body: ModifiedKelvin,
    watch: MarginSettings,
    depth_max: Depth,
    mm_per_pulse: f64,
    model: KelvinState,
    /// Handle, model, cell: averaged alike, so that all have the same delay.
    filters: [MovingMean; 3],
    maxima: [f64; 3],
    model_less_cell: DifferenceSums,
    handle_less_cell: DifferenceSums,
    at: Option<Nanos>,
    lag_at: Option<Nanos>,
    places: VecDeque<Places>,
    lags_mm: Vec<f32>,
    lags_ms: Vec<f32>,
    samples: u64,
    deepest: f64,
    contact_changes: u64,
}

impl SlaveMeter {
    pub fn new(settings: &SlaveSettings) -> Self {
        let rig = &settings.rig;
        let filter = MovingMean::new(rig.means_in(FILTER_MS) * rig.samples_per_ms() as usize);
        Self {
            body: settings.body,
            watch: settings.master.system.watch(),
            depth_max: settings.depth_max,
            mm_per_pulse: rig.mm_per_pulse,
            model: KelvinState::at_rest(),
            filters: [filter.clone(), filter.clone(), filter],
            maxima: [0.0; 3],
            model_less_cell: DifferenceSums::default(),
            handle_less_cell: DifferenceSums::default(),
            at: None,
            lag_at: None,
            places: VecDeque::new(),
            lags_mm: Vec::new(),
            lags_ms: Vec::new(),
            samples: 0,
            deepest: f64::NEG_INFINITY,
            contact_changes: 0,
        }
    }

    pub fn push(
        &mut self,
        sample: &SlaveSample,
        master: Depth,
        handle: Newtons,
        contact_changes: u64,
    ) {
        self.samples += 1;
        self.contact_changes = contact_changes;
        self.deepest = self.deepest.max(sample.depth.0);
        let passed = sample.at.since(self.at.unwrap_or(sample.at)).seconds();
        self.at = Some(sample.at);
        // Above the surface the tissue relaxes without load.
        let pressed = Depth(sample.depth.0.max(0.0));
        let model = self.model.step(&self.body, pressed, passed).0.max(0.0);
        let forces = [handle.0, model, sample.force.0];
        let mut means = [0.0; 3];
        for (i, force) in forces.into_iter().enumerate() {
            means[i] = self.filters[i].push(force);
        }
        // A mean of a few samples is noise.
        if self.filters[2].is_full() {
            for (most, mean) in self.maxima.iter_mut().zip(means) {
                *most = most.max(mean);
            }
            let [handle, model, cell] = means;
            self.model_less_cell.push(model - cell);
            self.handle_less_cell.push(handle - cell);
        }
        let is_due = self.lag_at.is_none_or(|last| sample.at.since(last) >= LAG_EVERY);
        if is_due {
            self.lag_at = Some(sample.at);
            self.take_lag(sample, master.0.min(self.depth_max.0));
        }
    }

    /// Takes how far apart they are, and how long ago the master last passed the place of a slave that is behind.
    fn take_lag(&mut self, sample: &SlaveSample, master: f64) {
        if self.places.len() == PLACES_MAX {
            self.places.pop_front();
        }
        let slave = sample.depth.0;
        self.places.push_back(Places { at: sample.at, master, slave });
        if self.lags_mm.len() == LAGS_MAX {
            return;
        }
        let behind = master - slave;
        self.lags_mm.push(behind.abs() as f32);
        // Within a pulse it is there.
        if behind.abs() <= self.mm_per_pulse {
            return;
        }
        if let Some(at) = unanswered(&self.places, self.mm_per_pulse) {
            let lag: Seconds = sample.at.since(at).seconds();
            self.lags_ms.push((1e3 * lag.0) as f32);
        }
    }

    pub fn report(&self) -> Option<SlaveReport> {
        let lag_mm = LagSpread::of(&self.lags_mm)?;
        let lag_ms = LagSpread::of(&self.lags_ms);
        let [handle_max_n, model_max_n, cell_max_n] = self.maxima;
        let at = Depth(self.deepest.max(0.0));
        let period = self.watch.period.seconds().0;
        let needed = |ticks: f64| {
            let device = LoopDevice { delay_ticks: ticks, ..self.watch.device };
            let watch = MarginSettings { device, ..self.watch };
            // N s/m as catalogues have it.
            1e3 * watch.at(at, MmPerS(0.0)).needed
        };
        Some(SlaveReport {
            samples: self.samples,
            depth_max_mm: self.deepest,
            handle_max_n,
            model_max_n,
            cell_max_n,
            model_less_cell: self.model_less_cell.summary(),
            handle_less_cell: self.handle_less_cell.summary(),
            lag_ms,
            lag_mm,
            contact_changes: self.contact_changes,
            damping_through_slave: lag_ms.map(|lag| needed(1e-3 * lag.median / period)),
            damping_needed: needed(self.watch.device.delay_ticks),
            damping_has: 1e3 * self.watch.device.damping,
            master_loop: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PULSE_MM: f64 = 0.015;
    const PERIOD_S: f64 = 4.0;

    /// Lags in ms, each millisecond of three periods, of a slave behind a master.
    fn lags(master: impl Fn(f64) -> f64, slave: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut places = VecDeque::new();
        let mut lags = Vec::new();
        for tick in 0..12_000 {
            let t = f64::from(tick) * 1e-3;
            let now = Places {
                at: Nanos(u64::from(tick as u32) * 1_000_000),
                master: master(t),
                slave: slave(t),
            };
            places.push_back(now);
            if (now.master - now.slave).abs() > PULSE_MM
                && let Some(at) = unanswered(&places, PULSE_MM)
            {
                lags.push(1e3 * now.at.since(at).seconds().0);
            }
        }
        lags
    }

    /// From the surface to 3 mm and back.
    fn master(t: f64) -> f64 {
        1.5 - 1.5 * (std::f64::consts::TAU * t / PERIOD_S).cos()
    }

    #[test]
    fn a_slave_that_comes_later_is_behind_by_that_time() {
        for delay in [0.02, 0.1, 0.3] {
            let mut lags = lags(master, |t| master((t - delay).max(0.0)));
            assert!(lags.len() > 8_000, "{}", lags.len());
            lags.sort_unstable_by(f64::total_cmp);
            // A place is passed between two milliseconds; 1e-6 forgives the rounding of times.
            assert!((lags[lags.len() / 2] - 1e3 * delay).abs() <= 1.0 + 1e-6);
            assert!(*lags.last().unwrap() <= 1e3 * delay + 1.0 + 1e-6);
        }
    }

    #[test]
    fn a_slave_that_is_ahead_has_no_lag() {
        assert_eq!(lags(master, |t| master(t + 0.02)), [0.0; 0]);
        // Each cycle goes 5 % less deep, so that each turn is where the master was in the cycle before.
        let shrinking = |t: f64| master(t) * (1.0 - 0.05 * t / PERIOD_S);
        assert_eq!(lags(shrinking, |t| shrinking(t + 0.02)), [0.0; 0]);
        // By a pulse and a half beyond the turns.
        let beyond = |t: f64| 1.5 + (shrinking(t + 0.02) - 1.5) * 1.015;
        let worst = lags(shrinking, beyond).into_iter().fold(0.0, f64::max);
        // On the way back from there it is behind, by less than the master needs from the turn to there: no cycle.
        assert!(worst < 300.0, "{worst}");
    }
}
