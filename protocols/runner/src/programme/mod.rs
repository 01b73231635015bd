//! A programme: protocols one after the other, with repeats, specimens and rests between them, as a day in the
//! laboratory goes. Every run is a session of its own; a journal tells where to continue after a crash.

mod calibrating;
mod conditions;
mod document;
mod foreseen;
mod progress;
mod read;
mod run;
mod sound;
mod told;

pub use calibrating::{CalibratingError, calibration_of};
pub use conditions::Conditions;
pub use document::{Programme, ProgrammeError, Task, Validates};
pub use foreseen::{Foreseen, ForeseenTask, foresee};
pub use progress::{Entry, FINISHED, Place, Progress, ProgressError, REFUSED};
pub use run::{Done, Event, Laboratory, RunError, run};
