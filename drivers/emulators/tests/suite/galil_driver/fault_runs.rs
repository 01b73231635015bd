//! Random moves and stops over a pseudo-terminal while something goes wrong: every run ends safe.
//!
//! `PALPATE_GALIL_FAULTS` asks for more runs than the suite takes, `PALPATE_GALIL_SEED` for another first one.
#![expect(clippy::disallowed_methods, reason = "faults and moves meet in real time")]

use super::bench::{thesis, to};
use super::wires::opened;
use palpate_drivers::galil::{GalilRig, GalilSettings, Sampling};
use palpate_drivers::wire::DeviceAddress;
use palpate_drivers::{Rig, RigEventBody};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::faults::DeviceFault;
use palpate_emulators::galil::{EmulatedGalilSettings as Emulated, GalilEmulator};
use palpate_emulators::serve::{EmulatorAddress as At, ServeEvent, ServeOptions, serve};
use palpate_model::Nanos;
use palpate_model::random::SplitMix;
use palpate_model::rig::{Fault, HandAction, Oscillation, RigCommand};
use palpate_model::units::MmPerS2;
use palpate_test_support::skip;
use palpate_test_support::wait::PATIENCE;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

const KINDS: [&str; 12] = [
    "garbage",
    "drop",
    "duplicate",
    "partial",
    "late",
    "deaf",
    "mute",
    "reset",
    "disconnect",
    "stuck",
    "saturated",
    "wrong-device",
];
/// Runs at once: they mostly wait.
const AT_ONCE: usize = 10;
/// Limit switches are 2 mm beyond home and beyond the travel; from 20 mm/s the axis needs 3.3 mm to stand.
const REACH: std::ops::RangeInclusive<f64> = -5.4..=155.4;

/// The emulated controller, and where its slide was when it heard the last byte.
struct Watched {
    inner: GalilEmulator,
    heard_at: f64,
    least: f64,
    most: f64,
}

impl EmulatedDevice for Watched {
    fn receive(&mut self, now: Nanos, channel: usize, bytes: &[u8]) {
        self.inner.receive(now, channel, bytes);
        self.heard_at = self.inner.slide().0;
    }

    fn advance(&mut self, now: Nanos) {
        self.inner.advance(now);
        let slide = self.inner.slide().0;
        self.least = self.least.min(slide);
        self.most = self.most.max(slide);
    }

    fn transmit(&mut self, channel: usize) -> Vec<u8> {
        self.inner.transmit(channel)
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        self.inner.apply_fault(now, fault, is_on);
    }

    fn apply_hand_action(&mut self, now: Nanos, action: HandAction) {
        self.inner.apply_hand_action(now, action);
    }
}

fn pick<'a>(random: &mut SplitMix, of: &[&'a str]) -> &'a str {
    of[random.below(of.len())]
}

/// From 0 to 1.
fn share(random: &mut SplitMix) -> f64 {
    random.below(1000) as f64 * 1e-3
}

fn command(random: &mut SplitMix) -> RigCommand {
    let speed = [0.75, 4.98, 9.99, 19.98][random.below(4)];
    match random.below(10) {
        0 => RigCommand::Halt,
        1 | 2 => RigCommand::Stop,
        3 => RigCommand::Oscillate(Oscillation {
            amplitude_pulses: 50,
            period_ticks: 700 + random.below(1000) as u32,
            cycles: 1 + random.below(3) as u32,
            acceleration: MmPerS2(61.44),
        }),
        _ => to(random.below(20_000) as i64 - 6_000, speed),
    }
}

/// What a run is made of, for the one who has to look at it.
struct Story {
    seed: u64,
    lines: Vec<String>,
}

impl Story {
    fn note(&mut self, line: String) {
        self.lines.push(line);
    }
}

/// One run; `Err` says in words what was not safe.
fn run(seed: u64) -> Result<(), String> {
    let mut random = SplitMix::seeded(seed);
    let mut story = Story { seed, lines: Vec::new() };
    let (orders, received) = sync_channel(16);
    let (sender, printed) = sync_channel(64);
    let stop = Arc::new(AtomicBool::new(false));
    let is_over = Arc::clone(&stop);
    let served = std::thread::Builder::new()
        .name("emulator".into())
        .spawn(move || {
            let mut device = Watched {
                inner: GalilEmulator::new(Emulated::default()),
                heard_at: 0.0,
                least: f64::INFINITY,
                most: f64::NEG_INFINITY,
            };
            let options = ServeOptions {
                address: At::Pty(None),
                baud: None,
                latency: Nanos::ZERO,
                faults: Vec::new(),
                seed,
            };
            let mut tell = |printed| drop(sender.try_send(printed));
            serve(&mut device, &options, &received, &is_over, &mut tell).expect("it is served");
            device
        })
        .expect("a thread");
    let Ok(ServeEvent::Ready(address)) = printed.recv_timeout(PATIENCE) else {
        return Err("the emulator did not start".into());
    };
    let place = DeviceAddress::Serial { port: address, baud: 115_200, has_handshake: false };
    let settings =
        GalilSettings { sampling: [Sampling::Poll, Sampling::Record][random.below(2)], ..thesis() };
    let verdict = opened(&place, &settings).map_err(|err| err.to_string()).and_then(|rig| {
        drive(rig, &mut random, &mut story, &|order| {
            drop(orders.try_send(order));
        })
    });
    // Whatever was still under way: two looks of the watchdog and the brake.
    std::thread::sleep(Duration::from_millis(1500));
    stop.store(true, Ordering::Relaxed);
    let device = served.join().map_err(|_| "the emulator has failed")?;
    let worst = verdict.map_err(|why| tell(&story, &why))?;
    let way = (device.inner.slide().0 - device.heard_at).abs();
    let (least, most) = (device.least, device.most);
    if device.inner.is_running(0) {
        return Err(tell(&story, "the axis still moves"));
    }
    if way > worst {
        let why = format!("{way:.2} mm after the last byte, {worst:.2} mm were stated");
        return Err(tell(&story, &why));
    }
    if !(REACH.contains(&least) && REACH.contains(&most)) {
        return Err(tell(&story, &format!("from {least:.1} to {most:.1} mm")));
    }
    Ok(())
}

