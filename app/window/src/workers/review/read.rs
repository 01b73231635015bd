//! Reads a session through once, or twice where its edits or an analysis change its samples, and never holds
//! more than one block of rows.
//!
//! The memory of a sample is described at [`SignalTrack`](palpate_model::signal::track::Track): 26.7 bytes for time,
//! force, depth, signal and position, 267 MB for ten million samples.

use super::facts::SessionFacts;
use super::{Quantity, ReadUpdate, TrackStretch};
use palpate_analysis::analysed_session;
use palpate_model::rig::Phase;
use palpate_model::signal::track::{SEGMENT, TrackSegment};
use palpate_sessions::edits::{EditChange, Edits};
use palpate_sessions::log::{Session, SessionSummary};
use palpate_sessions::manifest::Manifest;
use palpate_sessions::record::SampleRow;
use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

/// Samples of the first piece: enough for a picture, and there at once.
const FIRST: usize = 1 << 12;

/// Reads a session as an analysis has it and sends it in pieces; `send` returns whether the receiver is still there.
pub fn read(
    path: &Path,
    analysis: Option<&str>,
    send: &dyn Fn(ReadUpdate) -> bool,
) -> Result<(), String> {
    let summary = SessionSummary::read(path).map_err(|err| err.to_string())?;
    let manifest = summary.manifest.clone();
    let edits = Edits::read(path, &manifest.session_id).map_err(|err| err.to_string())?;
    let is_moved = |change: &EditChange| matches!(change, EditChange::Contact { .. });
    let is_as_recorded = analysis.is_none() && !edits.all.iter().any(|edit| is_moved(&edit.change));
    if !send(ReadUpdate::Head(Box::new(summary))) {
        return Ok(());
    }
    let builder = RefCell::new(Builder::new(&manifest, send));
    let passing = if is_as_recorded {
        let outline = Session::scan(path, &mut |block| {
            let mut builder = builder.borrow_mut();
            block.rows().for_each(|row| builder.take(&row));
        })
        .map_err(|err| err.to_string())?;
        analysed_session::of_outline(path, outline, None)
    } else {
        analysed_session::stream_analysed(path, analysis)
    };
    let passing = passing.map_err(|err| err.to_string())?;
    if !is_as_recorded {
        let take =
            &mut |rows: &[SampleRow]| rows.iter().for_each(|row| builder.borrow_mut().take(row));
        passing.rows(path, take).map_err(|err| err.to_string())?;
    }
    let mut builder = builder.into_inner();
    builder.hand_over();
    if builder.is_received {
        send(ReadUpdate::Whole(Box::new(SessionFacts::of(path, &passing))));
    }
    Ok(())
}

/// Rows on their way into segments.
struct Builder<'a> {
    manifest: &'a Manifest,
    send: &'a dyn Fn(ReadUpdate) -> bool,
    mm_per_pulse: f64,
    first_tick: Option<u64>,
    times: Vec<f64>,
    columns: Vec<Vec<f32>>,
    phases: Vec<TrackStretch<Phase>>,
    cycles: Vec<TrackStretch<u32>>,
    phase: Option<Phase>,
    cycle: Option<u32>,
    samples: usize,
    /// Samples that are handed over together.
    room: usize,
    is_received: bool,
}

impl<'a> Builder<'a> {
    fn new(manifest: &'a Manifest, send: &'a dyn Fn(ReadUpdate) -> bool) -> Self {
        Self {
            manifest,
            send,
            mm_per_pulse: manifest.rig.as_ref().map_or(0.0, |rig| rig.mm_per_pulse),
            first_tick: None,
            times: Vec::new(),
            columns: vec![Vec::new(); Quantity::ALL.len()],
            phases: Vec::new(),
            cycles: Vec::new(),
            phase: None,
            cycle: None,
            samples: 0,
            room: FIRST,
            is_received: true,
        }
    }

    fn take(&mut self, row: &SampleRow) {
        // The receiver is gone; the rest is read and dropped.
        if !self.is_received {
            return;
        }
        let first = *self.first_tick.get_or_insert(row.tick);
        let t = self.manifest.time_of(row.tick.wrapping_sub(first) as i64).0;
        let (number, gap) = (self.samples, f64::NAN);
        if self.phase.replace(row.phase) != Some(row.phase) {
            self.phases.push(TrackStretch { first: number, t, what: row.phase });
        }
        if self.cycle.replace(row.cycle) != Some(row.cycle) {
            self.cycles.push(TrackStretch { first: number, t, what: row.cycle });
        }
        self.samples += 1;
        self.times.push(t);
        let position = row.pulses.map(|pulses| pulses as f64 * self.mm_per_pulse);
        for (column, value) in
            self.columns.iter_mut().zip([row.force, row.depth, row.volts, position])
        {
            column.push(value.unwrap_or(gap) as f32);
        }
        if self.times.len() >= self.room {
            self.hand_over();
            self.room = SEGMENT;
        }
    }

