//! The device: a thread with the port, and the end of it in the scene's loop.

use super::exchange::{BEAT, Exchange, HapiFault, LineState};
use super::message::{BoardSetup, write_first, write_zero};
use crate::figures::{DeviceFigures, RoundTrip, UseError};
use crate::fit::{DeviceAxis, WorkspaceFit};
use crate::gate::ForceLimits;
use crate::hand_over::{ThreadEnd, hand_over};
use crate::linked::LinkedDevice;
use palpate_drivers::priority::request_real_time;
use palpate_drivers::wire::{DeviceAddress, HostClock, Link, WireError};
use palpate_haptics::Period;
use palpate_haptics::rig::Pantograph;
use palpate_model::Nanos;
use std::io;
use std::thread::sleep;
use std::time::Duration;
use thiserror::Error;

/// Packets whose round trip is measured at the start: 0.2 s of no force.
const PINGS: usize = 200;
/// Longest of them, far longer than later: there is no force.
const PING_MAX: Nanos = Nanos::from_millis(1_000);
/// Attempts to set the board up, and the time of each: together longer than the second for which it waits for the rest of a packet.
const ATTEMPTS: u32 = 3;
const ATTEMPT: Nanos = Nanos::from_millis(700);
/// How far the arm may be from home when the answer to its set-up is there, in degrees: it takes 20 ms, and a hand is on it.
const HOME_TOLERANCE_DEGREES: f64 = 3.0;
/// Waits for bytes. A fault is seen at most this late.
const REST: Duration = Duration::from_micros(200);
/// Turns in which the answer to the last zero is waited for.
const GOODBYE_TURNS: u32 = 100;
/// From one attempt to open the port again to the next.
const RETRY: Duration = Duration::from_millis(200);

/// Which board, and how its plane lies in the scene.
#[derive(Clone, Debug)]
pub struct HapiOptions {
    pub address: DeviceAddress,
    pub linkage: Pantograph,
    pub setup: BoardSetup,
    pub fit: WorkspaceFit,
    pub limits: ForceLimits,
    pub figures: DeviceFigures,
    /// Middle of the tissue's surface in the scene, in mm.
    pub middle: [f64; 3],
    /// From tick to tick of the scene.
    pub period: Period,
}

impl HapiOptions {
    /// A 2DIY of plastic whose point (19, 90) mm, before the middle of its motors, is in the middle of the tissue's surface.
    ///
    /// Its y axis, away from the motors, goes into the tissue. Its x axis counts from motor 1 to motor 2, and the scene's x against
    /// it, as in Haply's examples, where the motors are at the top of the picture and the y axis points down. There is no third
    /// axis: along the scene's y the stylus stays in the middle, and a force along it is not felt.
    #[must_use]
    pub fn new(address: DeviceAddress, middle: [f64; 3], period: Period) -> Self {
        Self {
            address,
            linkage: Pantograph::TWO_DIY,
            setup: BoardSetup::default(),
            fit: WorkspaceFit {
                axes: [DeviceAxis::MinusX, DeviceAxis::MinusZ, DeviceAxis::MinusY],
                scale: 1.0,
                centre_mm: [-19.0, 0.0, -90.0],
            },
            // The board takes 0.4 ms to pass over the padding before a zero; so much earlier an answer is late.
            limits: ForceLimits { reply_silence: Nanos(2_000_000), ..ForceLimits::default() },
            figures: DeviceFigures::two_diy(),
            middle,
            period,
        }
    }
}

