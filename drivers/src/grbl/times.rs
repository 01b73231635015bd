//! Intervals of questions, and the longest waits for answers.

use palpate_model::Nanos;

/// Status is asked for so often at rest: "10 Hz is the maximum" (doc/markdown/interface.md advises 5 Hz).
pub const POLL: Nanos = Nanos::from_millis(100);
/// While a switch or the end of a motion is waited for. It costs the board 2 % of its time, and a switch is noticed so
/// late: 7 um at 0.3 mm/s.
pub const POLL_CLOSELY: Nanos = Nanos::from_millis(25);
/// A query that was not answered by then was lost, or overlooked as the documents allow.
pub const REPORT_MAX: Nanos = Nanos::from_millis(150);
/// Without a status for so long the board counts as gone.
pub const SILENCE_MAX: Nanos = Nanos::from_millis(1_500);
/// This thread looks every half a millisecond. When it did not for so long, it was not the board that was silent.
pub const PAUSE: Nanos = Nanos::from_millis(20);
/// A jog is acknowledged when it is planned, within milliseconds.
pub const OK_MAX: Nanos = Nanos::from_millis(400);
/// A jog that was still in the input buffer begins after a cancel, so that is written again and again until all rests.
pub const CANCEL_AGAIN: Nanos = Nanos::from_millis(40);
/// A reset is written again after so long without a welcome: a board takes some milliseconds to say it, and half a
/// second more where the axis was in motion (report.c, `report_alarm_message`).
pub const RESET_AGAIN: Nanos = Nanos::from_millis(100);
/// Without a welcome for so long after the first reset, what the axis does is not known.
pub const RESET_MAX: Nanos = Nanos::from_millis(2_000);
/// A stop is answered by then though the axis is still braking, because it takes longer: the engine waits for a second.
pub const STOP_MAX: Nanos = Nanos::from_millis(700);
/// Segments that are made ahead go on after a cancel: 4 to 5 of 10 ms (stepper.h, config.h).
pub const SEGMENTS: Nanos = Nanos::from_millis(45);
