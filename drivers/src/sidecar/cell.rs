//! A sidecar as a load cell beside another axis: it is only listened to.

use super::budget::{FaultLimit, LinkBudget};
use super::connect::{DEVICE, connect, start_samples};
use super::description::SidecarCell;
use super::protocol::{HostMessage, ReceivedItem, SidecarMessage, SidecarParser, SidecarSample};
use super::{FAREWELL_NUMBER, FLOODED, SidecarCellSettings};
use crate::board_clock::{BoardClock, BoardTime};
use crate::cell::{
    CellDescription, CellDevice, CellDialogue, CellReports, CellSample, silence_max,
};
use crate::text::{DeviceError, OpenedCell};
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::units::Volts;
use std::sync::Arc;

const RESTARTED: &str = "the sidecar has restarted; check its supply";

impl CellDevice for SidecarCellSettings {
    fn open(
        &self,
        link: &mut dyn Link,
        clock: &HostClock,
        name: &Arc<str>,
    ) -> Result<OpenedCell, DeviceError> {
        let mut connected = connect(link, clock, name, self.serial_number.as_deref())?;
        let description = connected.description.clone();
        let Some(cell) = description.cell else {
            return Err(DeviceError::unfit(DEVICE, "it has no load cell"));
        };
        start_samples(link, clock, name, &mut connected)?;
        Ok(OpenedCell {
            description: CellDescription {
                identity: format!(
                    "{}, {} values per second",
                    description.identity(),
                    description.rate
                ),
                adc: cell.adc(),
                noise_expected: Volts(self.noise_v.unwrap_or(cell.noise_v)),
                rate: description.rate,
                delay: cell.delay(),
                newtons_per_volt: cell.newtons_per_volt,
            },
            dialogue: Box::new(SidecarCellDialogue {
                parser: SidecarParser::new(description.crc, false),
                clock: BoardClock::new(description.tick_ns),
                cell,
                reports: CellReports::new(clock()),
                budget: LinkBudget::new(description.rate, clock()),
                fault_limit: FaultLimit::default(),
                garbled: 0,
                rate: description.rate,
                fault: None,
            }),
            raw: connected.raw,
            closing_bytes: HostMessage::Bye.line(FAREWELL_NUMBER, description.crc),
        })
    }
}

struct SidecarCellDialogue {
    parser: SidecarParser,
    clock: BoardClock,
    cell: SidecarCell,
    reports: CellReports,
    budget: LinkBudget,
    fault_limit: FaultLimit,
    garbled: u64,
    rate: f64,
    fault: Option<String>,
}

impl SidecarCellDialogue {
    fn on_sample(&mut self, now: Nanos, sample: &SidecarSample) {
        let Some(counts) = sample.counts else {
            self.garbled += 1;
            return;
        };
        let time = match self.clock.take(now, sample.ticks) {
            BoardTime::Repeated => {
                self.garbled += 1;
                return;
            }
            BoardTime::At(time) => time,
            BoardTime::Restarted(time) => {
                self.reports.push_trouble(RESTARTED);
                time
            }
        };
        let is_beyond = counts <= self.cell.counts_min || counts >= self.cell.counts_max;
        self.reports.set_beyond_range(is_beyond, super::BEYOND_RANGE);
        self.reports.push_counts(now, Some(time), counts, self.cell.volts_per_count);
    }

    fn on_item(&mut self, now: Nanos, item: ReceivedItem) {
        match item {
            ReceivedItem::Message(SidecarMessage::Sample(sample)) => self.on_sample(now, &sample),
            ReceivedItem::Message(SidecarMessage::Boot(_)) => {
                self.fault = Some(RESTARTED.to_owned());
            }
            ReceivedItem::Message(SidecarMessage::Fault(why)) => {
                if self.fault_limit.allows(now) {
                    self.reports.push_trouble(&format!("the sidecar reports: {why}"));
                }
            }
            ReceivedItem::Message(_) => {}
            ReceivedItem::Garbled => self.garbled += 1,
        }
    }
}

impl CellDialogue for SidecarCellDialogue {
    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        self.budget.take_bytes(now, bytes.len());
        for byte in bytes {
            if self.fault.is_some() {
                return;
            }
            if let Some(item) = self.parser.take(*byte) {
                self.budget.take_item(now);
                self.on_item(now, item);
            }
            if self.budget.is_exceeded() {
                self.fault = Some(format!("{FLOODED}; correct its program"));
            }
        }
    }

    fn take_sample(&mut self) -> Option<CellSample> {
        self.reports.take_sample()
    }

    fn take_trouble(&mut self) -> Option<String> {
        self.reports.take_trouble()
    }

    fn garbled(&self) -> u64 {
        self.garbled
    }

    /// After a restart it sends nothing until it is opened again.
    fn is_dead(&self, now: Nanos) -> Option<String> {
        if self.fault.is_some() {
            return self.fault.clone();
        }
        let is_silent = now.since(self.reports.newest()) > silence_max(self.rate);
        is_silent.then(|| {
            "the sidecar has sent no value for a second; check its program and cable".into()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dialogue(rate: f64) -> SidecarCellDialogue {
        SidecarCellDialogue {
            parser: SidecarParser::new(false, false),
            clock: BoardClock::new(1_000),
            cell: SidecarCell {
                counts_min: -1_000,
                counts_max: 1_000,
                volts_per_count: 1e-3,
                noise_v: 0.0,
                delay_ms: 0.0,
                newtons_per_volt: None,
            },
            reports: CellReports::new(Nanos::ZERO),
            budget: LinkBudget::new(rate, Nanos::ZERO),
            fault_limit: FaultLimit::default(),
            garbled: 0,
            rate,
            fault: None,
        }
    }

    /// Lines of a millisecond each turn, for two seconds; when the link has ended, and how many troubles there were.
    fn turns(rate: f64, lines: impl Fn(u64) -> String) -> (Option<u64>, usize) {
        let mut cell = dialogue(rate);
        let mut troubles = 0;
        let ended = (1..=2_000).find(|ms| {
            let now = Nanos::from_millis(*ms);
            cell.handle_bytes(now, lines(*ms).as_bytes());
            while cell.take_sample().is_some() {}
            troubles += std::iter::from_fn(|| cell.take_trouble()).count();
            cell.is_dead(now).is_some()
        });
        (ended, troubles)
    }

    #[test]
    fn a_flood_ends_the_link_and_what_was_promised_does_not() {
        let sample = |micros: u64| format!("{{\"t\":{micros},\"c\":5}}\n");
        assert_eq!(turns(1_000.0, |ms| sample(ms * 1_000)), (None, 0));
        let many = |ms: u64| (0..10).map(|i| sample(ms * 1_000 + i * 100)).collect();
        assert!(turns(10.0, many).0.is_some_and(|ms| ms < 100));
        for word in ["{\"ok\":0}\n", "{\"fault\":\"hot\"}\n"] {
            let (ended, troubles) =
                turns(1_000.0, |ms| format!("{}{}", sample(ms * 1_000), word.repeat(20)));
            assert!(ended.is_some() && troubles <= 20, "{word}: {ended:?} {troubles}");
        }
    }
}
