//! Checks at rest: answers, samples, clock, nonsense.

use super::talk::{Talk, TimedSample};
use super::{Check, ConformError, Measured};
use crate::sidecar::description::SidecarDescription;
use crate::sidecar::protocol::HostMessage;
use palpate_model::Nanos;

const BEATS: usize = 200;
const BEAT_APART: Nanos = Nanos::from_millis(5);
/// Longest answer and longest delay of a sample that the protocol allows.
pub(super) const ANSWER_LIMIT_MS: f64 = 100.0;
/// The interlock of age allows a sample so much beyond the time between two (`Limits::sample_age_max`).
const GAP_MORE_MS: f64 = 20.0;
/// Share of the promised samples that may be missing or too many, in percent: a resonator is right to half a percent.
const RATE_LIMIT: f64 = 2.0;
/// A clock that is off by more is not followed (`CellClock`).
const DRIFT_LIMIT_PPM: f64 = 10_000.0;
/// Fewer samples say nothing of a clock.
const SAMPLES_MIN: usize = 10;
const PAUSE: Nanos = Nanos::from_millis(20);

fn ms(time: Nanos) -> f64 {
    time.0 as f64 * 1e-6
}

/// Before it is introduced a sidecar does nothing.
pub(super) fn hello_first(talk: &mut Talk) -> Result<Check, ConformError> {
    let name = "hello-first";
    let answer = talk.ask(HostMessage::Beat)?;
    Ok(match answer {
        Some(answer) if answer.is_ok => {
            // A board that was open before has been introduced, and its port did not restart it.
            Check::skipped(name, "it was introduced by another program before")
        }
        Some(_) => Check::of(name, "it refuses a line before hello", true),
        None => Check::skipped(name, "it did not answer yet, as a device that starts"),
    })
}

/// The distribution of the time from a line to its answer, while samples come.
pub(super) fn answers(
    talk: &mut Talk,
    measured: &mut Measured,
) -> Result<Vec<Check>, ConformError> {
    talk.check = "answers";
    let started = talk.start_samples()?;
    let mut latencies = Vec::new();
    for _ in 0..BEATS {
        if let Some(answer) = talk.ask(HostMessage::Beat)?.filter(|answer| answer.is_ok) {
            latencies.push(answer.latency);
        }
        talk.pass(BEAT_APART)?;
    }
    latencies.sort_unstable();
    let at = |share: f64| {
        let last = latencies.len().saturating_sub(1);
        latencies.get((last as f64 * share).round() as usize).map_or(f64::NAN, |l| ms(*l))
    };
    let worst = at(1.0);
    measured.answer_max = measured.answer_max.max(latencies.last().copied().unwrap_or_default());
    measured.way_min = Nanos(latencies.first().map_or(0, |least| least.0 / 2));
    let lost = BEATS - latencies.len();
    let what = format!(
        "time from a line to its answer: median {:.2} ms, 99 % within {:.2} ms",
        at(0.5),
        at(0.99)
    );
    Ok(vec![
        Check::of("start", "it sends samples after start", started),
        Check::at_most("answer", what, worst, ANSWER_LIMIT_MS, "ms").safety(),
        Check::at_most("answers-lost", format!("of {BEATS} lines"), lost as f64, 0.0, "answers")
            .safety(),
    ])
}

/// Rate, regularity, delay, and the clock that stamps them.
pub(super) fn samples(
    talk: &mut Talk,
    about: &SidecarDescription,
    watch: Nanos,
    measured: &mut Measured,
) -> Result<Vec<Check>, ConformError> {
    talk.check = "samples and clock";
    talk.samples.clear();
    let (garbled, backward) = (talk.garbled, talk.backward);
    // A slow device needs longer for as many samples.
    talk.pass(watch.max(Nanos(2 * SAMPLES_MIN as u64 * about.period().0)))?;
    let samples = talk.samples.clone();
    let bad = (talk.garbled - garbled) + (talk.backward - backward);
    let mut checks = vec![Check::at_most(
        "lines-garbled",
        "lines that mean nothing, and samples whose clock does not go forward",
        bad as f64,
        0.0,
        "lines",
    )];
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        checks.push(Check::of("rate", "it sends no samples", false).safety());
        return Ok(checks);
    };
    if samples.len() < SAMPLES_MIN {
        checks.push(Check::of("rate", "it sends too few samples", false).safety());
        return Ok(checks);
    }
    let seconds = last.at.since(first.at).seconds().0;
    let rate = (samples.len() - 1) as f64 / seconds;
    let off = 100.0 * (rate / about.rate - 1.0).abs();
    let what = format!("{rate:.1} samples a second instead of {}", about.rate);
    checks.push(Check::at_most("rate", what, off, RATE_LIMIT, "%"));
    checks.extend(intervals(&samples, about));
    let (drift, late) = clock(&samples);
    measured.late_max = late;
    let what = "longest delay of a sample beyond the shortest";
    checks.push(Check::at_most("sample-delay", what, ms(late), ANSWER_LIMIT_MS, "ms").safety());
    let what = format!("error of its clock over {seconds:.0} s: {drift:+.0} ppm");
    checks.push(Check::at_most("clock-drift", what, drift.abs(), DRIFT_LIMIT_PPM, "ppm"));
    Ok(checks)
}

