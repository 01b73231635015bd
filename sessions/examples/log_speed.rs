//! Speed of writing and reading a session log, and its size.
//!
//! `cargo run --release -p palpate-sessions --example log_speed -- [SAMPLES] [FOLDER]`
#![expect(clippy::print_stdout, reason = "a program that prints")]

use chrono::{TimeZone, Utc};
use palpate_model::rig::{Limits, Phase, RigDescription};
use palpate_model::{MmPerS, MmPerS2, Nanos, Position, Volts};
use palpate_sessions::{
    EndRecord, Manifest, RECORD_VERSION, RecordingPace, SampleRow, Session, SessionFolder,
    SessionSummary, SessionWriter, new_session_id,
};
use std::time::Instant;

/// A sample as of the simulated rig at 20 kHz, with noise in every digit of the signal.
fn row(index: u64, random: &mut u64) -> SampleRow {
    *random =
        random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    let noise = (*random >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    let depth = 0.015 * (index / 500 % 500) as f64;
    let volts = 0.5 + 0.1 * depth + 1e-3 * noise;
    SampleRow {
        tick: index,
        host: Nanos(index * 50_000),
        volts: Some(volts),
        pulses: Some((index / 500 % 500) as i64),
        force: Some(volts * 3.7 - 1.85),
        depth: Some(depth),
        phase: Phase::Hold,
        cycle: 1,
        ..SampleRow::default()
    }
}

#[expect(clippy::disallowed_methods, reason = "this program measures time")]
fn timed<T>(what: &str, samples: u64, body: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = body();
    let seconds = start.elapsed().as_secs_f64();
    println!("{what}: {seconds:.3} s, {:.2} million samples/s", samples as f64 / seconds / 1e6);
    result
}

fn manifest() -> Manifest {
    let started_at = Utc.timestamp_nanos(1_772_720_107_000_000_000);
    let travel = Position(150.0);
    Manifest {
        record_version: RECORD_VERSION,
        session_id: new_session_id(started_at),
        software_version: env!("CARGO_PKG_VERSION").into(),
        engine_version: 1,
        started_at,
        operator: "none".into(),
        specimen: "none".into(),
        indenter: "none".into(),
        rig: Some(RigDescription {
            name: "speed".into(),
            identity: "no rig".into(),
            settings: [].into(),
            mm_per_pulse: 0.015,
            travel,
            tick_nanos: 50_000,
            speed_quantum: MmPerS(0.03),
            speed_max: MmPerS(5.0),
            acceleration: MmPerS2(15.36),
            adc: None,
            noise_expected: Volts(1e-3),
            pulse_lag: palpate_model::units::Seconds(0.0),
            cell_delay: palpate_model::units::Seconds(0.0),
            ticks_per_sample: 1.0,
            unseen_max: RigDescription::UNSEEN_USUAL,
            takes_targets: false,
            sensors: Default::default(),
        }),
        limits: Some(Limits::for_travel(travel)),
        ..Manifest::default()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let samples: u64 = words.next().map_or(Ok(10_000_000), |word| word.parse())?;
    let folder = words.next().unwrap_or_else(|| "target/log_speed".into());
    let manifest = manifest();
    let path = std::path::Path::new(&folder).join(&manifest.session_id);
    let mut random = 1;
    timed("write", samples, || -> Result<(), Box<dyn std::error::Error>> {
        let mut writer = SessionWriter::start(
            SessionFolder::create(&path)?,
            None,
            &manifest,
            RecordingPace::Virtual,
        )?;
        for index in 0..samples {
            writer.push_row(row(index, &mut random))?;
        }
        let end = EndRecord {
            outcome: "finished".into(),
            reason: "done".into(),
            ended_at: Nanos(samples * 50_000),
            ..EndRecord::default()
        };
        Ok(writer.close(end)?)
    })?;
    let mut bytes = 0;
    for item in std::fs::read_dir(&path)? {
        bytes += item?.metadata()?.len();
    }
    println!("{:.2} bytes a sample", bytes as f64 / samples as f64);
    for _ in 0..3 {
        let summary = timed("summary", samples, || SessionSummary::read(&path))?;
        assert_eq!(summary.samples, samples);
        let mut sum = 0.0;
        let outline = timed("scan of all channels", samples, || {
            Session::scan(&path, &mut |block| {
                sum += block.force().iter().sum::<f64>();
            })
        })?;
        assert_eq!(outline.samples, samples);
        std::hint::black_box(sum);

        if std::env::var_os("PALPATE_SCAN_ONLY").is_some() {
            continue;
        }
        let session = timed("read", samples, || Session::open(&path))?;
        assert_eq!(session.rows.len() as u64, samples);
    }
    std::fs::remove_dir_all(&path)?;
    Ok(())
}
