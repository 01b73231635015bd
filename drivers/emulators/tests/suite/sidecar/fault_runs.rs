//! Random moves while a random sidecar is killed, stalls, or lies, in simulated time: every run ends safe.
//!
//! `PALPATE_SIDECAR_FAULTS` asks for more runs than the suite takes, `PALPATE_SIDECAR_SEED` for another first one;
//! `PALPATE_SIDECAR_SECONDS` for longer recordings at 1 kHz.

use super::bench::{Host, Shared, to};
use palpate_emulators::sidecar::{EmulatedSidecarSettings as Emulated, SidecarLie};
use palpate_emulators::{DeviceFault, EmulatedDevice};
use palpate_model::Nanos;
use palpate_model::random::SplitMix;
use palpate_model::rig::{Fault, RigCommand};
use palpate_model::units::{MmPerS, MmPerS2};

/// Longest time until a fault is noticed: a second of a flood of samples.
const NOTICED: f64 = 1.05;
/// What is noticed at the next sample, or by silence.
const AT_ONCE: f64 = 0.06;

fn number(variable: &str, usual: u64) -> u64 {
    let given = std::env::var(variable).ok();
    given.and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[derive(Clone, Copy, Debug)]
enum Trouble {
    Lie(SidecarLie),
    Kill,
    Cut,
    Deaf,
    /// The host's program hangs: no one takes samples, and no one writes.
    HostHangs,
    /// The host's thread runs, its owner does not.
    OwnerHangs,
    Noise,
}

impl Trouble {
    fn pick(random: &mut SplitMix) -> Self {
        match random.below(16) {
            0 => Self::Lie(SidecarLie::Mute),
            1 => Self::Lie(SidecarLie::Jump(50 + random.below(4_000) as i64)),
            2 => Self::Lie(SidecarLie::Jump(-50 - random.below(4_000) as i64)),
            3 => Self::Lie(SidecarLie::ClockBack(1_000 + random.below(3_000_000) as u32)),
            4 => Self::Lie(SidecarLie::ClockStuck),
            5 => Self::Lie(SidecarLie::Lazy),
            6 => Self::Lie(SidecarLie::DeafToStops),
            7 => Self::Lie(SidecarLie::WrongUnits(if random.below(2) == 0 { 25 } else { -1 })),
            8 => Self::Lie(SidecarLie::NotANumber),
            9 => Self::Lie(SidecarLie::Flood(3 + random.below(20) as u32)),
            10 => Self::Lie(SidecarLie::BeyondConverter),
            11 => Self::Kill,
            12 => Self::Cut,
            13 => Self::Deaf,
            14 => Self::HostHangs,
            _ if random.below(2) == 0 => Self::OwnerHangs,
            _ => Self::Noise,
        }
    }

    fn begin(self, host: &mut Host, seed: u64) {
        let now = host.now();
        let mut wire = host.wire.lock();
        match self {
            Self::Lie(lie) => wire.emulator.set_lie(Some(lie)),
            Self::Kill => wire.emulator.apply_fault(now, DeviceFault::Reset, true),
            Self::Cut => wire.is_cut = true,
            Self::Deaf => wire.is_deaf = true,
            Self::Noise => {
                let mut random = SplitMix::seeded(seed);
                wire.spoil = Box::new(move |byte| {
                    let is_changed = random.below(8) == 0;
                    vec![if is_changed { random.below(256) as u8 } else { byte }]
                });
            }
            Self::HostHangs => {}
            Self::OwnerHangs => {
                drop(wire);
                host.is_attended = false;
            }
        }
    }

    /// Seconds from its beginning to the moment at which the axis must begin to brake at the latest.
    fn noticed_within(self, silence: f64) -> f64 {
        match self {
            // What has no samples is noticed after 250 ms, or the silence of the host stops it.
            Self::Lie(SidecarLie::Mute | SidecarLie::Flood(_)) | Self::Noise => NOTICED,
            // The link is given up after a second, and silence stops the axis.
            Self::Lie(SidecarLie::DeafToStops) => 1.0 + silence + AT_ONCE,
            Self::OwnerHangs => 0.5 + AT_ONCE,
            Self::Cut | Self::Deaf | Self::HostHangs => silence + AT_ONCE,
            _ => 0.31,
        }
    }
}

/// One run: its seed decides everything. Gives what went wrong.
fn run(seed: u64) -> Result<(), String> {
    let mut random = SplitMix::seeded(seed);
    let settings = Emulated {
        has_checksum: random.below(2) == 0,
        has_frames: random.below(2) == 0,
        silence: Nanos::from_millis(100 + random.below(300) as u64),
        reaction: Nanos(random.below(5_000_000) as u64),
        rate: [100.0, 500.0, 1_000.0][random.below(3)],
        clock_ppm: random.below(400) as f64 - 200.0,
        first_tick: u32::MAX - random.below(20_000_000) as u32,
        ..Emulated::default()
    };
    let silence = settings.silence.seconds().0;
    let mut host = Host::on(Shared::new(settings));
    host.stops_off_path = true;
    host.tell(RigCommand::EnableMotor);
    let speed = 0.1 + 9.8 * random.below(1_000) as f64 / 1_000.0;
    let (speed, acceleration) = (MmPerS(speed), MmPerS2(50.0));
    let is_lazy_to_come = random.below(4) == 0;
    if !is_lazy_to_come {
        host.tell(to(12_000, speed.0));
        host.pass(0.05 + random.below(1_000) as f64 * 1e-3);
    }
    let trouble = Trouble::pick(&mut random);
    trouble.begin(&mut host, seed);
    let from = host.position_mm();
    if is_lazy_to_come {
        host.send(to(12_000, speed.0));
    }
    let is_stop_asked =
        random.below(3) == 0 || matches!(trouble, Trouble::Lie(SidecarLie::DeafToStops));
    if is_stop_asked {
        host.send(RigCommand::Stop);
    }
    if matches!(trouble, Trouble::HostHangs) {
        host.wire.pass(3.0);
    } else {
        host.pass(1.0);
    }
    host.pass(2.0);
    if matches!(trouble, Trouble::Lie(SidecarLie::Lazy)) {
        return check_lazy(&host, from, is_lazy_to_come, is_stop_asked);
    }
    check(&host, trouble, from, (speed, acceleration), silence)
}

/// A motion that is to come is not made, and that is reported unless a stop has taken it back. One under way goes on.
fn check_lazy(host: &Host, from: f64, is_to_come: bool, is_stop_asked: bool) -> Result<(), String> {
    let wire = host.wire.lock();
    let far = wire.emulator.position_mm() - from;
    let what = format!("lazy: {far:.3} mm, {:?} {:?}", host.faults, host.ending);
    let is_missed = host.faults.iter().any(|one| one.to_string().contains("does not move"));
    let has_stopped = host.acks.contains(&RigCommand::Stop);
    let is_right = if is_to_come {
        far == 0.0 && is_missed != is_stop_asked && has_stopped == is_stop_asked
    } else {
        far >= 0.0 && host.faults.is_empty() && has_stopped == is_stop_asked
    };
    let stands = !is_stop_asked || !wire.emulator.is_moving();
    let is_quiet = host.ending.is_none() && host.path_errors.is_empty();
    let is_well = is_right && stands && is_quiet;
    if is_well { Ok(()) } else { Err(format!("{what} {:?} {:?}", host.acks, host.path_errors)) }
}

/// The oracle is the emulated axis itself: where it truly is, and whether it stands.
fn check(
    host: &Host,
    trouble: Trouble,
    from: f64,
    (speed, acceleration): (MmPerS, MmPerS2),
    silence: f64,
) -> Result<(), String> {
    let wire = host.wire.lock();
    let far = wire.emulator.position_mm() - from;
    let is_at_target = (wire.emulator.position_mm() - 30.0).abs() < 0.01;
    // Two ways of 0.7 ms and the reaction of up to 5 ms come to it, and a slow sample.
    let time = trouble.noticed_within(silence) + 0.03;
    let most = speed.0 * time + speed.0 * speed.0 / (2.0 * acceleration.0) + 0.01;
    let reports = (!host.faults.is_empty(), host.ending.is_some(), !host.path_errors.is_empty());
    let what =
        format!("{trouble:?} at {speed}: {far:.3} mm of {most:.3}, {reports:?} {:?}", host.faults);
    if wire.emulator.is_moving() {
        return Err(format!("it still moves: {what}"));
    }
    // A quick move may be at its target.
    if far > most && !is_at_target {
        return Err(format!("it went too far: {what}"));
    }
    let is_reported = reports != (false, false, false);
    let is_host = matches!(trouble, Trouble::HostHangs | Trouble::OwnerHangs);
    if !is_host && !is_reported {
        return Err(format!("no one is informed: {what}"));
    }
    Ok(())
}

#[test]
fn killed_stalled_and_lying_sidecars_end_safe() {
    let first = number("PALPATE_SIDECAR_SEED", 1);
    let runs = number("PALPATE_SIDECAR_FAULTS", 200);
    let mut wrong = Vec::new();
    for seed in first..first + runs {
        if let Err(why) = run(seed) {
            wrong.push(format!("seed {seed}: {why}"));
        }
    }
    println!(
        "{runs} runs of sidecars that are killed, stall or lie; {} ended wrongly",
        wrong.len()
    );
    assert!(
        wrong.is_empty(),
        "{} of {runs}:\n{}",
        wrong.len(),
        wrong[..wrong.len().min(20)].join("\n")
    );
}

#[test]
fn samples_at_one_kilohertz_are_complete() {
    let seconds = number("PALPATE_SIDECAR_SECONDS", 20);
    let settings = Emulated {
        rate: 1_000.0,
        has_frames: true,
        clock_ppm: 40.0,
        // It wraps on the way, also in a short test.
        first_tick: u32::MAX - 5_000_000,
        ..Emulated::default()
    };
    let mut host = Host::on(Shared::new(settings));
    let (mut newest, mut lost) = (None, 0);
    for _ in 0..seconds {
        host.pass(1.0);
        for reading in host.readings.drain(..) {
            // A microsecond is lost or won now and then by the clock's error.
            let is_next = newest.is_none_or(|tick: u64| reading.tick.abs_diff(tick + 1_000) <= 1);
            lost += u64::from(!is_next);
            newest = Some(reading.tick);
        }
    }
    println!("{} samples at 1 kHz, {lost} lost", host.count);
    assert_eq!(lost, 0);
    // What is still under way was not counted.
    let taken = host.wire.lock().emulator.samples();
    assert!(taken - host.count < 100, "{taken} taken, {} arrived", host.count);
    assert!(host.faults.is_empty() && host.ending.is_none(), "{:?}", host.faults);
    assert!(!host.faults.contains(&Fault::ControllerReset));
}
