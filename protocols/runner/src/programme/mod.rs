//! A programme: protocols one after the other, with repeats, specimens and rests between them, as a day in the
//! laboratory goes. Every run is a session of its own; a journal tells where to continue after a crash.

mod calibration;
mod conditions;
mod consistency;
mod document;
mod forecast;
mod labels;
mod progress;
mod read;
mod run;

pub use calibration::{CalibrationSessionError, calibration_of};
pub use conditions::Conditions;
pub use document::{ModelReference, Programme, ProgrammeError, Task};
pub use forecast::{Foreseen, TaskForecast, foresee};
pub use progress::{Entry, FINISHED, Place, Progress, ProgressError, REFUSED};
pub use run::{Done, Event, Laboratory, RunError, run};
