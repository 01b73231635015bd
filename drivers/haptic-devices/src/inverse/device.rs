//! The device: a thread with the connection, and the ends of it in the scene's loop.

use super::discover::{DeadMan, FoundDevice, InverseError, find};
use super::exchange::{BEAT, Exchange, NO_POSE, SensedPose};
use super::link::Link;
use super::message::ReportFault;
use crate::figures::{InverseFigures, RoundTrip};
use crate::fit::WorkspaceFit;
use crate::gate::{ForceLimits, ForceStop};
use palpate_drivers::priority::request_real_time;
use palpate_drivers::wire::HostClock;
use palpate_haptics::margin::LoopDevice;
use palpate_haptics::scene::{DeviceSettings, Pose};
use palpate_haptics::{HapticDevice, Period};
use palpate_model::Nanos;
use std::fmt;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{JoinHandle, park_timeout, sleep};
use std::time::Duration;
use triple_buffer::{Input, Output, triple_buffer};

/// Messages whose round trip is measured at the start: 0.2 s of no force.
const PINGS: usize = 200;
/// Longest round trip at the start.
const PING_MAX: Nanos = Nanos::from_millis(1000);
/// Rests of the thread: while an answer is due, and else. A fault is seen at most this late.
const REST_WAITING: Duration = Duration::from_micros(100);
const REST: Duration = Duration::from_micros(250);
/// Reports that are read before the next message: a service that sends without end must not keep a zero from being sent.
const RECEIVED_MAX: usize = 16;
/// Beats in which the answer to the last zero is waited for.
const GOODBYE_TURNS: u32 = 50;
/// From one attempt to connect again to the next.
const RETRY: Duration = Duration::from_millis(200);
/// Time in which a pose must be new: a thread that does not run reports no fault of its own.
const POSE_AGE_MAX_S: f64 = 0.005;

/// Which device, and how it lies in the scene.
#[derive(Clone, Debug)]
pub struct InverseOptions {
    /// The service: on this computer, as it does not encrypt.
    pub address: SocketAddr,
    /// Name of the device in the service; the only one if `None`.
    pub device: Option<String>,
    pub dead_man: DeadMan,
    pub fit: WorkspaceFit,
    pub limits: ForceLimits,
    pub figures: InverseFigures,
    /// Middle of the tissue's surface in the scene, in mm.
    pub middle: [f64; 3],
    /// From tick to tick of the scene.
    pub period: Period,
}

impl InverseOptions {
    /// The only device of the service on this computer, around the middle of a scene.
    #[must_use]
    pub fn new(middle: [f64; 3], period: Period) -> Self {
        Self {
            address: SocketAddr::from((Ipv4Addr::LOCALHOST, 10001)),
            device: None,
            dead_man: DeadMan::IfPresent,
            fit: WorkspaceFit::default(),
            limits: ForceLimits::default(),
            figures: InverseFigures::default(),
            middle,
            period,
        }
    }
}

/// How the connection is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkReport {
    pub is_connected: bool,
    /// Why there is no force.
    pub stop: ForceStop,
    /// The newest report that could not be, and how many there were.
    pub fault: Option<ReportFault>,
    pub faults: u64,
    /// Reports received.
    pub reports: u64,
    /// Times that the connection was lost.
    pub losses: u64,
}

/// A look at a device while the scene's loop has it.
#[derive(Clone, Debug)]
pub struct InverseMonitor(Arc<Mutex<LinkReport>>);

