//! From the stand's travel and force to a sample: the reported position of the axis, and whether it moves.

use super::{Motion, STILL, STILL_PULSES, StandMove, StandSession, TICK, pulses_of};
use crate::mark10::gauge::BEYOND_RANGE;
use crate::mark10::protocol::GaugeForce;
use crate::mark10::stand::{LAG, MM_PER_PULSE, REST_TOLERANCE_MM, SPEED_TOLERANCE};
use crate::rig::{RigEventBody, axis_status};
use palpate_model::Nanos;
use palpate_model::rig::command::position_from_pulses;
use palpate_model::rig::{AxisStatus, Fault, MotionProfile, MoveTo, Reading, SampleAge};
use palpate_model::units::{Seconds, Volts};

impl StandSession {
    pub(super) fn on_sample(&mut self, now: Nanos, at: Nanos, force: GaugeForce, travel: i64) {
        if travel != self.travel {
            self.travel_changed = now;
        }
        self.travel = travel;
        // Another unit or another resolution: a key of the gauge has been pressed.
        let Some(counts) = self.scale.counts(force, self.counts) else {
            let tick = self.tick.unwrap_or(0);
            return self.report(now, RigEventBody::Fault(Fault::SignalInvalid { tick }));
        };
        self.counts = counts;
        self.look_for_overload(now);
        let tick = at.since(self.opened).0 / TICK.0;
        if self.tick.is_some_and(|before| tick <= before) {
            return;
        }
        self.tick = Some(tick);
        let (pulses, moving) = self.locate(now, tick);
        let (upper, lower) =
            self.status.map_or((false, false), |status| (status.is_at_upper, status.is_at_lower));
        let (forward, reverse) =
            if self.settings.is_upwards { (upper, lower) } else { (lower, upper) };
        let inputs = axis_status([
            (true, AxisStatus::MOTOR_ON),
            (self.settings.pulses(travel) <= 0, AxisStatus::HOME),
            (forward, AxisStatus::FORWARD_LIMIT),
            (reverse, AxisStatus::REVERSE_LIMIT),
        ]);
        let reading = Reading {
            tick,
            counts: Some(counts),
            volts: Volts(f64::from(counts) * self.scale.volts_per_count()),
            pulses,
            status: inputs | moving,
            age: Some(SampleAge { by: now.since(at), within: now.since(at) }),
        };
        self.uncertainty = now.since(at) + Nanos(TICK.0 / 2);
        self.report(now, RigEventBody::Reading(reading));
    }

    /// A reading at the end of the range stands for all that is beyond it, and no limit of force may see it.
    fn look_for_overload(&mut self, now: Nanos) {
        let is_beyond = self.scale.is_beyond_range(self.counts);
        if is_beyond && !std::mem::replace(&mut self.is_beyond, is_beyond) {
            self.stop_due |= self.is_going();
            self.refuse(now, BEYOND_RANGE);
        }
        self.is_beyond = is_beyond;
    }

    /// The reported position of the axis at a sample, and whether it moves.
    fn locate(&mut self, now: Nanos, tick: u64) -> (i64, AxisStatus) {
        let none = AxisStatus(0);
        let true_pulses = self.reported_pulses(self.travel);
        match self.motion.clone() {
            Motion::Rest | Motion::Setting(..) => (self.at_rest(true_pulses), none),
            Motion::LetGo(stand_move, since) => {
                // A move that a stop has ended at once is reported too, or its end would not be seen.
                let is_over = stand_move.target == stand_move.from || self.stopped_at.is_some();
                if !is_over && self.travel == stand_move.from && !self.has_status_moved() {
                    if now.since(since) > self.still_limit(stand_move.command) {
                        self.motion = Motion::Rest;
                        self.stop_due = true;
                        self.refuse(
                            now,
                            "the crosshead does not start to move; check PC control, the emergency stop and the limit switches",
                        );
                    }
                    return (self.at_rest(true_pulses), none);
                }
                let command = stand_move.command;
                let from = self.at_rest(self.reported_pulses(stand_move.from));
                let course = MotionProfile::to_rest(
                    position_from_pulses(from, MM_PER_PULSE),
                    position_from_pulses(command.target_pulses, MM_PER_PULSE),
                    command.speed,
                    command.acceleration,
                );
                self.rests_at = None;
                // A state reported before it began is old.
                self.status = None;
                let stopped_tick = self.stopped_at.map(|_| tick);
                self.motion = Motion::Moving {
                    stand_move,
                    course: stopped_tick.map_or(course, |_| course.stopped_at(Seconds(0.0))),
                    start_tick: tick,
                    stopped_tick,
                };
                let stopping = stopped_tick.map_or(none, |_| AxisStatus::STOPPING);
                (from, AxisStatus::MOVING | stopping)
            }
            Motion::Moving { stand_move, course, start_tick, stopped_tick } => {
                self.follow_course(now, tick, stand_move, course, (start_tick, stopped_tick))
            }
        }
    }

