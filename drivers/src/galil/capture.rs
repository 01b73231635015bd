//! How samples are taken: the link is measured, and record arrays are set up if that gives fresher samples.

use super::console::{ANSWER_MAX, GalilConsole};
use super::model::GalilOpenError;
use super::recording::{self, ARRAYS, RecordingPlan, RecordingStatus};
use super::sampling::Sampler;
use super::session::PollPace;
use super::settings::{GalilSettings, Sampling};
use crate::wire::LinkStats;
use palpate_model::Nanos;

/// Single questions by which the link is measured, and questions in a row that show what it carries.
const SINGLE: usize = 11;
const ROW: usize = 12;
/// Rows, of which the fastest counts: a computer with much else to do is no slow link.
const ROWS: usize = 3;
/// More questions would only wait in the controller's input buffer, before a stop.
const IN_FLIGHT_MAX: usize = 8;
/// Elements of each array, tried in turn: at 512 a second two thousand hold four seconds.
const RINGS: [i64; 4] = [2000, 1000, 500, 250];
/// Share of the elements that are free which arrays may take; the rest is for others.
const ROOM_MAX: f64 = 0.5;
/// Questions by which the sample of element 0 is found, at least and at most.
const ANCHORS: std::ops::Range<usize> = 16..400;
/// `RC n` tried in turn: every second sample, every fourth, every eighth.
const INTERVALS: std::ops::RangeInclusive<u32> = 1..=3;
/// Bytes of an element in all four arrays, such as ` 4095, 2000, 15, 0` with its commas.
const ELEMENT_BYTES: f64 = 20.0;
/// Bytes of the answers that come with a fetch: a question's and four line ends.
const FETCH_BYTES: f64 = 60.0;
/// Share of what the link carries that fetching may take; the rest is for stops, the watchdog and jitter.
const LOAD_MAX: f64 = 0.7;
/// Between two fetches at least: two samples of 512 a second; younger ones are of no use.
const FETCH_EVERY: Nanos = Nanos::from_millis(4);
/// Largest age of samples when they arrive: the shortest silence that stops a run (20 ms at speed), less what a
/// computer with much else to do takes.
const AGE_MAX: Nanos = Nanos::from_millis(15);

#[derive(Clone, Copy, Debug)]
pub struct LinkMeasurement {
    pub stats: LinkStats,
    /// The usual one, of which as many are longer as shorter.
    trip: Nanos,
    /// From one answer to the next when many are asked in a row.
    apart: Nanos,
    /// Bytes that went one way in this time, at least.
    bytes: f64,
}

/// Measures the duration of a single answer and the rate of answers to questions in a row.
pub fn measure(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
) -> Result<LinkMeasurement, GalilOpenError> {
    let question = Sampler::question(settings);
    let mut stats = LinkStats::default();
    let mut trips = Vec::with_capacity(SINGLE);
    for _ in 0..SINGLE {
        let start = console.now();
        console.ask(&question)?;
        let trip = console.now().since(start);
        stats.push(trip);
        trips.push(trip);
    }
    trips.sort_unstable();
    let trip = trips[SINGLE / 2];
    let (mut apart, mut bytes) = (Nanos(u64::MAX), 0);
    for _ in 0..ROWS {
        let start = console.now();
        console.write(format!("{question}\r").repeat(ROW))?;
        let replies = console.replies(ROW, Nanos(ROW as u64 * ANSWER_MAX.0))?;
        if replies.len() < ROW {
            return Err(GalilOpenError::Silent);
        }
        let row = console.now().since(start);
        apart = apart.min(Nanos((row.since(trip).0 / (ROW as u64 - 1)).max(1)));
        bytes = replies.iter().map(|reply| reply.bytes.len() + 3).sum();
    }
    Ok(LinkMeasurement {
        stats,
        trip,
        apart,
        // Both ways are equally fast, and the longer one is what takes the time.
        bytes: (bytes as f64 / ROW as f64).max(question.len() as f64 + 1.0),
    })
}

impl LinkMeasurement {
    pub fn polling(&self, tick: Nanos) -> PollPace {
        // Sooner than a sample lasts, so that none is missed for jitter; repeated samples are dropped.
        let every = self.apart.max(Nanos(tick.0 * 6 / 10));
        let in_flight = (self.trip.0.div_ceil(every.0.max(1)) as usize + 1).clamp(2, IN_FLIGHT_MAX);
        PollPace { every, in_flight, tick }
    }

    /// The pace for fetching elements of 2^n samples, and their age when they arrive; `None` when the link carries
    /// less.
    fn fetching(&self, tick: Nanos, n: u32) -> Option<(PollPace, Nanos)> {
        let bytes_per_ns = self.bytes / self.apart.0 as f64;
        let interval = (tick.0 << n) as f64;
        let left = LOAD_MAX * bytes_per_ns - ELEMENT_BYTES / interval;
        if left <= 0.0 {
            return None;
        }
        let every =
            Nanos((FETCH_BYTES / left) as u64).max(FETCH_EVERY).max(Nanos(self.trip.0 * 5 / 4));
        let transfer = (every.0 as f64 / interval * ELEMENT_BYTES + FETCH_BYTES) / bytes_per_ns;
        let age = Nanos(every.0 + 2 * self.trip.0 + transfer as u64);
        let pace = PollPace { every, in_flight: 1, tick };
        Some((pace, age))
    }
}

/// The sampling that was set up.
pub struct SamplingSetup {
    pub pace: PollPace,
    pub plan: Option<RecordingPlan>,
    /// The part that stays the same from one opening to the next, for the rig's identity.
    pub words: String,
    pub measured: String,
}

