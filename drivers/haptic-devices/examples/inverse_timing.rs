//! Times on this computer: a tick of a scene on an emulated Inverse3 over a real socket, and the time from a fault to zero
//! force on the emulated hand.
//!
//! `cargo run --release -p palpate-haptic-devices --example inverse_timing -- [SECONDS] [CASES]` (10 s and 1000 cases).
#![expect(clippy::disallowed_methods, reason = "an example that measures has a clock of its own")]
#![expect(clippy::print_stdout, reason = "its output is its purpose")]

use palpate_drivers::priority::request_real_time;
use palpate_drivers::sim::{Random, RandomStream};
use palpate_drivers::wire::HostClock;
use palpate_emulators::ServedDevice;
use palpate_emulators::inverse::{
    EmulatedInverse, InverseFault, InverseLie, InversePanel, InverseServiceSettings,
};
use palpate_haptic_devices::{ForceLimits, InverseOptions, LinkedDevice, open_inverse};
use palpate_haptics::scene::{Scene, SceneSettings};
use palpate_haptics::{HapticDevice, Period};
use palpate_model::Nanos;
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

const ZERO_WITHIN_MS: f64 = 5.0;

/// Sleeps to each tick's time.
struct Beat {
    start: Instant,
    ticks: u64,
}

impl Beat {
    fn new() -> Self {
        Self { start: Instant::now(), ticks: 0 }
    }

    /// Waits for the next tick; how late it is woken.
    fn wait(&mut self) -> Duration {
        self.ticks += 1;
        let due = self.start + Duration::from_millis(self.ticks);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        due.elapsed()
    }
}

fn print_percentiles(what: &str, mut times: Vec<Duration>) {
    times.sort_unstable();
    let rank = |share: f64| {
        let index = (share * times.len() as f64).ceil() as usize;
        times.get(index.saturating_sub(1)).copied().unwrap_or_default().as_secs_f64() * 1e3
    };
    println!(
        "{what}: p50 {:.3}, p99 {:.3}, p99.9 {:.3}, max {:.3} ms of {}",
        rank(0.5),
        rank(0.99),
        rank(0.999),
        rank(1.0),
        times.len()
    );
}