/// Why a board cannot be used.
#[derive(Debug, Error)]
pub enum HapiError {
    #[error(transparent)]
    Wire(#[from] WireError),
    #[error("the port {port} is lost while the board is set up ({source}); check the cable")]
    Lost { port: String, source: io::Error },
    #[error(
        "no hAPI board answers at {0}; check that it is the board's native USB port, and that Haply's firmware is on the board"
    )]
    Silent(String),
    #[error(
        "the board at {port} does not take the home position as its set-up says (motor 1 at {one:.1}, motor 2 at {two:.1} degrees); keep the arm still in its home position, and try again"
    )]
    NotHome { port: String, one: f64, two: f64 },
    #[error("the board at {port} fails while its delay is measured ({fault}); connect it again")]
    Faulty { port: String, fault: HapiFault },
    #[error(
        "the board at {port} takes {:.1} ms to answer, too long to feel with; connect it without a hub, and close other programs",
        1e3 * .median.seconds().0
    )]
    Slow { port: String, median: Nanos },
    #[error("the thread of the haptic device cannot be started ({0}); close other programs")]
    Thread(io::Error),
    #[error(transparent)]
    Use(#[from] UseError),
}

/// Sets the board up, which takes the arm's place for its home; measures the delay with zero force, and starts the thread.
pub fn open_hapi(options: &HapiOptions, clock: HostClock) -> Result<LinkedDevice, HapiError> {
    let (fit, settings, limits) =
        options.figures.in_scene(&options.fit, &options.limits, options.period)?;
    let port = options.address.to_string();
    let mut opened = Opened { link: Port(options.address.open()?), clock, port };
    let fresh = || {
        let board = (options.linkage, options.setup);
        Exchange::new(board, fit, options.middle, limits)
    };
    let mut exchange = opened.set_up(&options.setup, fresh)?;
    let round_trip = opened.measure(&mut exchange, &limits)?;
    let Opened { link, clock, .. } = opened;
    let (mut scene, thread) = hand_over(settings, options.period, clock);
    let board = Board { address: options.address.clone(), exchange, scene: thread };
    scene.start(move || board.run(link)).map_err(HapiError::Thread)?;
    Ok(LinkedDevice::new(scene, &options.figures, round_trip, options.period))
}

/// An open port. Whatever ends its use, a panic included, the last packet is a zero.
struct Port(Box<dyn Link>);

impl Drop for Port {
    fn drop(&mut self) {
        let mut packet = Vec::new();
        write_zero(&mut packet);
        let _ = self.0.write(&packet);
    }
}

/// A port before play.
struct Opened {
    link: Port,
    clock: HostClock,
    port: String,
}

impl Opened {
    fn lost(&self, source: io::Error) -> HapiError {
        HapiError::Lost { port: self.port.clone(), source }
    }

    /// Sends the set-up until the board answers with the angles of the home position.
    fn set_up(
        &mut self,
        setup: &BoardSetup,
        fresh: impl Fn() -> Exchange,
    ) -> Result<Exchange, HapiError> {
        for _ in 0..ATTEMPTS {
            let mut packet = Vec::new();
            write_first(&mut packet, setup);
            self.link.0.write(&packet).map_err(|err| self.lost(err))?;
            let mut exchange = fresh();
            let begin = (self.clock)();
            exchange.begin(begin);
            while (self.clock)().since(begin) < ATTEMPT {
                turn(&mut *self.link.0, &self.clock, &mut exchange)
                    .map_err(|err| self.lost(err))?;
                let Some(found) = exchange.degrees() else { continue };
                let is_home = (0..2).all(|motor| {
                    (found[motor] - setup.home_degrees[motor]).abs() <= HOME_TOLERANCE_DEGREES
                });
                let [one, two] = found;
                let not_home = HapiError::NotHome { port: self.port.clone(), one, two };
                return if is_home { Ok(exchange) } else { Err(not_home) };
            }
        }
        Err(HapiError::Silent(self.port.clone()))
    }

