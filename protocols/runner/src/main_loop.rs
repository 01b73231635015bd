//! The only loop: wait for time or a request, collect what the rig reports, let the engine
//! decide, act, publish.
#![expect(
    clippy::disallowed_methods,
    reason = "commands to a rig are sent from here and nowhere else"
)]

use super::active_run::{ActiveRun, RigAction};
use super::clock::{HostClock, Pacer, Throttle, TimeScale, Wake, host_times};
use super::handle::{RunnerHandle, send};
use super::panic_stop::RigRegistration;
use super::run_log::FaultLog;
use super::snapshot::{RigView, RunnerSnapshot};
use super::start::{RigContext, RunRequest, StartError, start};
use super::watch::HostWatch;
use arc_swap::ArcSwap;
use palpate_drivers::{Rig, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, Reading, RigCommand, RigDescription, SensorValues};
use palpate_model::units::Seconds;
use palpate_protocols::engine::{EngineInput, Operator};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Weak};
use std::thread::JoinHandle;
use std::time::Duration;

/// Grid of the watchdog: silence is judged this often in session time.
const TICK: Nanos = Nanos::from_millis(10);

/// Polling interval of a wired rig, which is the longest delay of an interlock.
const STRIDE_WIRED: Nanos = Nanos::from_millis(2);

/// Polling interval of a simulated rig between runs, when nothing can move: as fast as an eye follows numbers.
const STRIDE_AT_REST: Nanos = Nanos::from_millis(50);

/// A counter at rest may flicker by so much.
const DISPLACED_PULSES: u64 = 1;

/// How far time runs between looks at the requests, at full pace.
const STRIDE_MAX: Nanos = Nanos::from_millis(100);

/// Snapshots per second of wall time: 30.
const PUBLISH_EVERY: Duration = Duration::from_millis(33);

/// Requests that may wait. An operator cannot press faster than the loop turns.
const REQUESTS_MAX: usize = 64;

pub enum RunnerRequest {
    /// Start a run; the reply says whether it started.
    Run(Box<RunRequest>, SyncSender<Result<(), StartError>>),
    /// The operator's choice for the run in progress. A stop without a run stops the axis.
    Operator(Operator),
    Note(String),
    /// A stop by somebody who is not at the rig, with the note that says who. The note takes as long as a sample does; behind
    /// the stop it would be lost where the run ends at once.
    RemoteStop(String),
    /// Reconnect the rig after its link was lost. Nothing moves, and the axis must be homed again. Ignored during a run.
    Reconnect,
    Shutdown,
}

/// The runner's thread and the two ways to talk with it: requests in, snapshots out.
pub struct Runner {
    requests: SyncSender<RunnerRequest>,
    snapshot: Arc<ArcSwap<RunnerSnapshot>>,
    /// Held by the thread for as long as it lives.
    life: Weak<()>,
    thread: Option<JoinHandle<()>>,
}

impl Runner {
    /// Takes a rig and starts the runner's thread. `wake` is called after each snapshot.
    ///
    /// `first` is served before any time passes, so that a run given here starts at time zero of
    /// a simulated rig and is the same whenever it is repeated.
    pub fn start(
        rig: Box<dyn Rig>,
        scale: TimeScale,
        first: Option<RunnerRequest>,
        wake: impl Fn() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (requests, receiver) = sync_channel(REQUESTS_MAX);
        let mut main_loop = MainLoop::new(rig, scale, Arc::new(host_times));
        let snapshot = Arc::new(ArcSwap::from_pointee(main_loop.snapshot(0)));
        let shared = Arc::clone(&snapshot);
        let to_stop = requests.clone();
        let (registered, is_registered) = sync_channel(1);
        let alive = Arc::new(());
        let life = Arc::downgrade(&alive);
        let thread = std::thread::Builder::new().name("runner".into()).spawn(move || {
            let link = main_loop.rig.halt_handle();
            main_loop.registered = Some(RigRegistration::new(to_stop, link));
            let _ = registered.send(());
            main_loop.run(first, &receiver, &shared, &wake);
            drop(alive);
        })?;
        // A panic anywhere from here on stops this rig, however late the thread gets its first turn.
        let _ = is_registered.recv();
        Ok(Self { requests, snapshot, life, thread: Some(thread) })
    }

    /// Asks for something. Fails only when the runner has ended or is swamped.
    pub fn request(&self, request: RunnerRequest) -> Result<(), String> {
        send(&self.requests, request)
    }

