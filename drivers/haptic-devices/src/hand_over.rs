//! Between the scene's loop and the thread of a device: the newest pose there, the newest force back.
//!
//! Neither waits for the other: what is not taken is replaced. The scene's end is the same for every device.

use crate::gate::ForceStop;
use palpate_drivers::wire::HostClock;
use palpate_haptics::Period;
use palpate_haptics::scene::{DeviceSettings, Pose};
use palpate_model::Nanos;
use std::fmt;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, TryLockError};
use std::thread::JoinHandle;
use triple_buffer::{Input, Output, triple_buffer};

/// Time in which a pose must be new: a thread that does not run reports no fault of its own.
const POSE_AGE_MAX_S: f64 = 0.005;

/// A pose for the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensedPose {
    /// Rises with every report.
    pub number: u64,
    /// In the scene's millimetres; at no number while there is none.
    pub pose: Pose,
}

/// The pose of a device that is gone.
pub const NO_POSE: Pose = Pose { at: [f64::NAN; 3], turn: [0.0; 3] };

/// How the connection is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkReport {
    pub is_connected: bool,
    /// Why there is no force.
    pub stop: ForceStop,
    /// What was wrong with the newest report that could not be, and how many there were.
    pub fault: Option<&'static str>,
    pub faults: u64,
    /// Reports received.
    pub reports: u64,
    /// Times that the connection was lost.
    pub losses: u64,
}

/// A look at a device while the scene's loop has it.
#[derive(Clone, Debug, Default)]
pub struct DeviceMonitor(Arc<Mutex<LinkReport>>);

impl DeviceMonitor {
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

/// The scene's end of a device. Dropping it lets the thread end, and waits for that.
pub(crate) struct SceneEnd {
    pub settings: DeviceSettings,
    pub monitor: DeviceMonitor,
    sensed: Output<SensedPose>,
    orders: Input<Order>,
    clock: HostClock,
    number: u64,
    /// The newest report seen, and ticks since.
    seen: u64,
    ticks_without: u64,
    ticks_without_max: u64,
    is_ending: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The end of the device's thread.
pub(crate) struct ThreadEnd {
    poses: Input<SensedPose>,
    orders: Output<Order>,
    last_order: u64,
    monitor: DeviceMonitor,
    losses: u64,
    clock: HostClock,
    is_ending: Arc<AtomicBool>,
}

/// Both ends.
pub(crate) fn hand_over(
    settings: DeviceSettings,
    period: Period,
    clock: HostClock,
) -> (SceneEnd, ThreadEnd) {
    let (poses, sensed) = triple_buffer(&SensedPose { number: 0, pose: NO_POSE });
    let (orders, order_output) = triple_buffer(&Order::default());
    let monitor = DeviceMonitor::default();
    let is_ending = Arc::new(AtomicBool::new(false));
    let thread = ThreadEnd {
        poses,
        orders: order_output,
        last_order: 0,
        monitor: monitor.clone(),
        losses: 0,
        clock: Arc::clone(&clock),
        is_ending: Arc::clone(&is_ending),
    };
    let scene = SceneEnd {
        settings,
        monitor,
        sensed,
        orders,
        clock,
        number: 0,
        seen: 0,
        ticks_without: 0,
        ticks_without_max: (POSE_AGE_MAX_S / period.seconds().0).ceil().max(1.0) as u64,
        is_ending,
        thread: None,
    };
    (scene, thread)
}

impl SceneEnd {
    /// Starts the thread of the device.
    pub fn start(&mut self, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
        let thread = std::thread::Builder::new().name("haptic-device".into()).spawn(work)?;
        self.thread = Some(thread);
        Ok(())
    }

    /// The newest pose, `elapsed` ticks after the last look.
    pub fn sense(&mut self, elapsed: u64) -> Pose {
        let sensed = *self.sensed.read();
        if sensed.number == self.seen {
            self.ticks_without = self.ticks_without.saturating_add(elapsed);
        } else {
            self.seen = sensed.number;
            self.ticks_without = 0;
        }
        if self.ticks_without > self.ticks_without_max { NO_POSE } else { sensed.pose }
    }

    /// The scene's newest force in N.
    pub fn give(&mut self, force: [f64; 3]) {
        self.number += 1;
        self.orders.write(Order { number: self.number, at: (self.clock)(), force });
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }
}

impl fmt::Debug for SceneEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SceneEnd").field("number", &self.number).finish_non_exhaustive()
    }
}

impl Drop for SceneEnd {
    fn drop(&mut self) {
        self.is_ending.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A thread that failed has let its connection go.
            let _ = thread.join();
        }
    }
}

impl ThreadEnd {
    pub fn is_ending(&self) -> bool {
        self.is_ending.load(Ordering::Relaxed)
    }

    pub fn now(&self) -> Nanos {
        (self.clock)()
    }

    /// The scene's newest tick with its time and force, once.
    pub fn take_order(&mut self) -> Option<(Nanos, [f64; 3])> {
        if !self.orders.update() {
            return None;
        }
        let Order { number, at, force } = *self.orders.output_buffer();
        let is_new = number != self.last_order;
        self.last_order = number;
        is_new.then_some((at, force))
    }

    /// A pose for the scene.
    pub fn show_pose(&mut self, pose: SensedPose) {
        self.poses.write(pose);
    }

    /// Shows how the connection is, and to the scene that there is no pose while nothing answers.
    pub fn publish(&mut self, report: LinkReport) {
        if !report.is_connected || report.stop == ForceStop::NoReply {
            self.poses.write(SensedPose { number: report.reports, pose: NO_POSE });
        }
        let report = LinkReport { losses: self.losses, ..report };
        // A look by a thread of lower priority must not delay a zero; the next message shows the same. Without a connection there is
        // neither a force nor a next message.
        match self.monitor.0.try_lock() {
            Err(TryLockError::WouldBlock) if report.is_connected => {}
            Ok(mut shown) => *shown = report,
            Err(_) => *self.monitor.0.lock().unwrap_or_else(PoisonError::into_inner) = report,
        }
    }

    /// The connection is lost once more.
    pub fn count_loss(&mut self) {
        self.losses += 1;
    }
}
