//! From a sidecar's sample to a reading, and whether the sample can be true.

use super::{NewestSample, SidecarSession};
use crate::board_clock::BoardTime;
use crate::rig::RigEventBody;
use crate::sidecar::protocol::SidecarSample;
use crate::sidecar::{BEYOND_RANGE, FLOODED};
use crate::wire::Waiting;
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Reading, SampleAge};
use palpate_model::units::Volts;

/// An axis that is faster than this share of its largest speed has jumped: overshoot and the jitter of ticks are less.
const JUMP_SPEED: f64 = 1.5;
/// And so many pulses may come to that: one of rounding at each end.
const JUMP_PULSES: f64 = 2.0;

impl SidecarSession {
    pub(super) fn on_sample(&mut self, now: Nanos, sample: &SidecarSample) {
        let (Some(counts), Some(pulses)) = (sample.counts, sample.pulses) else {
            return self.on_garbled(now);
        };
        let cell = self.facts.cell;
        if !(cell.counts_min..=cell.counts_max).contains(&counts) {
            let why = "the sidecar sends counts beyond its converter; correct its program";
            return self.on_impossible(now, why);
        }
        if !sample.has_possible_pulses() {
            let why = "the sidecar sends a position beyond 2147483647 pulses; correct its program";
            return self.on_impossible(now, why);
        }
        let time = match self.board_clock.take(now, sample.ticks) {
            BoardTime::Repeated => return self.on_garbled(now),
            BoardTime::At(time) => time,
            BoardTime::Restarted(time) => {
                self.on_restart(now);
                time
            }
        };
        self.garbled_in_row = 0;
        self.check_jump(now, time, pulses);
        self.for_sample = Waiting::new(now);
        self.is_silent = false;
        self.check_range(now, counts);
        let status = self.shown_status(sample, pulses);
        let is_obeyed = !status.has(AxisStatus::MOVING) || status.has(AxisStatus::STOPPING);
        self.stop_accepted = self.stop_accepted.filter(|_| !is_obeyed);
        self.newest = Some(NewestSample { time, pulses, status: AxisStatus(sample.status) });
        let age = self.age(now, time);
        let reading = Reading {
            tick: time.0 / self.facts.tick_ns,
            counts: Some(counts),
            volts: Volts(f64::from(counts) * cell.volts_per_count),
            pulses: pulses - self.zero,
            status,
            age: Some(age),
        };
        self.report(now, [RigEventBody::Reading(reading)]);
        self.sensors.take(now, age.by, &sample.values);
    }

    /// A sample that cannot be counts as garbled; the first of several stops the axis.
    fn on_impossible(&mut self, now: Nanos, why: &str) {
        let is_first = !std::mem::replace(&mut self.is_beyond, true);
        if is_first {
            self.fail(now, why);
        }
        self.on_garbled(now);
    }

    /// Half the shortest way there and back comes to what the line under all arrivals shows.
    fn age(&mut self, now: Nanos, time: Nanos) -> SampleAge {
        let half = Nanos(self.stats.round_trip_min.0 / 2);
        let mapped = self.host_clock.map(time, now);
        let spread = self.host_clock.spread();
        SampleAge {
            by: now.since(mapped) + half,
            within: spread + half + Nanos(self.facts.tick_ns),
        }
    }

    /// A motion that no sample has shown, because it was shorter than a sample or had no way, is shown by this one.
    fn shown_status(&mut self, sample: &SidecarSample, pulses: i64) -> AxisStatus {
        let status = AxisStatus(sample.status);
        if status.has(AxisStatus::MOVING) {
            self.awaited = None;
            return status;
        }
        match self.awaited {
            Some(awaited) if awaited.end == Some(pulses) => {
                self.awaited = None;
                status | AxisStatus::MOVING
            }
            _ => status,
        }
    }

    fn check_jump(&mut self, now: Nanos, time: Nanos, pulses: i64) {
        let Some(newest) = self.newest else {
            return;
        };
        let axis = self.facts.axis;
        let seconds = time.since(newest.time).0 as f64 * 1e-9;
        let way = pulses.abs_diff(newest.pulses) as f64;
        let most = JUMP_SPEED * axis.speed_max * seconds / axis.mm_per_pulse + JUMP_PULSES;
        if way > most && self.locked.is_none() {
            let mm = way * axis.mm_per_pulse;
            let why = format!(
                "the sidecar's position jumped by {mm:.3} mm within {seconds:.4} s; check its counter, connect the rig again and home the axis"
            );
            self.lock(now, &why);
            self.fail(now, &why);
        }
    }

    /// The end of the range stands for all that is beyond it, and no limit of force may see it.
    fn check_range(&mut self, now: Nanos, counts: i32) {
        let cell = self.facts.cell;
        let is_beyond = counts == cell.counts_min || counts == cell.counts_max;
        if is_beyond && !self.is_beyond {
            self.fail(now, BEYOND_RANGE);
        }
        self.is_beyond = is_beyond;
    }

    /// Whether far too much has come: then nothing is read any more, so that the stop is written.
    pub(super) fn check_flood(&mut self, now: Nanos) -> bool {
        if self.budget.is_exceeded() && !std::mem::replace(&mut self.is_flooded, true) {
            self.fail(now, &format!("{FLOODED}; correct its program"));
        }
        self.is_flooded
    }
}
