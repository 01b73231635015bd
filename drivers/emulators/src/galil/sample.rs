//! One sample of the controller after the other.

use super::axis::{AxisEvent, AxisMotion};
use super::contour::ContourStep;
use super::data_record::{GeneralBlock, build_record};
use super::record::RecordSource;
use super::scope::bits;
use super::settings::AxisSetting;
use super::{Answer, GalilEmulator};
use palpate_drivers::sim::MM_PER_PULSE;
use palpate_model::Nanos;

impl GalilEmulator {
    pub(super) fn run_samples_until(&mut self, now: Nanos) {
        while let Some(at) = self.clock.next_at().filter(|at| *at <= now) {
            self.now = at;
            self.sample();
        }
        self.now = self.now.max(now);
        if self.boots_until.is_some_and(|until| until <= now) {
            self.boots_until = None;
            if self.settings.is_serial {
                // The answer to `RS`; after a reset by fault no client waits for it.
                self.clients[0].send(b":");
            }
        }
        self.take_waiting_bytes();
    }

    fn sample(&mut self) {
        self.clock.advance();
        self.read_switches();
        let dt = self.clock.nominal_period();
        let rate = if self.settings.model.is_21x3() {
            AxisSetting::Deceleration
        } else {
            AxisSetting::LimitDeceleration
        };
        self.contour_sample(dt);
        let mut is_limit_met = false;
        for index in 0..self.axes.len() {
            match self.axes[index].sample(dt, self.polarity, rate) {
                Some(AxisEvent::Limit) => is_limit_met = true,
                Some(AxisEvent::Homed) => {
                    let shift = self.axes[index].zero();
                    self.shift_counter(index, shift);
                }
                None => {}
            }
            self.axes[index].smooth_pulses();
        }
        let place = self.axes[0].filtered * MM_PER_PULSE;
        self.plant.advance(place, self.clock.period());
        self.record_sample();
        if is_limit_met && let Some(line) = self.program.find("LIMSWI") {
            self.threads[0].call_automatic(line);
        }
        self.run_threads();
        self.push_record();
    }

    /// Accounts for a counter that was lowered by `counts`.
    pub(super) fn shift_counter(&mut self, axis: usize, counts: f64) {
        if axis == 0 {
            self.plant.shift_counter(counts * MM_PER_PULSE);
        }
    }

    /// Switches close to ground; those of axes without a slide are open.
    fn read_switches(&mut self) {
        let inputs = &mut self.axes[0].inputs;
        inputs.forward = !self.plant.is_forward_limit();
        inputs.reverse = !self.plant.is_reverse_limit();
        inputs.home = !self.plant.is_home();
    }

    fn contour_sample(&mut self, dt: f64) {
        // A stop, a limit or an abort takes an axis out of the mode, and with it the mode ends.
        let has_axis_left =
            self.contour.axes.iter().any(|axis| self.axes[*axis].motion != AxisMotion::Contour);
        if has_axis_left {
            for axis in self.contour.axes.clone() {
                self.axes[axis].stop(AxisSetting::Deceleration, 51);
            }
            self.contour.cancel();
        }
        let axes = self.contour.axes.clone();
        let step = self.contour.sample();
        let by = match &step {
            ContourStep::By(by) => by.as_slice(),
            ContourStep::Idle | ContourStep::End => &[],
        };
        for (index, axis) in axes.iter().enumerate() {
            let axis = &mut self.axes[*axis];
            let counts = by.get(index).copied().unwrap_or(0.0);
            axis.profile.place += counts;
            axis.profile.velocity = counts / dt;
            if step == ContourStep::End {
                // Increments are whole counts; what is not is rounding of their shares.
                axis.profile.place = axis.profile.place.round();
                axis.motion = AxisMotion::Rest;
                axis.stop_code = 51;
            }
        }
    }

    fn record_sample(&mut self) {
        let Some(at) = self.recorder.due(self.clock.count()) else {
            return;
        };
        for index in 0..self.recorder.arrays.len() {
            let value = self.recorded(&self.recorder.sources[index]);
            let name = &self.recorder.arrays[index];
            // An array that was taken away or made smaller meanwhile records nothing.
            if let Ok(array) = self.memory.array_mut(name)
                && let Some(element) = array.get_mut(at)
            {
                *element = value;
            }
        }
    }

    /// The number that a source gives at this sample.
    fn recorded(&self, source: &RecordSource) -> f64 {
        match source {
            RecordSource::Time => self.clock.count() as f64,
            RecordSource::Analog(input) => self.analog.as_ref().map_or(0.0, |analog| {
                let counts = analog.counts(*input, self.input_volts(*input));
                match analog.range(*input) {
                    Some(range) if range.abs() > 2.0 => f64::from(counts),
                    _ => f64::from(counts.cast_signed()),
                }
            }),
            RecordSource::Axis(word, axis) => self.axis_operand(word, *axis).unwrap_or(0.0),
            RecordSource::Controller(word) => self.controller_operand(word).unwrap_or(0.0),
        }
    }

    /// Signal at an analog input: the load cell's at the first, nothing at others.
    pub(super) fn input_volts(&self, input: usize) -> f64 {
        if input == 0 { self.plant.volts().0 } else { 0.0 }
    }

    /// `QR`.
    pub(super) fn data_record(&self) -> Vec<u8> {
        let general = GeneralBlock {
            sample: self.clock.count(),
            outputs: self.outputs,
            error: self.error.0,
            threads: self.running_threads(),
            has_echo: self.clients[0].has_echo,
            contour: (self.contour.done, self.contour.free() as u16),
            contouring: bits((0..8).map(|axis| self.contour.axes.contains(&axis))),
            handles: bits(self.clients.iter().map(|client| client.is_open)),
        };
        let analog: Vec<u16> = self.analog.as_ref().map_or_else(Vec::new, |analog| {
            (0..self.axes.len())
                .map(|input| analog.counts(input, self.input_volts(input)))
                .collect()
        });
        build_record(self.settings.model, &general, &self.axes, &analog)
    }

    fn push_record(&mut self) {
        if let Some((every, to)) = self.pushed
            && self.clock.count().is_multiple_of(every)
        {
            let bytes = self.data_record();
            self.clients[to].send(&bytes);
        }
    }

    /// The answer to a statement of a program is unsolicited text.
    pub(super) fn send_program_output(&mut self, answer: Answer) {
        match answer {
            Answer::Text(text) => self.send_unsolicited(&format!("{text}\r\n")),
            Answer::Open(text) => self.send_unsolicited(&text),
            Answer::Done | Answer::Bytes(_) | Answer::Silent => {}
        }
    }
}