pub fn set_up(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
    measured: &LinkMeasurement,
    tick: Nanos,
) -> Result<SamplingSetup, GalilOpenError> {
    let ms = |span: Nanos| span.0 as f64 * 1e-6;
    let polled = |why: &str| {
        let pace = measured.polling(tick);
        let rate = 1e9 / pace.every.max(tick).0 as f64;
        SamplingSetup {
            pace,
            plan: None,
            words: "samples polled".to_owned(),
            measured: format!("samples are polled at up to {rate:.0} a second{why}"),
        }
    };
    // A recording that an earlier program has left running takes the controller's time.
    console.try_ask("RC 0")?;
    if settings.sampling == Sampling::Poll {
        return Ok(polled(""));
    }
    let fits = INTERVALS.filter_map(|n| Some((n, measured.fetching(tick, n)?)));
    let chosen = fits.clone().find(|(_, (_, age))| *age <= AGE_MAX).or_else(|| {
        let is_forced = settings.sampling == Sampling::Record;
        fits.clone().next().filter(|_| is_forced)
    });
    let Some((n, (pace, age))) = chosen else {
        if settings.sampling == Sampling::Record {
            return Err(no_recording("the link is too slow"));
        }
        return Ok(polled(", because the link is too slow for recorded samples"));
    };
    match start_recording(console, settings, n, tick) {
        Ok(plan) => Ok(SamplingSetup {
            pace,
            plan: Some(plan),
            words: format!("{:.0} samples/s recorded", 1e9 / (tick.0 << n) as f64),
            measured: format!(
                "recorded samples are up to {:.0} ms old when they arrive",
                ms(age).ceil()
            ),
        }),
        Err(GalilOpenError::NoRecording(why)) if settings.sampling != Sampling::Record => {
            Ok(polled(&format!(", because the controller does not record ({why})")))
        }
        Err(err) => Err(err),
    }
}

fn no_recording(why: &str) -> GalilOpenError {
    GalilOpenError::NoRecording(why.into())
}

/// The letters of analog inputs 1 to 8 in `_AF` (DMC-1700/1800 user manual, page 159).
const INPUTS: [char; 8] = ['X', 'Y', 'Z', 'W', 'E', 'F', 'G', 'H'];

/// Starts a recording every 2^n samples.
fn start_recording(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
    n: u32,
    tick: Nanos,
) -> Result<RecordingPlan, GalilOpenError> {
    for name in ARRAYS {
        // Arrays of an earlier session may have another length.
        console.try_ask(&format!("DA {name}[]"))?;
    }
    // Elements that are free (DMC-40x0 command reference, `DM`); firmware that does not report it refuses what is too
    // much.
    let free = console.try_ask("DM ?")?;
    let free = free.numbers().filter(|_| free.is_accepted);
    let room = free.map_or(f64::INFINITY, |numbers| ROOM_MAX * numbers[0]);
    let mut ring = None;
    let fits = |length: &i64| (ARRAYS.len() as i64 * length) as f64 <= room;
    for length in RINGS.into_iter().filter(fits) {
        let arrays = ARRAYS.map(|name| format!("{name}[{length}]")).join(",");
        if console.try_ask(&format!("DM {arrays}"))?.is_accepted {
            ring = Some(length);
            break;
        }
        for name in ARRAYS {
            console.try_ask(&format!("DA {name}[]"))?;
        }
    }
    let Some(ring) = ring else {
        return Err(no_recording("it has no memory left for the arrays of samples"));
    };
    let (a, input) = (settings.axis, INPUTS[usize::from(settings.input - 1) % 8]);
    let arrays = ARRAYS.map(|name| format!("{name}[]")).join(",");
    for command in [
        format!("RA {arrays}"),
        format!("RD _AF{input},_DE{a},_TS{a},_SC{a}"),
        format!("RC {n},-{ring}"),
    ] {
        if !console.try_ask(&command)?.is_accepted {
            let why = console.try_ask("TC1")?.text();
            return Err(GalilOpenError::NoRecording(format!("it refuses {command}: {why}")));
        }
    }
    anchor(console, settings, (1 << n, tick), ring)
}

/// Which sample each element is of: the earliest `TIME` at which an element is the newest is that at which it was
/// written.
fn anchor(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
    (interval, tick): (i64, Nanos),
    ring: i64,
) -> Result<RecordingPlan, GalilOpenError> {
    let question = recording::question(settings);
    let mut rough: Option<i64> = None;
    let (mut least, mut most, mut count) = (i64::MAX, i64::MIN, 0);
    while count < ANCHORS.end {
        // Questions at one pace with the samples would always meet the same one.
        for _ in 0..count % 4 {
            console.number("TIME")?;
        }
        let reply = console.ask(&question)?;
        let Some(status) = reply.numbers().as_deref().and_then(RecordingStatus::read) else {
            return Err(no_recording("its answers do not contain the expected numbers"));
        };
        count += 1;
        if rough.is_none() && status.next == 0 {
            continue;
        }
        let rough = *rough.get_or_insert(status.time - (status.next - 1) * interval);
        let linear = (status.time - rough).div_euclid(interval);
        let half = ring / 2;
        let off = (status.next - 1 - linear + half).rem_euclid(ring) - half;
        if off.abs() > 2 {
            return Err(no_recording("it does not record at the set interval"));
        }
        let newest = linear + off;
        let base = status.time - newest * interval;
        (least, most) = (least.min(base), most.max(base));
        if count >= ANCHORS.start && most - least >= interval - 1 {
            return Ok(RecordingPlan { interval, ring, base: least, first: newest + 1, tick });
        }
    }
    Err(no_recording("its clock does not agree with the times of its samples"))
}