    fn hand_over(&mut self) {
        if self.times.is_empty() {
            return;
        }
        let times = std::mem::take(&mut self.times);
        let segment = Arc::new(TrackSegment::new(times, &self.columns));
        self.columns.iter_mut().for_each(Vec::clear);
        self.is_received = (self.send)(ReadUpdate::Samples {
            segment,
            phases: std::mem::take(&mut self.phases),
            cycles: std::mem::take(&mut self.cycles),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::ReviewRecording;
    use super::*;
    use eframe::egui::Context;
    use palpate_model::signal::track::SignalTrack;
    use std::path::PathBuf;

    fn recorded(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions").join(name)
    }

    #[test]
    fn every_sample_of_a_session_arrives_as_it_was_recorded() {
        let path = recorded("ramp-hold-lab");
        let session = Session::open(&path).unwrap();
        let updates = RefCell::new(Vec::new());
        read(&path, None, &|piece| {
            updates.borrow_mut().push(piece);
            true
        })
        .unwrap();
        let (mut track, mut phases) = (SignalTrack::default(), Vec::new());
        let mut facts = None;
        for piece in updates.into_inner() {
            match piece {
                ReadUpdate::Samples { segment, phases: own, .. } => {
                    track.push(segment);
                    phases.extend(own);
                }
                ReadUpdate::Whole(whole) => facts = Some(whole),
                ReadUpdate::Head(head) => assert_eq!(head.samples, session.rows.len() as u64),
                ReadUpdate::Failed(reason) => panic!("{reason}"),
            }
        }
        assert_eq!(track.len(), session.rows.len());
        let times = track.segments().iter().flat_map(|one| one.times().to_vec());
        let own = |quantity: Quantity| {
            let segments = track.segments().iter();
            let values = segments.flat_map(|one| one.values(quantity as usize).to_vec());
            values.collect::<Vec<f32>>()
        };
        let [force, depth, volts, position] = Quantity::ALL.map(own);
        let rig = session.manifest.rig.as_ref().unwrap();
        let same = |value: f32, row: Option<f64>| match row {
            Some(row) => value == row as f32,
            None => value.is_nan(),
        };
        for (index, (row, t)) in session.rows.iter().zip(times).enumerate() {
            let ticks = (row.tick - session.rows[0].tick) as f64;
            assert!((t - ticks * rig.tick().0).abs() < 1e-9);
            assert!(same(force[index], row.force), "{index}");
            assert!(same(depth[index], row.depth), "{index}");
            assert!(same(volts[index], row.volts), "{index}");
            let mm = row.pulses.map(|pulses| pulses as f64 * rig.mm_per_pulse);
            assert!(same(position[index], mm), "{index}");
            let phase = phases.iter().rev().find(|one| one.first <= index).unwrap();
            assert_eq!(phase.what, row.phase);
        }
        let facts = facts.unwrap();
        assert!(facts.contact.is_some() && facts.events.len() > 3);
        assert!(facts.hashes.iter().any(|one| one.what.ends_with(".mcap")));
    }

    #[test]
    fn an_unreadable_session_has_a_reason_and_a_cancelled_one_ends() {
        let ctx = Context::default();
        let finish = |recording: &mut ReviewRecording| {
            let is_read = || {
                recording.poll();
                (!recording.is_reading()).then_some(())
            };
            palpate_test_support::wait::until(is_read, || "the end of reading".into());
        };
        let mut missing = ReviewRecording::new(Path::new("/nowhere/at-all"), None);
        missing.start(&ctx);
        finish(&mut missing);
        assert!(
            matches!(&missing.stage, super::super::Stage::Failed(reason) if reason.contains("/nowhere/at-all"))
        );
        let mut unknown = ReviewRecording::new(&recorded("ramp-hold-lab"), Some("no such"));
        unknown.start(&ctx);
        finish(&mut unknown);
        assert!(
            matches!(&unknown.stage, super::super::Stage::Failed(reason) if reason.contains("no such"))
        );
        let mut cancelled = ReviewRecording::new(&recorded("ramp-hold-lab"), None);
        cancelled.start(&ctx);
        cancelled.cancel();
        assert!(cancelled.stage == super::super::Stage::Cancelled && cancelled.share() < 1.0);
    }
}
