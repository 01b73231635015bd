//! The trait every haptic device implements, simulated or real: where its stylus is, and a force on the hand.

use crate::scene::{DeviceSettings, HandPose, Pose};
use std::fmt::Debug;

/// A haptic device with a stylus that is sensed in six axes and pushed along three.
///
/// A scene's loop calls it once a tick: first [`sense`](Self::sense), then [`give`](Self::give). Neither may wait, lock or
/// allocate; a device on a wire has a thread of its own and hands over its latest values.
pub trait HapticDevice: Debug + Send {
    /// The device's numbers, for which a scene is made.
    fn settings(&self) -> &DeviceSettings;

    /// Where its stylus is, `elapsed` ticks after the last look. That of a device that is gone is at no number, and the scene lets
    /// its force go.
    fn sense(&mut self, elapsed: u64) -> Pose;

    /// Holds a force in N on the hand until the next.
    fn give(&mut self, force: [f64; 3]);

    /// The hand that led a simulated device to where it was sensed last: a recording of hands computes the device again, too. A
    /// real device has none, and its places are recorded.
    fn hand(&self) -> Option<HandPose> {
        None
    }
}
