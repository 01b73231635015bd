//! Serves an emulated device on a pseudo-terminal or a TCP port, in real time, on one thread.
//!
//! Only this module reads a clock: it is the other end of the wire, and nothing in palpate decides by it.

use super::EmulatedDevice;
use super::faults::{FaultEvent, FaultKind, FaultPlan, ScheduledFault};
use super::orders::EmulatorOrder;
use super::pty::Pty;
use super::wire::LineDirection;
use palpate_model::Nanos;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::AsFd;
use rustix::io::Errno;
use rustix::net::sockopt::set_socket_linger;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};
use thiserror::Error;

/// Longest sleep: the device advances at least this often, about once a sample.
const SLEEP_MAX: Nanos = Nanos(1_000_000);
/// Time for a client to read the last bytes before a pseudo-terminal is closed: closing discards what was not read.
const FLUSH_MAX: Nanos = Nanos(500_000_000);

/// Where clients find the device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EmulatorAddress {
    /// A pseudo-terminal, with a link to it by this name.
    Pty(Option<PathBuf>),
    /// One pseudo-terminal for each channel of the device.
    Ptys(Vec<Option<PathBuf>>),
    /// A TCP port; port 0 is any free one.
    Tcp(SocketAddr),
    /// A TCP port for the first channel, and one pseudo-terminal for each of the others.
    TcpAndPtys(SocketAddr, Vec<Option<PathBuf>>),
}

