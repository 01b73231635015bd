//! The load cell's signal of a fitted record, and where its zero was seen.

use crate::analysed_session;

use super::{SourceError, TouchPoint, calibration_of, curve_of, decisions, records, touches};
use palpate_model::calibration::HysteresisLoop;
use palpate_model::rig::Phase;
use palpate_model::units::{Position, Seconds, Volts};
use palpate_protocols::engine::Record;
use palpate_rheology::fit::{Signal, UnloadedMean};
use palpate_sessions::{SampleRow, Session};

/// So far before the contact position the probe is taken to touch nothing, in mm: fifty times what a contact position is
/// uncertain by. Tissue that follows a probe further than this would pass for drift.
const CLEARANCE_MM: f64 = 1.0;
/// The zero is averaged over so long, in s: many samples, and a small part of the time in which it drifts.
const MEAN_SECS: f64 = 0.25;
/// The zero is looked at so long before and after a record, in s, and at least so many times its length.
const AROUND_SECS: f64 = 120.0;
const AROUND_LENGTHS: f64 = 2.0;

/// The signal at these rows of a session, and the touches that found its contact position. Neither does it count out of contact in the intervals left out, in s since the
/// session's first sample. `None` where a tare or a contact position is missing before them.
pub(super) fn of_session(
    session: &Session,
    rows: &[usize],
    left_out_s: &[[f64; 2]],
) -> Result<Option<(Signal, Vec<TouchPoint>)>, SourceError> {
    let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else { return Ok(None) };
    let volts: Option<Vec<f64>> = rows.iter().map(|&row| session.rows[row].volts).collect();
    let decisions = decisions(session)?;
    let Some((volts, span)) =
        volts.zip(ZeroSpan::of(session, &records(&decisions).collect::<Vec<_>>(), first))
    else {
        return Ok(None);
    };
    let at = |row: &SampleRow| {
        let ticks = row.tick as f64 - session.rows[first].tick as f64;
        ticks * session.manifest.tick().0
    };
    let length = at(&session.rows[last]);
    let around = AROUND_SECS.max(AROUND_LENGTHS * length);
    let is_left_out = |row: &SampleRow| {
        let since = analysed_session::time_between(&session.manifest, &session.rows[0], row).0;
        left_out_s.iter().any(|[from, to]| (*from..=*to).contains(&since))
    };
    let unloaded = session.rows[span.rows.clone()].iter();
    let unloaded = unloaded.filter(|row| span.is_unloaded(row) && !is_left_out(row));
    let unloaded = unloaded.filter_map(|row| Some((at(row), row.volts?)));
    let near = unloaded.filter(|(t, _)| (-around..=length + around).contains(t));
    let signal = Signal {
        volts,
        unloaded: means(near),
        curve: curve_of(session)?,
        hysteresis: HysteresisLoop::of(&calibration_of(session)?),
        contact_error_mm: span.contact_error_mm,
        contact_shift_mm: 0.0,
        search_secs: span.search_secs(session),
    };
    Ok(Some((signal, touches::of_search(session, span.search.clone()))))
}

/// The signal out of contact around presses onto a surface that was found after so many samples; times count from the session's
/// first sample. Empty where it was not recorded.
pub(crate) fn unloaded_off_surface(
    session: &Session,
    found: usize,
    surface: Position,
) -> Result<Vec<UnloadedMean>, SourceError> {
    let decisions = decisions(session)?;
    let records: Vec<_> = records(&decisions).collect();
    let span = ZeroSpan::around(session, &records, found, (found, surface.0, 0.0));
    let Some(span) = span else { return Ok(Vec::new()) };
    let rows = session.rows[span.rows.clone()].iter().filter(|row| span.is_unloaded(row));
    let at = |row| analysed_session::time_between(&session.manifest, &session.rows[0], row).0;
    Ok(means(rows.filter_map(|row| Some((at(row), row.volts?)))))
}

/// Rows around a record in which the zero may be seen.
struct ZeroSpan {
    rows: std::ops::Range<usize>,
    /// From home, in mm.
    contact_mm: f64,
    contact_error_mm: f64,
    /// Rows before the record at which the search for contact began and ended.
    search: std::ops::Range<usize>,
    mm_per_pulse: f64,
}

impl ZeroSpan {
    /// From the tare before the record up to the next one, or to a new contact position or an interlock.
    fn of(session: &Session, records: &[(u64, &Record)], first: usize) -> Option<Self> {
        let before = || records.iter().filter(|(after, _)| *after as usize <= first).rev();
        let contact = before().find_map(|(after, record)| match record {
            Record::ContactFound { position, std_error_mm } => {
                Some((*after as usize, position.0, *std_error_mm))
            }
            _ => None,
        })?;
        Self::around(session, records, first, contact)
    }

    /// The same of a contact position that was found after so many samples, with its standard uncertainty.
    fn around(
        session: &Session,
        records: &[(u64, &Record)],
        first: usize,
        (found, contact_mm, contact_error_mm): (usize, f64, f64),
    ) -> Option<Self> {
        let before = || records.iter().filter(|(after, _)| *after as usize <= first).rev();
        let is_start = |record: &Record, wanted: Phase| matches!(record, Record::PhaseStarted { phase, .. } if *phase == wanted);
        let is_tare = |record: &Record| is_start(record, Phase::Tare);
        let (start, _) = before().find(|(_, record)| is_tare(record))?;
        let mut searches = before().filter(|(after, _)| *after as usize <= found);
        let search = searches.find(|(_, record)| is_start(record, Phase::Contact));
        let search = search.map_or(found, |(after, _)| *after as usize);
        let ends = |record: &Record| {
            is_tare(record)
                || matches!(record, Record::ContactFound { .. } | Record::InterlockTripped { .. })
        };
        let mut after = records.iter().filter(|(after, _)| *after as usize > first);
        let end = after.find(|(_, record)| ends(record));
        let end = end.map_or(session.rows.len(), |(after, _)| *after as usize);
        Some(Self {
            rows: *start as usize..end.min(session.rows.len()),
            contact_mm,
            contact_error_mm,
            search: search..found.min(session.rows.len() - 1),
            mm_per_pulse: session.manifest.rig.as_ref()?.mm_per_pulse,
        })
    }

    fn search_secs(&self, session: &Session) -> f64 {
        let [from, to] = [self.search.start, self.search.end].map(|row| &session.rows[row]);
        analysed_session::time_between(&session.manifest, from, to).0
    }

    fn is_unloaded(&self, row: &SampleRow) -> bool {
        let position = row.pulses.map(|pulses| pulses as f64 * self.mm_per_pulse);
        let is_clear = |position: f64| position < self.contact_mm - CLEARANCE_MM;
        row.phase == Phase::Tare || position.is_some_and(is_clear)
    }
}

/// Means over stretches without a gap.
fn means(samples: impl Iterator<Item = (f64, f64)>) -> Vec<UnloadedMean> {
    let mut means = Vec::new();
    let (mut start, mut times, mut volts, mut count) = (0.0, 0.0, 0.0, 0usize);
    let mut close = |times: f64, volts: f64, count: usize| {
        if count > 0 {
            let over = 1.0 / count as f64;
            let (t, volts) = (Seconds(over * times), Volts(over * volts));
            means.push(UnloadedMean { t, volts, count });
        }
    };
    for (t, one) in samples {
        if count > 0 && t - start > MEAN_SECS {
            close(times, volts, count);
            (times, volts, count) = (0.0, 0.0, 0);
        }
        if count == 0 {
            start = t;
        }
        (times, volts, count) = (times + t, volts + one, count + 1);
    }
    close(times, volts, count);
    means
}