impl InverseMonitor {
    /// How the connection is.
    #[must_use]
    pub fn report(&self) -> LinkReport {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A tick of the scene.
#[derive(Clone, Copy, Debug, Default)]
struct Order {
    number: u64,
    /// When the scene gave it: a thread that runs late must not take it for new.
    at: Nanos,
    force: [f64; 3],
}

/// An Inverse3 in use. Dropping it sends zero force and ends the session.
pub struct InverseDevice {
    settings: DeviceSettings,
    found: FoundDevice,
    round_trip: RoundTrip,
    loop_device: LoopDevice,
    sensed: Output<SensedPose>,
    orders: Input<Order>,
    clock: HostClock,
    number: u64,
    /// The newest report seen, and ticks since.
    seen: u64,
    ticks_without: u64,
    ticks_without_max: u64,
    monitor: InverseMonitor,
    is_ending: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl InverseDevice {
    /// Finds the device, measures the delay of its wire with zero force, and starts its thread.
    pub fn open(options: &InverseOptions, clock: HostClock) -> Result<Self, InverseError> {
        let fit = options.fit.checked()?;
        let device = options.figures.device;
        let force_max_n = device.force_max_n.min(options.limits.force_max_n);
        let settings = fit.scene_settings(&DeviceSettings { force_max_n, ..device }).checked()?;
        let limits = ForceLimits { force_max_n, ..options.limits };
        let found = find(options.address, options.device.as_deref(), options.dead_man)?;
        let names = (found.name.clone(), found.grip.clone());
        let mut exchange = Exchange::new(names, fit, options.middle, limits);
        let mut link = connect(options.address, &mut exchange)?;
        let round_trip = measure(&mut link, &mut exchange, &clock)?;
        let (pose_input, sensed) = triple_buffer(&SensedPose { number: 0, pose: NO_POSE });
        let (orders, order_output) = triple_buffer(&Order::default());
        let monitor = InverseMonitor(Arc::new(Mutex::new(LinkReport::default())));
        let is_ending = Arc::new(AtomicBool::new(false));
        let service = Service {
            address: options.address,
            exchange,
            clock: Arc::clone(&clock),
            poses: pose_input,
            orders: order_output,
            last_order: 0,
            monitor: monitor.clone(),
            losses: 0,
            is_ending: Arc::clone(&is_ending),
        };
        let thread = std::thread::Builder::new()
            .name("haptic-device".into())
            .spawn(move || service.run(link))
            .map_err(InverseError::Thread)?;
        let period_s = options.period.seconds().0;
        Ok(Self {
            loop_device: options.figures.loop_device(&settings, &round_trip, options.period),
            settings,
            found,
            round_trip,
            sensed,
            orders,
            clock,
            number: 0,
            seen: 0,
            ticks_without: 0,
            ticks_without_max: (POSE_AGE_MAX_S / period_s).ceil().max(1.0) as u64,
            monitor,
            is_ending,
            thread: Some(thread),
        })
    }

    /// Which device and service were found.
    #[must_use]
    pub fn found(&self) -> &FoundDevice {
        &self.found
    }

    /// Round trips measured at the start.
    #[must_use]
    pub fn round_trip(&self) -> RoundTrip {
        self.round_trip
    }

    /// What the margin before play needs, with this device's delay.
    #[must_use]
    pub fn loop_device(&self) -> LoopDevice {
        self.loop_device
    }

    /// A look at it for another thread.
    #[must_use]
    pub fn monitor(&self) -> InverseMonitor {
        self.monitor.clone()
    }
}

impl fmt::Debug for InverseDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("InverseDevice").field("found", &self.found).finish_non_exhaustive()
    }
}

impl HapticDevice for InverseDevice {
    fn settings(&self) -> &DeviceSettings {
        &self.settings
    }

    fn sense(&mut self, elapsed: u64) -> Pose {
        let sensed = *self.sensed.read();
        if sensed.number == self.seen {
            self.ticks_without = self.ticks_without.saturating_add(elapsed);
        } else {
            self.seen = sensed.number;
            self.ticks_without = 0;
        }
        if self.ticks_without > self.ticks_without_max { NO_POSE } else { sensed.pose }
    }

    fn give(&mut self, force: [f64; 3]) {
        self.number += 1;
        self.orders.write(Order { number: self.number, at: (self.clock)(), force });
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }
}

impl Drop for InverseDevice {
    fn drop(&mut self) {
        self.is_ending.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A thread that failed has let the connection go, and the service ends its force.
            let _ = thread.join();
        }
    }
}

/// A connection with the device in its inventory.
fn connect(address: SocketAddr, exchange: &mut Exchange) -> Result<Link, InverseError> {
    let (link, inventory) =
        Link::open(address).map_err(|err| InverseError::Connect(err.to_string()))?;
    exchange.begin(&inventory).map_err(|fault| InverseError::Connect(fault.to_string()))?;
    Ok(link)
}

