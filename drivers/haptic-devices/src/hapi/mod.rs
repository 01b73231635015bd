//! Haply's 2DIY: a planar device of two motors on a hAPI board, over a serial port.
//!
//! Sources, of which facts and figures are taken and no line: Haply's firmware (HaplyHaptics/Haply-Arduino-Firmware-Versions on
//! GitHub, M0 V0.3 and M3 V1.5), its interface in C++ (HaplyHaptics/Haply-API-cpp) and in Python (`HaplyHAPI` 1.0.1 on PyPI). No
//! board was touched.
//!
//! What the firmware does not do decides how palpate talks to it:
//! * It **never ends a torque by itself**: not in silence, not at a reset, not when the port is closed. So zero is sent, and sent
//!   again.
//! * A packet that is cut is waited for, for a second, with the torque of before. Bytes that complete it without harm come first
//!   ([`write_zero`]).
//! * The set-up takes the arm's place for its home. So it is sent only when a person opens the device, or to end a torque.
//! * No packet has a checksum or a number. Two motors' angles are believed only if the linkage and the last place allow them.

mod device;
mod exchange;
mod message;

pub use device::{HapiError, HapiOptions, open_hapi};
pub use exchange::{Exchange, HapiFault, LineState};
pub use message::{BoardSetup, TORQUE_MAX_N_M, write_setup, write_zero};
