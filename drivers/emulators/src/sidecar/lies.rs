//! What a sidecar does that it must not, for tests.

use super::EmulatedSidecar;
use palpate_drivers::sidecar::protocol::SidecarSample;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SidecarLie {
    /// It answers nothing, sends nothing, and hears nothing. Its axis' watchdog works.
    Mute,
    /// The reported position is off by so many pulses from now on.
    Jump(i64),
    /// Its clock runs back by so many microseconds, once.
    ClockBack(u32),
    /// Its clock stands still from now on.
    ClockStuck,
    /// It acknowledges motions and does not move.
    Lazy,
    /// It acknowledges stops and does not brake. Silence stops it.
    DeafToStops,
    /// Its reported positions are in another unit: each is so many times as large.
    WrongUnits(i64),
    /// Its samples are no JSON, with NaN in them.
    NotANumber,
    /// It sends each sample so many times.
    Flood(u32),
    /// Counts beyond its converter.
    BeyondConverter,
    /// It does not brake when the host is silent. Only conformance finds that; no run may rely on it.
    WithoutWatchdog,
}

impl EmulatedSidecar {
    pub(super) fn begin_lie(&mut self) {
        match self.lie {
            Some(SidecarLie::Jump(pulses)) => self.pulse_error += pulses,
            Some(SidecarLie::ClockStuck) => self.stuck_tick = self.ticks(),
            Some(SidecarLie::ClockBack(micros)) => self.tick_error -= i64::from(micros),
            _ => {}
        }
    }

    pub(super) fn is_mute(&self) -> bool {
        self.lie == Some(SidecarLie::Mute)
    }

    pub(super) fn is_lazy(&self) -> bool {
        self.lie == Some(SidecarLie::Lazy)
    }

    pub(super) fn is_deaf_to_stops(&self) -> bool {
        self.lie == Some(SidecarLie::DeafToStops)
    }

    pub(super) fn is_without_watchdog(&self) -> bool {
        self.lie == Some(SidecarLie::WithoutWatchdog)
    }

    pub(super) fn copies(&self) -> u32 {
        match self.lie {
            Some(SidecarLie::Flood(copies)) => copies,
            _ => 1,
        }
    }

    pub(super) fn falsify(&self, sample: &mut SidecarSample) {
        match self.lie {
            Some(SidecarLie::ClockStuck) => sample.ticks = self.stuck_tick,
            Some(SidecarLie::WrongUnits(times)) => {
                sample.pulses = sample.pulses.map(|pulses| pulses * times);
            }
            Some(SidecarLie::BeyondConverter) => sample.counts = Some(i32::MAX),
            _ => {}
        }
    }

    pub(super) fn garble(&self, bytes: Vec<u8>) -> Vec<u8> {
        match self.lie {
            Some(SidecarLie::NotANumber) => b"{\"t\":NaN,\"c\":NaN,\"p\":NaN,\"s\":0}\n".to_vec(),
            _ => bytes,
        }
    }
}
