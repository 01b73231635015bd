//! A controller in simulated time.

use palpate_emulators::EmulatedDevice;
use palpate_emulators::galil::{EmulatedGalilSettings, GalilEmulator, GalilModel};
use palpate_model::Nanos;

/// One controller and the time.
pub struct Bench {
    pub emulator: GalilEmulator,
    pub now: Nanos,
}

impl Bench {
    pub fn new(settings: EmulatedGalilSettings) -> Self {
        Self { emulator: GalilEmulator::new(settings), now: Nanos::ZERO }
    }

    /// On one serial line.
    pub fn serial(model: GalilModel) -> Self {
        let converter = if model == GalilModel::Dmc2143 { None } else { Some(16) };
        Self::new(EmulatedGalilSettings { model, converter, ..EmulatedGalilSettings::default() })
    }

    /// Bytes to a channel and what comes back at once.
    pub fn raw(&mut self, channel: usize, bytes: &[u8]) -> Vec<u8> {
        self.emulator.receive(self.now, channel, bytes);
        self.emulator.transmit(channel)
    }

    /// A line without its carriage return.
    pub fn ask(&mut self, line: &str) -> String {
        let answer = self.raw(0, format!("{line}\r").as_bytes());
        String::from_utf8(answer).expect("an ASCII answer")
    }

    /// The same where nothing may be refused.
    pub fn tell(&mut self, line: &str) {
        let answer = self.ask(line);
        assert!(!answer.contains('?'), "{line}: {answer}");
    }

    /// The number that an expression has.
    pub fn number(&mut self, expression: &str) -> f64 {
        let answer = self.ask(&format!("MG {expression}"));
        let text = answer.strip_suffix("\r\n:");
        let text = text.unwrap_or_else(|| panic!("{expression}: {answer}"));
        text.trim().parse().expect("a number")
    }

    /// Time passes.
    pub fn wait(&mut self, seconds: f64) {
        self.now = self.now + Nanos((seconds * 1e9).round() as u64);
        self.emulator.advance(self.now);
    }

    /// Time passes by one sample at TM 1000.
    pub fn sample(&mut self) {
        // 976 562.5 ns, and the half that is missing.
        self.wait(976_563e-9);
    }

    /// Until the profile of axis A has ended and its pulses are given.
    pub fn settle(&mut self) {
        for _ in 0..200_000 {
            self.sample();
            if !self.emulator.is_running(0) {
                self.wait(0.5);
                return;
            }
        }
        panic!("axis A is still running");
    }
}
