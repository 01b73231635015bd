//! What can go wrong with the board.

/// An answer that is not true, or not an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HapiLie {
    /// An angle at no number.
    NotANumber,
    /// An infinite angle.
    Infinite,
    /// An angle of 1e30 degrees.
    Huge,
    /// An angle 40 degrees from the true one.
    Jump,
    /// The number of another device.
    OtherDevice,
    /// Half of an answer.
    Cut,
    /// Every answer twice.
    Twice,
    /// Other bytes in place of an answer.
    Noise,
}

impl HapiLie {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::NotANumber,
        Self::Infinite,
        Self::Huge,
        Self::Jump,
        Self::OtherDevice,
        Self::Cut,
        Self::Twice,
        Self::Noise,
    ];
}

/// A fault of the board or its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HapiFault {
    /// The cable is pulled.
    Cut,
    /// Answers do not arrive; packets do.
    Mute,
    /// The firmware stands still: it reads nothing, and its torque stays.
    Hung,
    /// The next packet is cut: so many of its last bytes are lost.
    CutPacket(u8),
    /// The board lies.
    Lie(HapiLie),
}
