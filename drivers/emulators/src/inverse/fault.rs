//! What can go wrong with the service and its device.

/// A report that is not true, or not a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InverseLie {
    /// A place whose x is `null`, as JSON libraries write what is no number.
    Null,
    /// A place whose x is the bare word `NaN`, which is not JSON.
    NotANumber,
    /// A place whose x is `1e999`.
    Infinite,
    /// A place some kilometres away.
    Huge,
    /// No place.
    Missing,
    /// A speed that is `null`.
    NoVelocity,
    /// A place 50 mm from the true one.
    Jump,
    /// Every report twice.
    Twice,
    /// The reports of another session.
    OtherSession,
    /// No device in the list.
    DeviceGone,
    /// No grip in the list.
    GripGone,
    /// The device loses its calibration.
    Uncalibrated,
    /// Half of a report.
    Cut,
}

impl InverseLie {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Null,
        Self::NotANumber,
        Self::Infinite,
        Self::Huge,
        Self::Missing,
        Self::NoVelocity,
        Self::Jump,
        Self::Twice,
        Self::OtherSession,
        Self::DeviceGone,
        Self::GripGone,
        Self::Uncalibrated,
        Self::Cut,
    ];
}

/// A fault of the service or of its device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InverseFault {
    /// The service closes all connections and takes no new one.
    Cut,
    /// The service takes messages and answers none.
    Stalled,
    /// The service lies.
    Lie(InverseLie),
    /// The device is not calibrated.
    Uncalibrated,
    /// The device has no power.
    Unpowered,
    /// The device is in use by another session.
    InUse,
    /// No device is connected.
    NoDevice,
    /// The service has version 3.1.
    Old,
    /// The service has version 4.0.
    New,
}
