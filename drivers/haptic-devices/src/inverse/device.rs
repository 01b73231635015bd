//! The device: a thread with the connection, and the ends of it in the scene's loop.

use super::discover::{FoundDevice, InverseError, find};
use super::exchange::{BEAT, Exchange};
use super::link::Link;
use crate::figures::{DeviceFigures, RoundTrip};
use crate::fit::WorkspaceFit;
use crate::gate::ForceLimits;
use crate::hand_over::{ThreadEnd, hand_over};
use crate::linked::LinkedDevice;
use palpate_drivers::priority::request_real_time;
use palpate_drivers::wire::HostClock;
use palpate_haptics::Period;
use palpate_model::Nanos;
use std::net::{Ipv4Addr, SocketAddr};
use std::thread::{park_timeout, sleep};
use std::time::Duration;

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

/// Which device, and how it lies in the scene.
#[derive(Clone, Debug)]
pub struct InverseOptions {
    /// The service: on this computer, as it does not encrypt.
    pub address: SocketAddr,
    /// Name of the device in the service; the only one if `None`.
    pub device: Option<String>,
    pub fit: WorkspaceFit,
    pub limits: ForceLimits,
    pub figures: DeviceFigures,
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
            fit: WorkspaceFit::default(),
            limits: ForceLimits::default(),
            figures: DeviceFigures::inverse3(),
            middle,
            period,
        }
    }
}

/// Finds the device, measures the delay of its wire with zero force, and starts its thread. Dropping it ends the session of the service.
pub fn open_inverse(
    options: &InverseOptions,
    clock: HostClock,
) -> Result<(LinkedDevice, FoundDevice), InverseError> {
    let (fit, settings, limits) =
        options.figures.in_scene(&options.fit, &options.limits, options.period)?;
    let found = find(options.address, options.device.as_deref())?;
    let names = (found.name.clone(), found.grip.clone());
    let mut exchange = Exchange::new(names, fit, options.middle, limits);
    let mut link = connect(options.address, &mut exchange)?;
    let round_trip = measure(&mut link, &mut exchange, &clock)?;
    let (mut scene, thread) = hand_over(settings, options.period, clock);
    let service = Service { address: options.address, exchange, scene: thread };
    scene.start(move || service.run(link)).map_err(InverseError::Thread)?;
    Ok((LinkedDevice::new(scene, &options.figures, round_trip, options.period), found))
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
    scene: ThreadEnd,
}

impl Service {
    /// Runs until the device is dropped; a lost connection is opened again.
    fn run(mut self, first: Link) {
        // Without real-time priority it runs as an ordinary thread; the watchdog counts time, not turns.
        let _ = request_real_time();
        let mut link = Some(first);
        while !self.scene.is_ending() {
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
        while !self.scene.is_ending() {
            if let Some((at, force)) = self.scene.take_order() {
                self.exchange.set_order(at, force);
            }
            for _ in 0..RECEIVED_MAX {
                let Some(text) = link.receive().ok()? else {
                    break;
                };
                let now = self.scene.now();
                self.scene.show_pose(self.exchange.receive(now, &text));
            }
            let now = self.scene.now();
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

    fn publish(&mut self, is_connected: bool) {
        self.scene.publish(self.exchange.link_report(is_connected));
    }

    fn lose_link(&mut self) {
        self.scene.count_loss();
        self.exchange.lose_link();
        // Its force is zero now, and its reason is that the connection is lost.
        self.exchange.note_lost(self.scene.now());
        self.publish(false);
    }

    fn reconnect(&mut self) -> Option<Link> {
        let link = connect(self.address, &mut self.exchange).ok();
        if link.is_none() {
            sleep(RETRY);
        }
        link
    }

    /// Zero force, then the end of the session.
    fn say_goodbye(&mut self, mut link: Link) {
        self.exchange.end();
        let now = self.scene.now();
        let _ = link.send(self.exchange.message(now));
        self.publish(true);
        // Closing with reports unread sends a reset, which may overtake the zero; so its answer is waited for a little.
        for _ in 0..GOODBYE_TURNS {
            for _ in 0..RECEIVED_MAX {
                let Ok(Some(text)) = link.receive() else { break };
                self.exchange.receive(self.scene.now(), &text);
            }
            if !self.exchange.is_waiting() {
                break;
            }
            sleep(Duration::from_nanos(BEAT.0));
        }
        link.close();
    }
}