    fn follow_course(
        &mut self,
        now: Nanos,
        tick: u64,
        stand_move: StandMove,
        course: MotionProfile,
        (start_tick, stopped_tick): (u64, Option<u64>),
    ) -> (i64, AxisStatus) {
        let true_pulses = self.reported_pulses(self.travel);
        let secs = |from: u64| Seconds((tick - from) as f64 * TICK.0 as f64 * 1e-9);
        let is_off = |pulses: i64, tolerance_mm: f64| {
            (true_pulses - pulses).abs() as f64 * MM_PER_PULSE > tolerance_mm
        };
        let is_still = self.is_still(now, stand_move.command);
        let target = stand_move.command.target_pulses;
        if stopped_tick.is_none() {
            let since = secs(start_tick);
            let is_over = since.0 >= course.duration().0;
            let is_there = !is_off(target, REST_TOLERANCE_MM);
            if is_still && is_over && is_there {
                self.motion = Motion::Rest;
                self.rests_at = Some(target);
                return (target, AxisStatus(0));
            }
            let is_cut_short = self.stopped_at.is_some() || is_still && !is_there;
            if !is_cut_short {
                let here = pulses_of(course.position(since));
                let way =
                    (here - self.reported_pulses(stand_move.from)).abs() as f64 * MM_PER_PULSE;
                let tolerance =
                    REST_TOLERANCE_MM + stand_move.command.speed.0 * LAG.0 + SPEED_TOLERANCE * way;
                // The measured position where it is off the course: the check of the path sees it.
                let reported = if is_off(here, tolerance) { true_pulses } else { here };
                return (reported, AxisStatus::MOVING);
            }
            let course = course.stopped_at(since);
            let here = pulses_of(course.position(Seconds(0.0)));
            self.motion =
                Motion::Moving { stand_move, course, start_tick, stopped_tick: Some(tick) };
            return (here, AxisStatus::MOVING | AxisStatus::STOPPING);
        }
        if is_still {
            self.motion = Motion::Rest;
            self.rests_at = None;
            return (true_pulses, AxisStatus(0));
        }
        let here = pulses_of(course.position(secs(stopped_tick.unwrap_or(tick))));
        (here, AxisStatus::MOVING | AxisStatus::STOPPING)
    }

    /// The commanded position as long as the axis is near it, else the true one.
    fn at_rest(&self, true_pulses: i64) -> i64 {
        let near =
            |pulses: &i64| (pulses - true_pulses).abs() as f64 * MM_PER_PULSE <= REST_TOLERANCE_MM;
        self.rests_at.filter(near).unwrap_or(true_pulses)
    }

    pub(super) fn has_status_moved(&self) -> bool {
        self.status.is_some_and(|status| status.is_moving)
    }

    /// Longest time without a new travel of a crosshead that moves.
    fn still_limit(&self, command: MoveTo) -> Nanos {
        let pulses = STILL_PULSES * MM_PER_PULSE / command.speed.0.max(1e-6);
        Nanos(STILL.0 + (pulses * 1e9) as u64)
    }

    fn is_still(&self, now: Nanos, command: MoveTo) -> bool {
        let is_old = now.since(self.travel_changed) > self.still_limit(command);
        is_old || self.pace.has_status && self.status.is_some() && !self.has_status_moved()
    }
}
