//! A sine in contour mode: increments over 2^n samples, pushed a little before the controller needs them.
//!
//! DMC-40x0 command reference, `CM`, `DT`, `CD`: the controller goes straight over each increment. When palpate falls
//! silent the buffer runs empty within [`LEAD`], and the axis stands.

use super::protocol::LINE_MAX;
use super::settings::GalilSettings;
use palpate_model::Nanos;
use palpate_model::rig::{Oscillation, SinePath};
use palpate_model::units::{Position, Seconds};

/// `DT`: an increment lasts 2^3 samples, 8 ms. Between two of them a sine is off a straight line by `a w^2 t^2 / 8`, at
/// 4096 counts/s^2 a thirtieth of a pulse.
const INTERVAL: u32 = 3;
/// Lead of the increments: a busy computer may be so late, and the axis goes on for so long without it.
const LEAD: Nanos = Nanos::from_millis(400);
/// Rounding error of a double with as many counts as a travel has.
const ROUNDING: f64 = 1e-6;
/// Increments that begin a sine; a question has to fit behind them into the line.
const FIRST: usize = 2;

#[derive(Clone, Debug)]
pub struct SineFeed {
    path: SinePath,
    axis: char,
    /// Counts of a millimetre, signed.
    counts_per_mm: f64,
    tick: Nanos,
    /// Ticks from start to rest, and those that were sent.
    total: u64,
    sent: u64,
    /// Counts from the start, as sent.
    place: i64,
    /// `DT` as it was sent.
    interval: u32,
    begun_at: Nanos,
    is_over: bool,
}

impl SineFeed {
    #[must_use]
    pub fn new(command: &Oscillation, settings: &GalilSettings, tick: Nanos) -> Self {
        let length = Seconds(tick.seconds().0);
        let total = u64::from(command.period_ticks) * u64::from(command.cycles);
        Self {
            path: SinePath::new(Position(0.0), command, settings.mm_per_pulse, length),
            axis: settings.axis,
            counts_per_mm: settings.sign() as f64 / settings.mm_per_pulse,
            tick,
            // The shortest increment lasts two samples; at its end a sine stands anyway.
            total: total.next_multiple_of(2),
            sent: 0,
            place: 0,
            interval: 0,
            begun_at: Nanos::ZERO,
            is_over: false,
        }
    }

    pub fn begin(&mut self) -> Vec<String> {
        let mut commands = vec![format!("CM{}", self.axis)];
        for _ in 0..FIRST {
            commands.extend(self.segment());
        }
        commands
    }

    pub fn mark_begun(&mut self, now: Nanos) {
        self.begun_at = now;
    }

    /// The next increment, with its `DT` where that changes.
    fn segment(&mut self) -> Vec<String> {
        let left = self.total - self.sent;
        let fits = (0..=INTERVAL).rev().find(|n| 1 << n <= left);
        // Below two samples there is nothing left.
        let n = fits.filter(|n| *n > 0).unwrap_or(0);
        let mut commands = Vec::new();
        if n != self.interval || n == 0 {
            commands.push(format!("DT{n}"));
        }
        self.interval = n;
        if n == 0 {
            self.is_over = true;
            commands.push(format!("CD{}=0", self.axis));
            return commands;
        }
        self.sent += 1 << n;
        let at = Seconds(self.sent as f64 * self.tick.seconds().0);
        // Upwards, for between two increments the counter shows the last whole count, below the place that it is at; so
        // what it shows is within one count of the sine. Not confirmed for any board. Far below 2^31 counts.
        let place = (self.path.position(at).0 * self.counts_per_mm - ROUNDING).ceil() as i64;
        commands.push(format!("CD{}={}", self.axis, place - self.place));
        self.place = place;
        commands
    }

    fn lead(&self, now: Nanos) -> i64 {
        let sent = (self.sent * self.tick.0) as i64;
        sent - now.since(self.begun_at).0 as i64
    }

    /// Whether the controller has come to the end of what was sent before the end of the sine.
    pub fn is_dry(&self, now: Nanos) -> bool {
        !self.is_over && self.lead(now) <= 0
    }

    /// Time of the next increments; `None` once all are sent.
    pub fn due(&self) -> Option<Nanos> {
        let sent = Nanos(self.sent * self.tick.0);
        (!self.is_over).then(|| Nanos((self.begun_at + sent).0.saturating_sub(LEAD.0)))
    }

    pub fn take(&mut self, now: Nanos) -> Option<Vec<String>> {
        self.due().filter(|due| *due <= now)?;
        let mut commands: Vec<String> = Vec::new();
        let mut length = 0;
        // A `DT` and an increment of five digits with their terminators.
        const LONGEST: usize = 16;
        while !self.is_over && length + LONGEST <= LINE_MAX {
            let segment = self.segment();
            length += segment.iter().map(|one| one.len() + 1).sum::<usize>();
            commands.extend(segment);
        }
        Some(commands)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::galil::settings::tests::thesis;
    use palpate_model::units::MmPerS2;

    fn feed(period_ticks: u32, cycles: u32) -> SineFeed {
        let command = Oscillation {
            amplitude_pulses: 50,
            period_ticks,
            cycles,
            acceleration: MmPerS2(61.44),
        };
        SineFeed::new(&command, &thesis(), Nanos(976_563))
    }

    #[test]
    fn increments_follow_the_sine_and_end_where_they_began() {
        for (period, cycles) in [(2048, 2), (1000, 3), (333, 1)] {
            let mut feed = feed(period, cycles);
            let mut commands = feed.begin();
            let mut now = Nanos::ZERO;
            while let Some(due) = feed.due() {
                now = now.max(due);
                let line = feed.take(now).unwrap();
                let length: usize = line.iter().map(|one| one.len() + 1).sum();
                assert!(!line.is_empty() && length <= LINE_MAX, "{line:?}");
                commands.extend(line);
            }
            assert_eq!(commands[0], "CMA");
            assert_eq!(&commands[commands.len() - 2..], ["DT0", "CDA=0"]);
            let (mut ticks, mut place, mut n) = (0_u64, 0_i64, 0_u32);
            for command in &commands[1..commands.len() - 2] {
                if let Some(interval) = command.strip_prefix("DT") {
                    n = interval.parse().unwrap();
                    continue;
                }
                place += command.strip_prefix("CDA=").unwrap().parse::<i64>().unwrap();
                ticks += 1 << n;
                let angle = std::f64::consts::TAU * ticks as f64 / f64::from(period);
                let exact = 50.0 * (1.0 - angle.cos());
                // Less than a count above; at an odd end the sine stands for a sample more.
                let above = place as f64 - exact;
                assert!((-0.01..1.01).contains(&above), "{ticks}: {above}");
            }
            assert_eq!(place, 0);
            assert_eq!(ticks, (u64::from(period * cycles)).next_multiple_of(2));
        }
    }

    #[test]
    fn no_more_is_sent_than_the_lead() {
        let mut feed = feed(4096, 1);
        feed.begin();
        feed.mark_begun(Nanos(0));
        while feed.take(Nanos(0)).is_some() {}
        assert!(feed.lead(Nanos(0)) < LEAD.0 as i64 + 100_000_000);
        assert!(!feed.is_dry(LEAD) && feed.is_dry(Nanos(2 * LEAD.0)));
    }
}
