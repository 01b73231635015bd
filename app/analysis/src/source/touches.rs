//! The touches that found a contact position, as they were recorded.

use palpate_model::rig::Phase;
use palpate_model::signal::ContactSearchPoint;
use palpate_model::units::{Newtons, Position, Seconds};
use palpate_sessions::Session;
use std::ops::Range;

/// Time in s averaged into one point, as the search itself does.
const POINT_SECS: f64 = 0.02;
/// Time in s that is looked at before the first touch has half its force: its beginning, and enough before it to tell
/// offset and drift.
const LEAD_SECS: f64 = 10.0;
/// The probe has turned once it is so far from where it has been, in mm: more than the step of a slider, and a small part of
/// a press.
const TURN_MM: f64 = 0.02;

/// One averaged sample of a search as it was fitted, and its force even where that does not count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchPoint {
    pub fitted: ContactSearchPoint,
    pub force: Newtons,
}

/// Points of the search in these rows of a session: the first touch, the way back from it, whose forces do not count, and
/// the second touch. Empty where the probe did not touch twice.
pub(super) fn of_search(session: &Session, rows: Range<usize>) -> Vec<TouchPoint> {
    let Some(mm_per_pulse) = session.manifest.rig.as_ref().map(|rig| rig.mm_per_pulse) else {
        return Vec::new();
    };
    let tick = session.manifest.tick().0;
    let searched = session.rows[rows].iter().filter(|row| row.phase == Phase::Contact);
    let samples = searched.filter_map(|row| {
        let position = row.pulses? as f64 * mm_per_pulse;
        Some(SearchSample { t: row.tick as f64 * tick, position, force: row.force? })
    });
    let samples: Vec<SearchSample> = samples.collect();
    touches(&samples, mm_per_pulse).unwrap_or_default()
}

#[derive(Clone, Copy, Debug)]
struct SearchSample {
    t: f64,
    position: f64,
    force: f64,
}

fn touches(samples: &[SearchSample], mm_per_pulse: f64) -> Option<Vec<TouchPoint>> {
    let first_end = turn(samples, 1.0)?;
    let back = first_end + turn(&samples[first_end..], -1.0)?;
    let end = back + turn(&samples[back..], 1.0)?;
    let hardest = samples[..first_end].iter().map(|one| one.force).fold(0.0, f64::max);
    let begun = samples.iter().find(|one| one.force > 0.5 * hardest)?.t - LEAD_SECS;
    // The way back ends where the probe rests, at the beginning of that rest.
    let nearest = samples[back].position;
    let rest = samples[first_end..back].iter().position(|one| one.position <= nearest);
    let rest = first_end + rest.unwrap_or(back - first_end);
    let mut points = Vec::new();
    let mut start = samples.iter().position(|one| one.t >= begun)?;
    while start <= end {
        let from = samples[start].t;
        let block = samples[start..=end].iter().take_while(|one| one.t < from + POINT_SECS);
        let (count, sum) = block.fold((0, [0.0; 3]), |(count, [t, position, force]), one| {
            (count + 1, [t + one.t, position + one.position, force + one.force])
        });
        let [t, position, force] = sum.map(|sum| sum / count as f64);
        // A counter counts whole pulses: a probe on its way is half a pulse further on average.
        let way = samples[start + count - 1].position - samples[start].position;
        let moving = if way == 0.0 { 0.0 } else { 0.5 * mm_per_pulse * way.signum() };
        let is_back = start + count > first_end && start < rest;
        let force = Newtons(force);
        let fitted = ContactSearchPoint {
            t: Seconds(t),
            position: Position(position + moving),
            force: (!is_back).then_some(force),
        };
        points.push(TouchPoint { fitted, force });
        start += count;
    }
    Some(points)
}

/// The last sample before the probe turns back from a way deeper (1) or towards home (-1); `None` if it does not.
fn turn(samples: &[SearchSample], way: f64) -> Option<usize> {
    let (mut furthest, mut at) = (f64::NEG_INFINITY, 0);
    for (index, one) in samples.iter().enumerate() {
        let position = way * one.position;
        if position >= furthest {
            (furthest, at) = (position, index);
        } else if position < furthest - TURN_MM {
            return Some(at);
        }
    }
    None
}
