//! my-sidecar: a stage with a load cell for palpate, one file. As it is, stage and cell are simulated: replace the lines that are
//! marked. The sidecar protocol is in palpate's documents, "The sidecar protocol".
//!
//! SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate.

use serde_json::{Value, json};
use std::io::{self, BufRead, Read, Write};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

const NAME: &str = "my-sidecar";
const RATE: f64 = 200.0;
const SILENCE: Duration = Duration::from_millis(200);
const MM_PER_PULSE: f64 = 0.0025;
const TRAVEL_MM: f64 = 60.0;
const SPEED_MAX: f64 = 10.0;
const ACCELERATION: f64 = 50.0;
const VOLTS_PER_COUNT: f64 = 5.0 / 8_388_608.0;
/// Where the home switch closes, from where the stage was switched on, in mm.
const HOME_MM: f64 = -5.0;
const LINE_MAX: usize = 205;
const MOVING: u32 = 1;
const STOPPING: u32 = 2;
const HOME: u32 = 4;
const MOTOR_ON: u32 = 32;

/// A motion with a trapezoid of speed, or its braking; in mm and s.
#[derive(Clone, Copy)]
struct Motion {
    start: f64,
    end: f64,
    entry: f64,
    top: f64,
    acceleration: f64,
    duration: f64,
    begun: Instant,
    is_stopping: bool,
}

impl Motion {
    fn state(&self) -> (f64, f64) {
        let (t, a, sign) = (self.begun.elapsed().as_secs_f64(), self.acceleration, (self.end - self.start).signum());
        let ramp = self.top / a;
        let (way, speed) = match t {
            t if t >= self.duration => return (self.end, 0.0),
            t if self.is_stopping => (self.entry * t - a * t * t / 2.0, self.entry - a * t),
            t if t < ramp => (a * t * t / 2.0, a * t),
            t if t > self.duration - ramp => {
                let left = self.duration - t;
                ((self.end - self.start).abs() - a * left * left / 2.0, a * left)
            }
            t => (self.top * (t - ramp / 2.0), self.top),
        };
        (self.start + sign * way, sign * speed)
    }
}

/// REPLACE what is simulated here with your drive, your switches and your load cell.
struct Stage {
    motion: Motion,
    is_motor_on: bool,
}

impl Stage {
    fn position(&self) -> f64 {
        self.motion.state().0
    }

    fn is_moving(&self) -> bool {
        self.motion.begun.elapsed().as_secs_f64() < self.motion.duration
    }

    fn begin_move(&mut self, end: f64, speed: f64, acceleration: f64) {
        let start = self.position();
        let way = (end - start).abs();
        let top = speed.min((way * acceleration).sqrt());
        let duration = if way > 0.0 { way / top + top / acceleration } else { 0.0 };
        self.motion =
            Motion { start, end, entry: 0.0, top, acceleration, duration, begun: Instant::now(), is_stopping: false };
    }

    fn brake(&mut self) {
        let (start, velocity) = self.motion.state();
        if self.is_moving() && !self.motion.is_stopping {
            let (a, entry) = (self.motion.acceleration, velocity.abs());
            let end = start + velocity.signum() * entry * entry / (2.0 * a);
            let begun = Instant::now();
            self.motion = Motion { start, end, entry, duration: entry / a, begun, is_stopping: true, ..self.motion };
        }
    }

    fn halt(&mut self) {
        let here = self.position();
        self.motion = Motion { start: here, end: here, duration: 0.0, ..self.motion };
    }

    /// At rest 1.28 V, and a spring of 0.2 N/mm at 20 mm, 0.4 V/N.
    fn counts(&self) -> i64 {
        let noise = (Instant::now().duration_since(self.motion.begun).subsec_nanos() % 1000) as f64 * 5e-7;
        ((1.28 + 0.4 * 0.2 * (self.position() - 20.0).max(0.0) + noise) / VOLTS_PER_COUNT).round() as i64
    }

    fn status(&self) -> u32 {
        let is_moving = self.is_moving();
        let bits = [
            (is_moving, MOVING),
            (is_moving && self.motion.is_stopping, STOPPING),
            (self.position() <= HOME_MM, HOME),
            (self.is_motor_on, MOTOR_ON),
        ];
        bits.iter().filter(|(is_set, _)| *is_set).map(|(_, bit)| bit).sum()
    }

    fn temperature(&self) -> f64 {
        21.5
    }
}

/// The protocol. Nothing below needs to be changed.
struct Sidecar {
    stage: Stage,
    start: Instant,
    heard: Instant,
    boot: u32,
    samples: u64,
    has_greeted: bool,
    is_sending: bool,
}

impl Sidecar {
    fn ticks(&self) -> u32 {
        self.start.elapsed().as_micros() as u32
    }

    fn description(&self, n: u64) -> Value {
        json!({"ok": n, "sidecar": 1, "name": NAME, "boot": self.boot, "tick_ns": 1000, "rate": RATE,
            "silence_ms": SILENCE.as_millis() as u64,
            "axis": {"mm_per_pulse": MM_PER_PULSE, "travel_mm": TRAVEL_MM, "speed_max": SPEED_MAX,
                "acceleration": ACCELERATION, "lag_ms": 5},
            "cell": {"counts_min": -8388608, "counts_max": 8388607, "volts_per_count": VOLTS_PER_COUNT, "noise_v": 3e-4},
            "sensors": [{"name": "temperature", "unit": "°C"}]})
    }