/// Round trips of messages with zero force, one each millisecond as later.
fn measure(
    link: &mut Link,
    exchange: &mut Exchange,
    clock: &HostClock,
) -> Result<RoundTrip, InverseError> {
    let silent = |reason: String| InverseError::Silent(reason);
    let mut times = Vec::with_capacity(PINGS);
    let mut faults = 0;
    for ping in 0..PINGS {
        if ping == PINGS / 2 {
            // A service may need some messages until all its values are there.
            (_, faults) = exchange.faults();
        }
        let begin = clock();
        link.send(exchange.message(begin)).map_err(|err| silent(err.to_string()))?;
        let answer = loop {
            let answer = link.receive().map_err(|err| silent(err.to_string()))?;
            let now = clock();
            match answer {
                Some(text) => break (now, text),
                None if now.since(begin) > PING_MAX => {
                    return Err(silent("no answer within 1 s".into()));
                }
                None => sleep(REST_WAITING / 4),
            }
        };
        exchange.receive(answer.0, &answer.1);
        times.push(answer.0.since(begin));
        sleep(Duration::from_nanos(BEAT.since(answer.0.since(begin)).0));
    }
    match exchange.faults() {
        (Some(fault), count) if count > faults => Err(silent(fault.to_string())),
        _ => Ok(RoundTrip::of(times)),
    }
}

/// What the thread has.
struct Service {
    address: SocketAddr,
    exchange: Exchange,
    clock: HostClock,
    poses: Input<SensedPose>,
    orders: Output<Order>,
    last_order: u64,
    monitor: InverseMonitor,
    losses: u64,
    is_ending: Arc<AtomicBool>,
}

impl Service {
    fn is_ending(&self) -> bool {
        self.is_ending.load(Ordering::Relaxed)
    }

    /// Runs until the device is dropped; a lost connection is opened again.
    fn run(mut self, first: Link) {
        // Without real-time priority it runs as an ordinary thread; the watchdog counts time, not turns.
        let _ = request_real_time();
        let mut link = Some(first);
        while !self.is_ending() {
            match link.take() {
                Some(open) => {
                    if let Some(open) = self.talk(open) {
                        self.say_goodbye(open);
                        return;
                    }
                    self.lose_link();
                }
                None => link = self.reconnect(),
            }
        }
    }

    /// Exchanges messages until the device is dropped, with the connection, or until that is lost.
    fn talk(&mut self, mut link: Link) -> Option<Link> {
        while !self.is_ending() {
            self.take_order();
            for _ in 0..RECEIVED_MAX {
                let Some(text) = link.receive().ok()? else {
                    break;
                };
                let now = (self.clock)();
                let sensed = self.exchange.receive(now, &text);
                self.poses.write(sensed);
            }
            let now = (self.clock)();
            if self.exchange.is_due(now) {
                link.send(self.exchange.message(now)).ok()?;
                self.publish(true);
            }
            if self.exchange.is_hopeless(now) {
                return None;
            }
            let rest = if self.exchange.is_waiting() { REST_WAITING } else { REST };
            park_timeout(rest);
        }
        Some(link)
    }

    fn take_order(&mut self) {
        if self.orders.update() {
            let order = *self.orders.output_buffer();
            if order.number != self.last_order {
                self.last_order = order.number;
                self.exchange.set_order(order.at, order.force);
            }
        }
    }

    /// Shows how the connection is, and to the scene that there is no pose.
    fn publish(&mut self, is_connected: bool) {
        let stop = self.exchange.stop();
        if !is_connected || stop == ForceStop::NoReply {
            let number = self.exchange.reports();
            self.poses.write(SensedPose { number, pose: NO_POSE });
        }
        let (fault, faults) = self.exchange.faults();
        let reports = self.exchange.reports();
        let report = LinkReport { is_connected, stop, fault, faults, reports, losses: self.losses };
        *self.monitor.0.lock().unwrap_or_else(PoisonError::into_inner) = report;
    }

    fn lose_link(&mut self) {
        self.losses += 1;
        self.exchange.lose_link();
        // Its force is zero now, and its reason is that the connection is lost.
        self.exchange.note_lost((self.clock)());
        self.publish(false);
    }

    fn reconnect(&mut self) -> Option<Link> {
        let link = connect(self.address, &mut self.exchange).ok();
        if link.is_none() {
            park_timeout(RETRY);
        }
        link
    }

    /// Zero force, then the end of the session.
    fn say_goodbye(&mut self, mut link: Link) {
        self.exchange.end();
        let now = (self.clock)();
        let _ = link.send(self.exchange.message(now));
        self.publish(true);
        // Closing with reports unread sends a reset, which may overtake the zero; so its answer is waited for a little.
        for _ in 0..GOODBYE_TURNS {
            while let Ok(Some(text)) = link.receive() {
                self.exchange.receive((self.clock)(), &text);
            }
            if !self.exchange.is_waiting() {
                break;
            }
            sleep(Duration::from_nanos(BEAT.0));
        }
        link.close();
    }
}