/// Ticks of a whole scene: sense, render, give.
fn time_ticks(
    options: &InverseOptions,
    clock: &HostClock,
    seconds: u64,
) -> Result<(), Box<dyn Error>> {
    let (mut device, _) = open_inverse(options, clock.clone())?;
    let found = device.round_trip();
    println!(
        "round trip at the start: median {:.3}, p99 {:.3}, max {:.3} ms of {}",
        found.median.seconds().0 * 1e3,
        found.p99.seconds().0 * 1e3,
        found.max.seconds().0 * 1e3,
        found.count
    );
    println!("delay for the margin: {:.2} ticks of 1 ms", device.loop_device().delay_ticks);
    let settings = SceneSettings::default().with_device(*device.settings());
    let mut scene = Scene::new(settings)?;
    let (mut beat, mut latenesses, mut works) = (Beat::new(), Vec::new(), Vec::new());
    let (mut touching, mut stale, mut before) = (0_u64, 0_u64, 0);
    let monitor = device.monitor();
    for _ in 0..1000 * seconds {
        latenesses.push(beat.wait());
        let begin = Instant::now();
        let pose = device.sense(1);
        let tick = scene.render(pose, 1);
        device.give(tick.force);
        works.push(begin.elapsed());
        touching += u64::from(tick.is_contact());
        let reports = monitor.report().reports;
        stale += u64::from(reports == before);
        before = reports;
    }
    print_percentiles("tick: sense, scene, give", works);
    print_percentiles("lateness of the tick", latenesses);
    println!(
        "in contact in {touching} ticks; ticks without a new report: {stale}; {:?}",
        monitor.report()
    );
    Ok(())
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Case {
    SceneStops,
    Cut,
    Stalled,
    Lying(InverseLie),
}

/// One fault: time from it to zero force on the emulated hand.
fn time_fault(
    device: &mut LinkedDevice,
    panel: &InversePanel,
    (case, random): (Case, &mut Random),
) -> Result<f64, Box<dyn Error>> {
    let mut beat = Beat::new();
    let mut ticks = |device: &mut LinkedDevice, count: u64| {
        for _ in 0..count {
            beat.wait();
            device.sense(1);
            device.give([0.0, 0.0, 1.0]);
        }
    };
    // The ramp of 20 ms is over; after a cut the device connects again first.
    let mut attempts = 0;
    while panel.force() != [0.0, 0.0, 1.0] {
        ticks(device, 1);
        attempts += 1;
        if attempts > 5000 {
            return Err("the force does not come".into());
        }
    }
    ticks(device, 5 + (random.unit() * 10.0) as u64);
    std::thread::sleep(Duration::from_micros((random.unit() * 900.0) as u64));
    match case {
        Case::SceneStops => {
            ticks(device, 1);
            return watch_silence(panel);
        }
        Case::Cut => panel.set_fault(Some(InverseFault::Cut)),
        Case::Stalled => panel.set_fault(Some(InverseFault::Stalled)),
        Case::Lying(lie) => panel.set_fault(Some(InverseFault::Lie(lie))),
    }
    ticks(device, 15);
    let from = panel.fault_at().ok_or("the fault does not begin")?;
    // A command's own end, 20 ms without another, must not hide a force that stays.
    let zero = panel.zero_in_fault().ok_or("the force stays")?;
    panel.set_fault(None);
    while panel.fault_at().is_some() {
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(zero.since(from).seconds().0 * 1e3)
}

/// Time from the last tick, now, to zero force. The emulator's clock is another one, and so it is watched.
fn watch_silence(panel: &InversePanel) -> Result<f64, Box<dyn Error>> {
    let begin = Instant::now();
    while panel.zero_since().is_none() {
        if begin.elapsed() > Duration::from_millis(100) {
            return Err("the force stays".into());
        }
        std::thread::sleep(Duration::from_micros(30));
    }
    Ok(begin.elapsed().as_secs_f64() * 1e3)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let mut number = |usual: u64| words.next().and_then(|word| word.parse().ok()).unwrap_or(usual);
    let (seconds, cases) = (number(10), number(1000));
    let (service, panel) = EmulatedInverse::new(InverseServiceSettings::default())?;
    let served = ServedDevice::start(service, ServedDevice::free_port())?;
    let start = Instant::now();
    let clock: HostClock = Arc::new(move || Nanos(start.elapsed().as_nanos() as u64));
    println!("priority of the scene's thread: {}", request_real_time());
    let settings = SceneSettings::default();
    let usual = InverseOptions::new(settings.middle(), Period::MILLISECOND);
    let options = InverseOptions { address: served.address.parse()?, ..usual };
    time_ticks(&options, &clock, seconds)?;

    let limits = ForceLimits { ramp: Nanos::from_millis(20), ..options.limits };
    let (mut device, _) = open_inverse(&InverseOptions { limits, ..options }, clock.clone())?;
    let mut random = Random::new(1, RandomStream::Fault);
    for kind in ["the scene stops", "link cut", "stalled", "lying"] {
        let (mut times, mut in_time) = (Vec::new(), 0_u64);
        for case in 0..cases {
            let lies = InverseLie::ALL;
            let case = match kind {
                "the scene stops" => Case::SceneStops,
                "link cut" => Case::Cut,
                "stalled" => Case::Stalled,
                _ => Case::Lying(lies[case as usize % lies.len()]),
            };
            let millis = time_fault(&mut device, &panel, (case, &mut random))?;
            in_time += u64::from(millis <= ZERO_WITHIN_MS);
            times.push(Duration::from_secs_f64(millis * 1e-3));
        }
        print_percentiles(&format!("{kind}: zero force after"), times);
        println!("{kind}: within {ZERO_WITHIN_MS} ms in {in_time} of {cases}");
    }
    Ok(())
}