fn tell(story: &Story, why: &str) -> String {
    format!("seed {}: {why}\n  {}", story.seed, story.lines.join("\n  "))
}

/// Moves and faults; gives the worst case that was stated.
fn drive(
    mut rig: GalilRig,
    random: &mut SplitMix,
    story: &mut Story,
    order: &dyn Fn(String),
) -> Result<f64, String> {
    let worst = rig.device().worst_case_mm();
    let start = Instant::now();
    let at = |start: Instant| start.elapsed().as_secs_f64();
    let mut faults: Vec<(f64, String)> = (0..1 + random.below(2))
        .map(|_| {
            let lasts = 0.05 + 0.9 * share(random);
            let kind = pick(random, &KINDS);
            (0.3 + 1.7 * share(random), format!("{kind}:{lasts:.2}"))
        })
        .collect();
    let mut now = Nanos::ZERO;
    let (mut next_at, mut sent, mut answered, mut is_lost) = (0.0, 0, 0, false);
    rig.send(RigCommand::EnableMotor);
    sent += 1;
    // Then whatever is not answered yet is waited for: a search for lost answers takes two seconds.
    while at(start) < 2.4 || (answered < sent && at(start) < PATIENCE.as_secs_f64() && !is_lost) {
        faults.retain(|(due, fault)| {
            let is_due = at(start) >= *due;
            if is_due {
                story.note(format!("{:.3} s {fault}", at(start)));
                order(fault.clone());
            }
            !is_due
        });
        if at(start) >= next_at && at(start) < 2.4 && !is_lost {
            next_at = at(start) + 0.05 + 0.5 * share(random);
            let command = command(random);
            story.note(format!("{:.3} s {command:?}", at(start)));
            rig.send(command);
            sent += 1;
        }
        now = now + Nanos::from_millis(10);
        while let Some(event) = rig.next_event(now) {
            match event.body {
                RigEventBody::Reading(_) => {}
                RigEventBody::Ack(ack) => {
                    answered += 1;
                    story.note(format!("{:.3} s done {:?}", at(start), ack.command));
                }
                RigEventBody::Fault(fault) => {
                    story.note(format!("{:.3} s {fault}", at(start)));
                    match fault {
                        Fault::LinkLost { .. } => is_lost = true,
                        // A sine that was aborted had been acknowledged before.
                        Fault::CommandRefused { detail }
                            if detail.contains("was aborted")
                                || detail.contains("stopped recording") => {}
                        Fault::CommandRefused { .. } => answered += 1,
                        _ => {}
                    }
                }
            }
        }
        drop(rig.take_raw());
    }
    if answered < sent && !is_lost {
        return Err(format!("{answered} of {sent} commands were answered"));
    }
    Ok(worst)
}

#[test]
fn every_run_ends_safe() {
    if skip::lacks_terminals() {
        return;
    }
    let number = |variable: &str, usual: usize| {
        let given = std::env::var(variable).ok();
        given.and_then(|text| text.parse().ok()).unwrap_or(usual)
    };
    let (runs, first) = (number("PALPATE_GALIL_FAULTS", 20), number("PALPATE_GALIL_SEED", 1));
    let next = AtomicUsize::new(first);
    let unsafe_ones: Vec<String> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..AT_ONCE.min(runs))
            .map(|_| {
                scope.spawn(|| {
                    let mut bad = Vec::new();
                    loop {
                        let seed = next.fetch_add(1, Ordering::Relaxed);
                        if seed >= first + runs {
                            return bad;
                        }
                        if let Err(why) = run(seed as u64) {
                            println!("{why}");
                            bad.push(why);
                        }
                        if (seed - first + 1).is_multiple_of(500) {
                            println!("{} of {runs} runs", seed - first + 1);
                        }
                    }
                })
            })
            .collect();
        let done = workers.into_iter().map(|worker| worker.join());
        done.flat_map(|bad| bad.expect("it does not panic")).collect()
    });
    println!("{runs} runs, {} not safe", unsafe_ones.len());
    assert!(unsafe_ones.is_empty(), "{} of {runs} runs", unsafe_ones.len());
}