#[derive(Clone, Debug)]
pub struct ServeOptions {
    pub address: EmulatorAddress,
    /// Bits a second of the line, 10 a byte; no delay if `None`.
    pub baud: Option<u32>,
    /// Latency timer of the USB converter on the host's side.
    pub latency: Nanos,
    pub faults: Vec<ScheduledFault>,
    /// Decides which bytes faults corrupt.
    pub seed: u64,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ServeEvent {
    /// Clients can connect here: a path or an address, or one for each channel with commas between.
    Ready(String),
    Fault(FaultEvent),
    Done(EmulatorOrder),
    /// Why an order was not understood.
    Refused(String),
}

#[derive(Debug, Error)]
pub enum ServeError {
    #[error("the emulator cannot open {place} ({detail}); choose another path or port")]
    Open { place: String, detail: String },
    #[error("the emulator cannot watch its connections ({0}); start it again")]
    Watch(String),
}

struct Line {
    stream: Option<TcpStream>,
    to_device: LineDirection,
    from_device: LineDirection,
    unsent: Vec<u8>,
}

impl Line {
    fn new(options: &ServeOptions) -> Self {
        Self {
            stream: None,
            // The converter's timer delays only bytes to the host.
            to_device: LineDirection::new(options.baud, Nanos::ZERO),
            from_device: LineDirection::new(options.baud, options.latency),
            unsent: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.stream = None;
        self.to_device.clear();
        self.from_device.clear();
        self.unsent.clear();
    }
}

/// What is plugged in; empty while a fault holds the plug out.
#[derive(Default)]
struct Plug {
    listener: Option<TcpListener>,
    /// By channel. A channel without one gets clients of the listener.
    ptys: Vec<Option<Pty>>,
}

impl Plug {
    fn pty(&mut self, channel: usize) -> Option<&mut Pty> {
        self.ptys.get_mut(channel)?.as_mut()
    }
}

/// Serves a device until `stop` is set. `orders` are lines for [`EmulatorOrder::parse`].
pub fn serve(
    device: &mut dyn EmulatedDevice,
    options: &ServeOptions,
    orders: &Receiver<String>,
    stop: &AtomicBool,
    notify: &mut dyn FnMut(ServeEvent),
) -> Result<(), ServeError> {
    let mut server = Server::open(device, options)?;
    notify(ServeEvent::Ready(server.address.clone()));
    while !stop.load(Ordering::Relaxed) {
        for order in orders.try_iter().filter(|line| !line.trim().is_empty()) {
            let now = server.now();
            match EmulatorOrder::parse(order.trim(), now) {
                Ok(EmulatorOrder::Fault(fault)) => server.faults.add(fault),
                Ok(order @ EmulatorOrder::Hand(action)) => {
                    server.device.apply_hand_action(now, action);
                    notify(ServeEvent::Done(order));
                }
                Err(err) => notify(ServeEvent::Refused(err.to_string())),
            }
        }
        for event in server.faults.advance(server.now()) {
            notify(ServeEvent::Fault(event));
            server.apply_fault_event(event)?;
        }
        server.wait()?;
        server.accept();
        server.exchange();
    }
    server.flush_output();
    Ok(())
}

struct Server<'a> {
    device: &'a mut dyn EmulatedDevice,
    options: &'a ServeOptions,
    start: Instant,
    plug: Plug,
    /// Where clients reach it; a port that the system chose stays the same.
    address: String,
    bound: Option<SocketAddr>,
    lines: Vec<Line>,
    faults: FaultPlan,
}

impl<'a> Server<'a> {
    #[expect(
        clippy::disallowed_methods,
        reason = "an emulator replaces a device, and a device has a clock of its own"
    )]
    fn open(
        device: &'a mut dyn EmulatedDevice,
        options: &'a ServeOptions,
    ) -> Result<Self, ServeError> {
        let lines = (0..device.channels()).map(|_| Line::new(options)).collect();
        let mut server = Self {
            faults: FaultPlan::new(options.faults.clone(), options.seed),
            device,
            options,
            start: Instant::now(),
            plug: Plug::default(),
            address: String::new(),
            bound: None,
            lines,
        };
        server.plug_in()?;
        Ok(server)
    }

    fn now(&self) -> Nanos {
        Nanos(self.start.elapsed().as_nanos() as u64)
    }

    fn plug_in(&mut self) -> Result<(), ServeError> {
        match &self.options.address {
            EmulatorAddress::Pty(link) => self.plug_in_ptys(0, std::slice::from_ref(link))?,
            EmulatorAddress::Ptys(links) => self.plug_in_ptys(0, links)?,
            EmulatorAddress::Tcp(address) => self.plug_in_tcp(*address)?,
            EmulatorAddress::TcpAndPtys(address, links) => {
                self.plug_in_ptys(1, links)?;
                let pty_addresses = std::mem::take(&mut self.address);
                self.plug_in_tcp(*address)?;
                self.address = format!("{}, {pty_addresses}", self.address);
            }
        }
        Ok(())
    }

    fn plug_in_tcp(&mut self, address: SocketAddr) -> Result<(), ServeError> {
        let address = self.bound.unwrap_or(address);
        let open = || -> io::Result<(TcpListener, SocketAddr)> {
            let listener = TcpListener::bind(address)?;
            listener.set_nonblocking(true)?;
            let bound = listener.local_addr()?;
            Ok((listener, bound))
        };
        let (listener, bound) = open().map_err(|err| ServeError::Open {
            place: address.to_string(),
            detail: err.to_string(),
        })?;
        self.bound = Some(bound);
        self.address = bound.to_string();
        self.plug.listener = Some(listener);
        Ok(())
    }

    fn plug_in_ptys(&mut self, first: usize, links: &[Option<PathBuf>]) -> Result<(), ServeError> {
        let mut ptys: Vec<Option<Pty>> = (0..first).map(|_| None).collect();
        let mut addresses = Vec::new();
        for link in links.iter().take(self.lines.len() - first) {
            let pty = Pty::open(link.as_deref()).map_err(|err| ServeError::Open {
                place: link.as_deref().map_or_else(
                    || "a pseudo-terminal".to_owned(),
                    |link| link.display().to_string(),
                ),
                detail: err.to_string(),
            })?;
            let path = link.as_ref().unwrap_or(&pty.path);
            addresses.push(path.display().to_string());
            ptys.push(Some(pty));
        }
        self.address = addresses.join(", ");
        self.plug.ptys = ptys;
        Ok(())
    }

    fn apply_fault_event(&mut self, event: FaultEvent) -> Result<(), ServeError> {
        let now = self.now();
        match event.kind {
            FaultKind::Device(fault) => self.device.apply_fault(now, fault, event.is_on),
            FaultKind::Line(_) => {}
            FaultKind::Disconnect if event.is_on => {
                self.plug = Plug::default();
                for channel in 0..self.lines.len() {
                    if self.lines[channel].stream.is_some() {
                        self.device.disconnect(now, channel);
                    }
                    self.lines[channel].clear();
                }
            }
            FaultKind::Disconnect => self.plug_in()?,
        }
        Ok(())
    }

    /// Sleeps until bytes arrive or are due, or the device has to advance.
    fn wait(&mut self) -> Result<(), ServeError> {
        let now = self.now();
        let due = self.lines.iter().flat_map(|line| {
            [line.to_device.next_at(), line.from_device.next_at()].into_iter().flatten()
        });
        let until = due.min().unwrap_or(now + SLEEP_MAX).min(now + SLEEP_MAX);
        let sleep = Duration::from_nanos(until.since(now).0);
        let timeout = Timespec::try_from(sleep).unwrap_or_default();
        let mut watched: Vec<PollFd<'_>> = Vec::new();
        if let Some(listener) = &self.plug.listener {
            watched.push(PollFd::from_borrowed_fd(listener.as_fd(), PollFlags::IN));
        }
        for (pty, line) in self.plug.ptys.iter().zip(&self.lines) {
            // Without a client a pseudo-terminal reports a hang-up on every poll.
            if let Some(pty) = pty.as_ref().filter(|pty| pty.has_client) {
                watched.push(PollFd::from_borrowed_fd(pty.as_fd(), flags(line)));
            }
        }
        for line in &self.lines {
            if let Some(stream) = &line.stream {
                watched.push(PollFd::from_borrowed_fd(stream.as_fd(), flags(line)));
            }
        }
        match poll(&mut watched, Some(&timeout)) {
            Ok(_) | Err(Errno::INTR) => Ok(()),
            Err(err) => Err(ServeError::Watch(err.to_string())),
        }
    }

    /// New clients get the first free channel; one too many is reset (DMC-1400 command reference, `IH`).
    fn accept(&mut self) {
        let Some(listener) = &self.plug.listener else {
            return;
        };
        while let Ok((stream, _)) = listener.accept() {
            let now = Nanos(self.start.elapsed().as_nanos() as u64);
            let is_ready = stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok();
            let has_pty = |channel| matches!(self.plug.ptys.get(channel), Some(Some(_)));
            let free = (0..self.lines.len())
                .find(|channel| self.lines[*channel].stream.is_none() && !has_pty(*channel));
            match free.filter(|_| is_ready) {
                Some(channel) => {
                    self.lines[channel].clear();
                    self.lines[channel].stream = Some(stream);
                    self.device.connect(now, channel);
                }
                // Closing with this set sends a reset; without it the client would see an orderly end.
                None => drop(set_socket_linger(&stream, Some(Duration::ZERO))),
            }
        }
    }

    /// Passes bytes in, advances the device, passes bytes out.
    fn exchange(&mut self) {
        for channel in 0..self.lines.len() {
            let (bytes, is_gone) = self.read(channel);
            let now = self.now();
            let bytes = self.faults.corrupt(bytes, true);
            let line = &mut self.lines[channel];
            line.to_device.push(now, &bytes, Nanos::ZERO);
            let arrived = if is_gone {
                // A client that has hung up had sent all of it before.
                line.to_device.take(Nanos(u64::MAX))
            } else {
                line.to_device.take(now)
            };
            if !arrived.is_empty() {
                self.device.receive(now, channel, &arrived);
            }
            if is_gone {
                self.lines[channel].clear();
                self.device.disconnect(now, channel);
            }
        }
        let now = self.now();
        self.device.advance(now);
        for channel in 0..self.lines.len() {
            let bytes = self.device.transmit(channel);
            if !bytes.is_empty() {
                let bytes = self.faults.corrupt(bytes, false);
                let lateness = self.faults.lateness();
                self.lines[channel].from_device.push(now, &bytes, lateness);
            }
            self.write(channel);
            if self.device.take_hang_up(channel) {
                self.lines[channel].clear();
            }
        }
    }

    /// Bytes from a client, and whether it has hung up.
    fn read(&mut self, channel: usize) -> (Vec<u8>, bool) {
        if let Some(pty) = self.plug.pty(channel) {
            return (pty.read(), false);
        }
        let mut all = Vec::new();
        let Some(stream) = &mut self.lines[channel].stream else {
            return (all, false);
        };
        let mut part = [0_u8; 4096];
        loop {
            match stream.read(&mut part) {
                Ok(0) => return (all, true),
                Ok(count) => {
                    all.extend_from_slice(&part[..count]);
                    if count < part.len() {
                        return (all, false);
                    }
                }
                Err(err) if err.kind() == io::ErrorKind::Interrupted => {}
                Err(err) => return (all, err.kind() != io::ErrorKind::WouldBlock),
            }
        }
    }

    /// Sends what is due; bytes that the client has no room for wait.
    fn write(&mut self, channel: usize) {
        let now = self.now();
        let line = &mut self.lines[channel];
        if line.unsent.is_empty() {
            line.unsent = line.from_device.take(now);
        }
        if line.unsent.is_empty() {
            return;
        }
        let sent = match (self.plug.pty(channel), &mut line.stream) {
            (Some(pty), _) => pty.write(&line.unsent),
            (None, Some(stream)) => stream.write(&line.unsent).unwrap_or(0),
            // No client.
            (None, None) => line.unsent.len(),
        };
        line.unsent.drain(..sent);
    }

    /// Sends the remaining bytes and gives the client time to read them.
    fn flush_output(&mut self) {
        let until = self.now() + FLUSH_MAX;
        while self.now() < until {
            for channel in 0..self.lines.len() {
                self.write(channel);
            }
            let is_sent = self
                .lines
                .iter()
                .all(|line| line.unsent.is_empty() && line.from_device.next_at().is_none());
            let is_read = self.plug.ptys.iter_mut().flatten().all(|pty| {
                pty.read();
                !pty.has_client
            });
            if is_sent && is_read {
                return;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

fn flags(line: &Line) -> PollFlags {
    if line.unsent.is_empty() { PollFlags::IN } else { PollFlags::IN | PollFlags::OUT }
}