/// Time between samples, by the device's clock.
fn intervals(samples: &[TimedSample], about: &SidecarDescription) -> Vec<Check> {
    let steps: Vec<f64> =
        samples.windows(2).map(|pair| ms(pair[1].time.since(pair[0].time))).collect();
    let mean = steps.iter().sum::<f64>() / steps.len() as f64;
    let variance = steps.iter().map(|step| (step - mean).powi(2)).sum::<f64>() / steps.len() as f64;
    let longest = steps.iter().fold(0.0, |most: f64, step| most.max(*step));
    let period = ms(about.period());
    vec![
        Check::at_most(
            "jitter",
            "standard deviation of the time between samples",
            variance.sqrt(),
            period,
            "ms",
        ),
        Check::at_most("gap", "longest time between samples", longest, period + GAP_MORE_MS, "ms")
            .safety(),
    ]
}

/// Error of the device's clock in ppm, positive where it is fast, and the longest delay beyond the line under all
/// arrivals. The line goes through the promptest samples of the first and the last third (see `CellClock`).
fn clock(samples: &[TimedSample]) -> (f64, Nanos) {
    let origin = (samples[0].time, samples[0].at);
    let points: Vec<(f64, f64)> = samples
        .iter()
        .map(|one| {
            let device = one.time.since(origin.0).0 as f64;
            (device, one.at.since(origin.1).0 as f64 - device)
        })
        .collect();
    let third = points.len() / 3;
    let promptest = |of: &[(f64, f64)]| {
        of.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
    };
    let (early, late) =
        (promptest(&points[..third.max(1)]), promptest(&points[points.len() - third.max(1)..]));
    let slope = if late.0 > early.0 { (late.1 - early.1) / (late.0 - early.0) } else { 0.0 };
    let beyond = |(device, delay): &(f64, f64)| delay - early.1 - slope * (device - early.0);
    let most = points.iter().map(beyond).fold(0.0, f64::max);
    // Delays grow where the device's clock is slow.
    (-slope * 1e6, Nanos(most as u64))
}

/// Lines that mean nothing, and that would move nothing if they were understood.
pub(super) fn garbage(has_checksum: bool) -> Vec<Vec<u8>> {
    let mut lines: Vec<Vec<u8>> = [
        "what",
        "{",
        "{}",
        "[]",
        "17",
        "null",
        r#"{"n":"one","do":"beat"}"#,
        r#"{"n":-1,"do":"beat"}"#,
        r#"{"n":NaN,"do":"beat"}"#,
        r#"{"do":"beat"}"#,
        r#"{"n":7}"#,
        r#"{"n":7,"do":5}"#,
        r#"{"n":7,"do":"be"#,
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec();
    if has_checksum {
        lines.push(br#"{"n":7,"do":"beat"}"#.to_vec());
        lines.push(br#"{"n":7,"do":"beat"}*0000"#.to_vec());
    }
    lines.push((1..=255).filter(|byte| !b"\r\n".contains(byte)).collect());
    lines.push(vec![b'x'; 5_000]);
    lines.push([vec![b'['; 600], vec![b']'; 600]].concat());
    for line in &mut lines {
        line.push(b'\n');
    }
    lines
}

/// Nonsense is refused or ignored, and does not disturb.
pub(super) fn nonsense(
    talk: &mut Talk,
    about: &SidecarDescription,
) -> Result<Vec<Check>, ConformError> {
    talk.check = "nonsense";
    let (faults, count) = (talk.faults.len(), talk.refused_lines);
    let position = talk.samples.last().and_then(|one| one.sample.pulses);
    let lines = garbage(about.crc);
    for line in &lines {
        talk.write_raw(line)?;
        talk.pass(PAUSE)?;
    }
    let unknown = talk.ask_raw(r#""dance""#)?;
    let is_refused = unknown.is_some_and(|answer| !answer.is_ok);
    talk.samples.clear();
    talk.pass(PAUSE.max(Nanos(3 * about.period().0)))?;
    let alive = talk.ask(HostMessage::Beat)?.is_some_and(|answer| answer.is_ok);
    let newest = talk.samples.last();
    let rests = position.is_none()
        || newest.is_some_and(|one| one.sample.pulses == position && !one.is_moving());
    let what = format!(
        "{} of {} lines that mean nothing were refused",
        talk.refused_lines - count,
        lines.len()
    );
    let is_quiet = talk.faults.len() == faults;
    Ok(vec![
        Check::of("nonsense", what, alive && rests && is_quiet).safety(),
        Check::of(
            "unknown-word",
            "a word that it does not know is refused by its number",
            is_refused,
        ),
    ])
}
