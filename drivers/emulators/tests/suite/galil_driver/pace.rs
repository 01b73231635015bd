//! How fast and how punctual: over pseudo-terminals, in real time. What is counted is printed; nothing is asserted about
//! speed in the suite, but that every loss is reported.
//!
//! `PALPATE_GALIL_SECONDS` and `PALPATE_STOPS` ask for more than the suite takes, on a computer that has nothing else to
//! do: then what is promised is asserted.
use super::bench::{thesis, to};
use super::wires::{Runner, Served, start};
use palpate_drivers::galil::{GalilSettings, Sampling};
use palpate_drivers::wire::DeviceAddress;
use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_emulators::serve::EmulatorAddress as At;
use palpate_model::Nanos;
use palpate_model::rig::{Fault, Reading, RigCommand};
use palpate_test_support::skip;
use palpate_test_support::wait::in_time;

fn asked(variable: &str, usual: usize) -> usize {
    let given = std::env::var(variable).ok();
    given.and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Whether more is asked for than the suite takes.
fn is_soak(variable: &str) -> bool {
    std::env::var_os(variable).is_some()
}

/// Of the samples that a controller at `TM 1000` takes, polling gets at least this share.
const POLLED_MIN: f64 = 0.9;
/// What a controller at `TM 1000` records stays for three quarters of four seconds, at `TM 500` for half of that.
const KEPT_AT_LEAST: Nanos = Nanos::from_millis(1_000);
/// From a stop to the wire, 999 times of 1000.
const STOP_MAX_MS: f64 = 2.0;

fn on_pty(latency: Nanos, baud: Option<u32>) -> Option<(Served, DeviceAddress)> {
    if skip::lacks_terminals() {
        return None;
    }
    let served = start(At::Pty(None), true, latency, baud);
    let place =
        DeviceAddress::Serial { port: served.address.clone(), baud: 115_200, has_handshake: false };
    Some((served, place))
}

fn on_tcp() -> (Served, DeviceAddress) {
    let at = At::Tcp(([127, 0, 0, 1], 0).into());
    let served = start(at, false, Nanos::ZERO, None);
    let place = DeviceAddress::Tcp(served.address.clone());
    (served, place)
}

fn ms(span: Nanos) -> f64 {
    span.0 as f64 * 1e-6
}

/// Takes samples for so many seconds and tells what came.
fn count(settings: &GalilSettings, line: (Nanos, Option<u32>), what: &str) {
    let counted = in_time(|| count_once(settings, line, what));
    assert!(counted.is_some() || !is_soak("PALPATE_GALIL_SECONDS"), "{what}");
}

/// An error where the link was lost, because the computer has too much else to do.
fn count_once(
    settings: &GalilSettings,
    (latency, baud): (Nanos, Option<u32>),
    what: &str,
) -> Result<(), String> {
    let Some((_served, place)) = on_pty(latency, baud) else {
        return Ok(());
    };
    let seconds = asked("PALPATE_GALIL_SECONDS", 2) as f64;
    let mut runner = Runner::open(&place, settings);
    let description = runner.rig.description().clone();
    runner.until_late("a sample", |runner| runner.newest.is_some())?;
    enable_motor(&mut runner)?;
    runner.pass();
    let first = runner.newest.expect("a sample").tick;
    runner.events.clear();
    let tick = description.tick_nanos as f64 * 1e-9;
    let last = first + (seconds / tick) as u64;
    let (mut samples, mut gaps, mut newest) = (0_u64, 0_u64, first);
    let (mut age_max, mut uncertainty_max) = (Nanos::ZERO, Nanos::ZERO);
    let step =
        if settings.sampling == Sampling::Record { description.ticks_per_sample as u64 } else { 1 };
    // The time base: a straight line through the first and last times at which samples are said to have been taken.
    let mut line: Vec<(u64, Nanos)> = Vec::new();
    while newest < last {
        runner.pass();
        for event in std::mem::take(&mut runner.events) {
            let (tick, age) = match event.body {
                RigEventBody::Reading(Reading { tick, age, .. }) => (tick, age),
                RigEventBody::Fault(Fault::LinkLost { detail }) => return Err(detail),
                RigEventBody::Fault(fault) => panic!("{what}: {fault:?}"),
                _ => continue,
            };
            assert!(tick > newest);
            samples += 1;
            gaps += (tick - newest) / step - 1;
            newest = tick;
            let age = age.expect("its age is known");
            age_max = age_max.max(age.by);
            uncertainty_max = uncertainty_max.max(age.within);
            line.push((tick, Nanos(event.at.0.saturating_sub(age.by.0))));
        }
        // Nobody else takes them, and they are many.
        drop(runner.rig.take_raw());
    }
    let stats = runner.rig.links()[0].1;
    let (begin, end) = (line[0], line[line.len() - 1]);
    let slope = end.1.since(begin.1).0 as f64 / (end.0 - begin.0) as f64;
    println!(
        "{what}: {:.0} samples/s, {gaps} of {} not taken, {} lost; at most {:.1} ms old, +-{:.2} ms; \
         {slope:.1} ns a tick of {}; questions off the clock by {:.2} ms at most, jitter of the link {:.2} ms; \
         round trip {:.2} {:.2} {:.2} ms; {}",
        samples as f64 / ((newest - first) as f64 * tick),
        (newest - first) / step,
        stats.samples_lost,
        ms(age_max),
        ms(uncertainty_max),
        description.tick_nanos,
        ms(stats.deviation_max),
        ms(stats.jitter()),
        ms(stats.round_trip_min),
        ms(stats.round_trip_mean),
        ms(stats.round_trip_max),
        runner.rig.link().unwrap_or(""),
    );
    assert!(runner.faults().is_empty());
    // A question is answered between its beginning and its end.
    assert!(stats.deviation_max.0 <= stats.jitter().0 + stats.round_trip_min.0 + uncertainty_max.0);
    if settings.sampling == Sampling::Record {
        // Every sample comes once, or is counted as lost; and none is lost but by a computer that stood still for longer
        // than the controller keeps samples.
        assert_eq!(gaps, stats.samples_lost, "{what}");
        let is_late = age_max.max(stats.round_trip_max) > KEPT_AT_LEAST;
        assert!(gaps == 0 || is_late, "{what}: {gaps} lost in time");
    }
    if is_soak("PALPATE_GALIL_SECONDS") && (latency, baud) == (Nanos::ZERO, None) {
        match (settings.sampling, settings.sample_us) {
            (Sampling::Record, _) => assert_eq!((gaps, stats.samples_lost), (0, 0), "{what}"),
            (Sampling::Poll, None) => {
                let share = samples as f64 / (newest - first) as f64;
                assert!(share >= POLLED_MIN, "{what}: {share:.3} of all samples");
            }
            _ => {}
        }
    }
    Ok(())
}

fn enable_motor(runner: &mut Runner) -> Result<(), String> {
    runner.rig.send(RigCommand::EnableMotor);
    let is_acknowledged = |event: &RigEvent| matches!(event.body, RigEventBody::Ack(_));
    runner.until_late("enabled", |runner| runner.events.iter().any(is_acknowledged))
}

fn with(sampling: Sampling, sample_us: Option<u16>) -> GalilSettings {
    GalilSettings { sampling, sample_us, ..thesis() }
}

#[test]
fn recording_loses_nothing_over_a_serial_port() {
    let record = |sample_us| with(Sampling::Record, sample_us);
    count(&record(None), (Nanos::ZERO, None), "recorded, TM 1000");
    count(&record(Some(500)), (Nanos::ZERO, None), "recorded, TM 500");
}

#[test]
fn polling_over_a_serial_port() {
    count(&with(Sampling::Poll, None), (Nanos::ZERO, None), "polled, TM 1000");
    count(&with(Sampling::Poll, Some(500)), (Nanos::ZERO, None), "polled, TM 500");
}

#[test]
fn a_converter_with_a_latency_of_16_ms() {
    let late = (Nanos::from_millis(16), None);
    count(&with(Sampling::Auto, None), late, "auto, 16 ms latency");
    count(&with(Sampling::Record, None), late, "recorded, 16 ms latency");
}

#[test]
fn a_line_of_115200_baud() {
    let slow = (Nanos::ZERO, Some(115_200));
    count(&with(Sampling::Auto, None), slow, "auto, 115200 baud");
    count(&with(Sampling::Record, None), slow, "recorded, 115200 baud");
}

/// From the command entering the rig to its bytes being written, while samples come as fast as they can.
#[test]
fn stops_under_full_acquisition() {
    let stops = asked("PALPATE_STOPS", 100);
    let ways = [
        (Sampling::Record, false),
        (Sampling::Poll, false),
        (Sampling::Record, true),
        (Sampling::Poll, true),
    ];
    for (sampling, is_tcp) in ways {
        let stopped = in_time(|| stops_once(sampling, is_tcp, stops));
        assert!(stopped.is_some() || !is_soak("PALPATE_STOPS"), "{sampling:?}");
    }
}

fn stops_once(sampling: Sampling, is_tcp: bool, stops: usize) -> Result<(), String> {
    let opened = if is_tcp { Some(on_tcp()) } else { on_pty(Nanos::ZERO, None) };
    let Some((_served, place)) = opened else {
        return Ok(());
    };
    let over = if is_tcp { "TCP" } else { "a serial port" };
    let mut runner = Runner::open(&place, &with(sampling, None));
    runner.until_late("a sample", |runner| runner.newest.is_some())?;
    enable_motor(&mut runner)?;
    runner.events.clear();
    runner.rig.send(to(9000, 0.75));
    let has_begun = |event: &RigEvent| matches!(event.body, RigEventBody::Ack(_));
    runner.until_late("begun", |runner| runner.events.iter().any(has_begun))?;
    let mut late: Vec<u64> = Vec::with_capacity(stops);
    for at in 0..stops {
        // At any time of the acquisition's turn.
        std::thread::sleep(std::time::Duration::from_micros(300 + (at as u64 * 7919) % 3000));
        runner.events.clear();
        drop(runner.rig.take_raw());
        let before = runner.rig.now();
        runner.rig.send(RigCommand::Stop);
        runner.until_late("acknowledged", |runner| {
            runner.events.iter().any(|event| matches!(event.body, RigEventBody::Ack(_)))
        })?;
        let written = runner
            .rig
            .take_raw()
            .into_iter()
            .find(|piece| piece.is_sent && piece.bytes.starts_with(b"STA;"))
            .expect("the stop was written");
        late.push(written.at.since(before).0);
    }
    late.sort_unstable();
    let at = |share: f64| ms(Nanos(late[((late.len() - 1) as f64 * share) as usize]));
    println!(
        "{sampling:?} over {over}: {stops} stops, from the command to the wire {:.3} ms p50, {:.3} p99, {:.3} p99.9, {:.3} max",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
    if is_soak("PALPATE_STOPS") {
        assert!(at(0.999) <= STOP_MAX_MS, "{sampling:?} over {over}: {:.3} ms", at(0.999));
    }
    Ok(())
}