    /// For a thread that watches, and may ask for a stop.
    pub fn handle(&self) -> RunnerHandle {
        let (requests, snapshot) = (self.requests.clone(), Arc::clone(&self.snapshot));
        RunnerHandle { requests, snapshot, life: self.life.clone() }
    }

    /// Passes on the operator's choice.
    pub fn send_choice(&self, choice: Operator) -> Result<(), String> {
        self.request(RunnerRequest::Operator(choice))
    }

    /// A sender of requests for another thread, such as a signal handler.
    pub fn requests(&self) -> SyncSender<RunnerRequest> {
        self.requests.clone()
    }

    pub fn is_alive(&self) -> bool {
        self.life.strong_count() > 0
    }

    #[cfg(test)]
    pub(super) fn thread_id(&self) -> Option<std::thread::ThreadId> {
        Some(self.thread.as_ref()?.thread().id())
    }

    /// The newest snapshot.
    pub fn snapshot(&self) -> Arc<RunnerSnapshot> {
        self.snapshot.load_full()
    }
}

impl Drop for Runner {
    fn drop(&mut self) {
        // The thread drains its queue, so this waits at most a moment; if it is gone there is no need.
        let _ = self.requests.send(RunnerRequest::Shutdown);
        let (closed, _) = sync_channel(1);
        self.requests = closed;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

pub(super) struct MainLoop {
    rig: Box<dyn Rig>,
    /// Reads the computer's clocks.
    clock: HostClock,
    description: Arc<RigDescription>,
    scale: TimeScale,
    now: Nanos,
    next_tick: Nanos,
    is_sample_seen: bool,
    behind: Duration,
    reading: Option<Reading>,
    is_homed: bool,
    link_error: Option<String>,
    sensors: SensorValues,
    pub(super) run: Option<ActiveRun>,
    refusal: Option<String>,
    faults: FaultLog,
    /// The rig that a panic stops; none outside a [`Runner`].
    registered: Option<RigRegistration>,
}

impl MainLoop {
    pub(super) fn new(rig: Box<dyn Rig>, scale: TimeScale, clock: HostClock) -> Self {
        Self {
            clock,
            description: Arc::new(rig.description().clone()),
            rig,
            scale,
            now: Nanos::ZERO,
            next_tick: TICK,
            is_sample_seen: false,
            behind: Duration::ZERO,
            reading: None,
            is_homed: false,
            link_error: None,
            sensors: SensorValues::default(),
            run: None,
            refusal: None,
            faults: FaultLog::default(),
            registered: None,
        }
    }

    pub(super) fn run(
        mut self,
        first: Option<RunnerRequest>,
        requests: &Receiver<RunnerRequest>,
        shared: &ArcSwap<RunnerSnapshot>,
        wake: &impl Fn(),
    ) {
        let mut publish = Throttle::new(PUBLISH_EVERY);
        let mut sequence = 0;
        if first.is_some_and(|request| self.serve(request)) {
            return;
        }
        let mut pacer = Pacer::new(self.pace(), self.now);
        loop {
            let was_running = self.is_running();
            let target = self.now + self.stride();
            let wake_up = pacer.wait(target, requests);
            if let Some(run) = self.run.as_mut().filter(|run| !run.is_over()) {
                run.record_lateness(pacer.lateness());
            }
            self.watch(pacer.behind());
            self.handle_pause(pacer.behind());
            let is_ending = match wake_up {
                Wake::Time => {
                    self.advance(target);
                    false
                }
                Wake::Request(request, at) => {
                    // At full pace a request is served between strides, without moving time.
                    self.advance(if self.pace() == TimeScale::Max { self.now } else { at });
                    self.serve(request)
                }
                Wake::Disconnected => true,
            };
            if is_ending {
                self.shut_down();
            }
            if self.is_running() != was_running {
                pacer = Pacer::new(self.pace(), self.now);
            }
            if publish.is_due() || is_ending || self.is_running() != was_running {
                sequence += 1;
                shared.store(Arc::new(self.snapshot(sequence)));
                wake();
            }
            if is_ending {
                return;
            }
        }
    }

    /// Looks at how the computer keeps up with the run in progress.
    fn watch(&mut self, lateness: Duration) {
        let Some(run) = self.run.as_mut().filter(|run| !run.is_over()) else {
            return;
        };
        let now = run.session_time(self.now);
        let rig = &mut self.rig;
        run.watch(now, lateness, &mut |action| act(rig.as_mut(), action));
    }

    /// Reports a pause of the computer to the run. The time of a simulated rig waits for the computer.
    fn handle_pause(&mut self, behind: Duration) {
        let late = behind.saturating_sub(std::mem::replace(&mut self.behind, behind));
        let late = Nanos::from_seconds(Seconds(late.as_secs_f64()));
        if late > TICK && !self.rig.is_virtual() {
            self.feed(EngineInput::HostLate { late });
        }
    }

    fn is_running(&self) -> bool {
        self.run.as_ref().is_some_and(|run| !run.is_over())
    }

    /// Time between runs passes as on the wall, at any pace.
    fn pace(&self) -> TimeScale {
        if self.is_running() { self.scale } else { TimeScale::Factor(1.0) }
    }

    fn stride(&self) -> Nanos {
        match self.pace() {
            TimeScale::Max => STRIDE_MAX,
            _ if !self.rig.is_virtual() => STRIDE_WIRED,
            _ if !self.is_running() => STRIDE_AT_REST,
            TimeScale::Factor(factor) => {
                Nanos(((TICK.0 as f64 * factor) as u64).clamp(1_000_000, STRIDE_MAX.0))
            }
        }
    }

    /// Lets time pass until `until`, feeding every event in order and a tick where none came.
    pub(super) fn advance(&mut self, until: Nanos) {
        while self.now < until {
            let limit = self.next_tick.min(until);
            while let Some(event) = self.rig.next_event(limit) {
                self.now = event.at;
                self.on_event(event.body);
                self.feed_sensors();
            }
            self.now = limit;
            if limit == self.next_tick {
                self.next_tick = limit + TICK;
                if !std::mem::take(&mut self.is_sample_seen) {
                    self.feed(EngineInput::Tick);
                }
            }
        }
    }

    fn feed_sensors(&mut self) {
        for value in self.rig.take_sensors() {
            if value.is_possible() {
                self.sensors.update(&value);
                self.feed(EngineInput::Sensor { value });
            }
        }
    }

    fn on_event(&mut self, body: RigEventBody) {
        match body {
            // A signal that is not a number must not reach a plot, a fit or a file.
            RigEventBody::Reading(reading) if !reading.volts.is_finite() => {
                let tick = reading.tick;
                self.feed(EngineInput::Fault(Fault::SignalInvalid { tick }));
            }
            RigEventBody::Reading(reading) => {
                self.is_sample_seen = true;
                // A clock that runs back is a controller that restarted, also between runs.
                if self.reading.is_some_and(|last| reading.tick <= last.tick) {
                    self.is_homed = false;
                }
                if !self.rig.is_virtual() && !self.is_running() && self.is_displaced(&reading) {
                    self.is_homed = false;
                }
                self.reading = Some(reading);
                self.feed(EngineInput::Reading(reading));
            }
            RigEventBody::Ack(ack) => self.feed(EngineInput::Ack(ack)),
            RigEventBody::Fault(fault) => {
                if !self.is_running() {
                    self.faults.log_fault(self.now, &fault);
                }
                if matches!(fault, Fault::LinkLost { .. } | Fault::ControllerReset) {
                    self.is_homed = false;
                }
                if let Fault::LinkLost { detail } = &fault {
                    self.link_error = Some(detail.clone());
                } else if matches!(fault, Fault::ControllerReset) && !self.rig.is_virtual() {
                    // A reset controller has lost its settings.
                    self.link_error = Some("the controller was reset".into());
                }
                self.feed(EngineInput::Fault(fault));
            }
        }
    }

    /// Whether the position of an axis at rest is no longer certain: its motor is off, so that a hand may push it, or its
    /// counter has changed.
    fn is_displaced(&self, reading: &Reading) -> bool {
        let has_jumped = self.reading.is_some_and(|last| {
            let is_moving = |one: &Reading| one.status.has(AxisStatus::MOVING);
            let way = reading.pulses.abs_diff(last.pulses);
            way > DISPLACED_PULSES && !is_moving(&last) && !is_moving(reading)
        });
        has_jumped || !reading.status.has(AxisStatus::MOTOR_ON)
    }

    /// One input to the run in progress, if there is one, and its commands to the rig.
    fn feed(&mut self, input: EngineInput) {
        // Also between runs, so that nothing piles up.
        let raw = self.rig.take_raw();
        let Some(run) = self.run.as_mut().filter(|run| !run.is_over()) else {
            return;
        };
        run.take_raw(raw);
        let now = run.session_time(self.now);
        let rig = &mut self.rig;
        run.feed(now, input, &mut |action| act(rig.as_mut(), action));
        if let Some(state) = run.engine() {
            self.is_homed = state.is_homed_for_next();
        }
    }

    fn obey(&mut self, choice: Operator) {
        if self.is_running() {
            self.feed(EngineInput::Operator { choice });
        } else if matches!(choice, Operator::Stop | Operator::Abort) {
            self.rig.send(RigCommand::Stop);
        } else if choice == Operator::Halt {
            self.rig.send(RigCommand::Halt);
            self.is_homed = false;
        }
    }

    fn serve(&mut self, request: RunnerRequest) -> bool {
        match request {
            RunnerRequest::Run(request, reply) => {
                let answer = self.start_run(&request);
                self.refusal = answer.as_ref().err().map(ToString::to_string);
                // The caller may have stopped waiting; the snapshot holds the same answer.
                let _ = reply.try_send(answer);
            }
            RunnerRequest::Operator(choice) => self.obey(choice),
            RunnerRequest::RemoteStop(text) => {
                self.feed(EngineInput::Note { text });
                self.obey(Operator::Stop);
            }
            RunnerRequest::Note(text) => self.feed(EngineInput::Note { text }),
            RunnerRequest::Reconnect if self.is_running() => {}
            RunnerRequest::Reconnect => {
                self.reading = None;
                self.is_homed = false;
                self.link_error = self.rig.reconnect().err().map(|err| err.to_string());
                self.description = Arc::new(self.rig.description().clone());
                let link = self.rig.halt_handle();
                self.registered = self.registered.take().map(|one| one.relinked(link));
                match &self.link_error {
                    Some(err) => tracing::warn!("not connected again: {err}"),
                    None => tracing::info!("connected again"),
                }
            }
            RunnerRequest::Shutdown => return true,
        }
        false
    }

    /// At full pace nothing is late, and a session must not depend on the computer.
    fn host_watch(&self) -> Option<HostWatch> {
        let is_wired = !self.rig.is_virtual();
        matches!(self.scale, TimeScale::Factor(_))
            .then(|| HostWatch::new(Arc::clone(&self.clock), is_wired))
    }

    pub(super) fn start_run(&mut self, request: &RunRequest) -> Result<(), StartError> {
        if self.is_running() {
            return Err(StartError::Refused("a run is in progress; stop it first".into()));
        }
        let context = RigContext {
            rig: &self.description,
            is_virtual: self.rig.is_virtual(),
            is_homed: self.is_homed,
            origin: self.now,
            watch: self.host_watch(),
        };
        self.run = Some(start(request, context)?);
        // What was exchanged before belongs to no run.
        drop(self.rig.take_raw());
        self.feed(EngineInput::Operator { choice: Operator::Start });
        Ok(())
    }

    /// Stops whatever moves, waits until it rests and closes the session.
    fn shut_down(&mut self) {
        if self.is_running() {
            self.feed(EngineInput::Operator { choice: Operator::Stop });
            // Braking has two seconds, the halt after it two more.
            let give_up = self.now + Nanos::from_millis(6_000);
            while self.is_running() && self.now < give_up {
                self.advance(self.now + TICK);
                let is_holding = self
                    .run
                    .as_ref()
                    .and_then(ActiveRun::engine)
                    .is_some_and(|state| state.holding().is_some());
                if is_holding {
                    self.feed(EngineInput::Operator { choice: Operator::Close });
                }
            }
        } else if self.reading.is_some_and(|reading| reading.status.has(AxisStatus::MOVING)) {
            self.rig.send(RigCommand::Stop);
        }
    }

    pub(super) fn snapshot(&self, sequence: u64) -> RunnerSnapshot {
        RunnerSnapshot {
            rig: RigView {
                description: Arc::clone(&self.description),
                reading: self.reading,
                is_homed: self.is_homed,
                link: self.rig.link().map(str::to_owned),
                link_error: self.link_error.clone(),
                sensors: self.sensors,
            },
            run: self.run.as_ref().and_then(ActiveRun::view),
            refusal: self.refusal.clone(),
            sequence,
        }
    }
}

fn act(rig: &mut dyn Rig, action: RigAction) {
    match action {
        RigAction::Command(command) => rig.send(command),
        RigAction::Hand(by_hand) => rig.apply_hand_action(by_hand),
    }
}