    /// Round trips of packets with zero force, one each millisecond as later.
    fn measure(
        &mut self,
        exchange: &mut Exchange,
        limits: &ForceLimits,
    ) -> Result<RoundTrip, HapiError> {
        let mut times = Vec::with_capacity(PINGS);
        let (_, faults) = exchange.faults();
        exchange.set_reply_silence(PING_MAX);
        while times.len() < PINGS {
            let time =
                turn(&mut *self.link.0, &self.clock, exchange).map_err(|err| self.lost(err))?;
            times.extend(time);
            match exchange.faults() {
                (Some(fault), count) if count > faults => {
                    return Err(HapiError::Faulty { port: self.port.clone(), fault });
                }
                _ if exchange.line() != LineState::Talking => {
                    return Err(HapiError::Silent(self.port.clone()));
                }
                _ => {}
            }
        }
        exchange.set_reply_silence(limits.reply_silence);
        let found = RoundTrip::of(times);
        if found.median > limits.reply_silence {
            return Err(HapiError::Slow { port: self.port.clone(), median: found.median });
        }
        Ok(found)
    }
}

/// Bytes in, and a packet out if one is due: the round trip that an answer ends.
fn turn(
    link: &mut dyn Link,
    clock: &HostClock,
    exchange: &mut Exchange,
) -> io::Result<Option<Nanos>> {
    let mut buffer = [0_u8; 64];
    let count = link.read(&mut buffer, REST)?;
    let (now, since) = (clock(), exchange.waiting_since());
    let answer = exchange.receive(now, &buffer[..count]);
    if exchange.is_due(now) {
        link.write(exchange.message(now))?;
    }
    Ok(answer.and(since).map(|since| now.since(since)))
}

/// What the thread has.
struct Board {
    address: DeviceAddress,
    exchange: Exchange,
    scene: ThreadEnd,
}

impl Board {
    /// Runs until the device is dropped; a lost port is opened again.
    fn run(mut self, first: Port) {
        // Without real-time priority it runs as an ordinary thread; the watchdog counts time, not turns.
        let _ = request_real_time();
        let mut link = Some(first);
        while !self.scene.is_ending() {
            match link.take() {
                Some(mut open) => match self.talk(&mut *open.0) {
                    Ok(()) => link = Some(open),
                    Err(_) => self.lose_link(),
                },
                None => link = self.reconnect(),
            }
        }
        // The board ends no torque by itself: a lost port is tried once more.
        if let Some(open) = link.or_else(|| self.reconnect()) {
            self.say_goodbye(open);
        }
    }

    /// Exchanges packets until the device is dropped; an error is a lost port.
    fn talk(&mut self, link: &mut dyn Link) -> io::Result<()> {
        let mut buffer = [0_u8; 64];
        while !self.scene.is_ending() {
            let count = link.read(&mut buffer, REST)?;
            let sensed = self.exchange.receive(self.scene.now(), &buffer[..count]);
            if let Some(sensed) = sensed {
                self.scene.show_pose(sensed);
            }
            if let Some((at, force)) = self.scene.take_order() {
                self.exchange.set_order(at, force);
            }
            let now = self.scene.now();
            if self.exchange.is_due(now) {
                link.write(self.exchange.message(now))?;
                self.publish(true);
            }
            if self.exchange.is_hopeless(now) {
                return Err(io::ErrorKind::TimedOut.into());
            }
        }
        Ok(())
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

    fn reconnect(&mut self) -> Option<Port> {
        let Ok(link) = self.address.open() else {
            // Not parked: each tick of the scene would wake it.
            sleep(RETRY);
            return None;
        };
        self.exchange.begin(self.scene.now());
        Some(Port(link))
    }

    /// Zero torque until its answer is there.
    fn say_goodbye(&mut self, mut port: Port) {
        let link = &mut port.0;
        self.exchange.end();
        let mut is_sent = false;
        let mut buffer = [0_u8; 64];
        for _ in 0..GOODBYE_TURNS {
            let now = self.scene.now();
            if !is_sent || self.exchange.is_due(now) {
                is_sent = true;
                if link.write(self.exchange.message(now)).is_err() {
                    return;
                }
            }
            let Ok(count) = link.read(&mut buffer, Duration::from_nanos(BEAT.0)) else {
                return;
            };
            self.exchange.receive(self.scene.now(), &buffer[..count]);
            if self.exchange.line() == LineState::Talking && !self.exchange.is_waiting() {
                break;
            }
        }
        self.publish(true);
    }
}