    /// The answer to a line, if it has one.
    fn take(&mut self, line: &[u8]) -> Option<Value> {
        let read = serde_json::from_slice::<Value>(line).ok().filter(|_| line.len() <= LINE_MAX);
        let Some((n, word, message)) = read.as_ref().and_then(|m| Some((m["n"].as_u64()?, m["do"].as_str()?, m))) else {
            return Some(json!({"no": null, "why": "not understood"}));
        };
        if !self.has_greeted && word != "hello" {
            return Some(json!({"no": n, "why": "hello first"}));
        }
        match self.obey(n, word, message) {
            Ok(answer) => {
                self.heard = Instant::now();
                answer
            }
            Err(why) => Some(json!({"no": n, "why": why})),
        }
    }

    fn obey(&mut self, n: u64, word: &str, message: &Value) -> Result<Option<Value>, &'static str> {
        match word {
            "hello" if message["version"] != 1 => return Err("only version 1 is spoken"),
            "hello" => {
                self.stage.brake();
                (self.has_greeted, self.is_sending) = (true, false);
                return Ok(Some(self.description(n)));
            }
            "beat" => return Ok(Some(json!({"ok": n, "t": self.ticks()}))),
            "start" => self.is_sending = true,
            "enable" => self.stage.is_motor_on = true,
            "move" => {
                let real = |key: &str| message[key].as_f64().filter(|value| *value > 0.0).ok_or("a key is missing");
                let to = message["to"].as_i64().ok_or("a key is missing")?;
                let (speed, acceleration) = (real("speed")?, real("acceleration")?);
                if !self.stage.is_motor_on {
                    return Err("the motor is off");
                }
                if self.stage.is_moving() {
                    return Err("the axis is moving");
                }
                if speed > SPEED_MAX * 1.000001 || acceleration > ACCELERATION * 1.000001 {
                    return Err("speed or acceleration is out of range");
                }
                self.stage.begin_move(to as f64 * MM_PER_PULSE, speed, acceleration);
            }
            "stop" => self.stage.brake(),
            "halt" => self.stage.halt(),
            "bye" => {
                self.stage.brake();
                self.is_sending = false;
                return Ok(None);
            }
            _ => return Err("not known"),
        }
        Ok(Some(json!({"ok": n})))
    }

    fn sample(&mut self) -> Value {
        self.samples += 1;
        let mut sample = json!({"t": self.ticks(), "c": self.stage.counts(),
            "p": (self.stage.position() / MM_PER_PULSE).round() as i64, "s": self.stage.status()});
        if self.samples % 100 == 0 {
            sample["v"] = json!([self.stage.temperature()]);
        }
        sample
    }
}

fn say(message: &Value) -> io::Result<()> {
    // Other characters than ASCII are written as JSON escapes.
    let mut text = String::new();
    for c in message.to_string().chars() {
        if c.is_ascii() { text.push(c) } else { text += &format!("\\u{:04x}", c as u32) }
    }
    let mut out = io::stdout().lock();
    writeln!(out, "{text}")?;
    out.flush()
}

fn main() {
    let now = Instant::now();
    let motion = Motion {
        start: 0.0,
        end: 0.0,
        entry: 0.0,
        top: 0.0,
        acceleration: 1.0,
        duration: 0.0,
        begun: now,
        is_stopping: false,
    };
    let time = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let mut sidecar = Sidecar {
        stage: Stage { motion, is_motor_on: false },
        start: now,
        heard: now,
        boot: time.as_nanos() as u32 | 1,
        samples: 0,
        has_greeted: false,
        is_sending: false,
    };
    let (sender, lines) = sync_channel::<Vec<u8>>(64);
    std::thread::spawn(move || {
        let mut input = io::stdin().lock();
        loop {
            let mut line = Vec::new();
            // A line without an end is cut, and then garbled.
            match (&mut input).take(4096).read_until(b'\n', &mut line) {
                Ok(1..) if sender.send(line).is_ok() => {}
                _ => return,
            }
        }
    });
    let period = Duration::from_secs_f64(1.0 / RATE);
    let mut due = Instant::now();
    // The link has ended when its input ends, or when nothing can be written: then the axis brakes, and this goes on until it stands.
    let mut is_open = say(&json!({"boot": sidecar.boot})).is_ok();
    loop {
        match lines.recv_timeout(due.saturating_duration_since(Instant::now())) {
            Ok(line) if !line.trim_ascii().is_empty() => {
                let answer = if is_open { sidecar.take(line.trim_ascii()) } else { None };
                is_open = is_open && answer.is_none_or(|answer| say(&answer).is_ok());
            }
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                is_open = false;
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
            }
        }
        if !is_open || sidecar.heard.elapsed() >= SILENCE {
            sidecar.stage.brake();
        }
        if Instant::now() >= due {
            due = (due + period).max(Instant::now().checked_sub(5 * period).unwrap_or(due));
            if sidecar.is_sending {
                let sample = sidecar.sample();
                let is_said = say(&sample).is_ok();
                sidecar.is_sending = is_said;
                is_open = is_open && is_said;
            }
        }
        if !is_open && !sidecar.stage.is_moving() {
            return;
        }
    }
}
