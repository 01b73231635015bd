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

pub use calibration::{CalibrationSessionError, calibration_from_session};
pub use conditions::Conditions;
pub use document::{ModelReference, Programme, ProgrammeError, ProgrammeTask};
pub use forecast::{ProgrammeForecast, TaskForecast, forecast_programme};
pub use progress::{
    FINISHED, ProgrammeEntry, ProgrammePosition, ProgrammeProgress, ProgressError, REFUSED,
};
pub use run::{ProgrammeEvent, ProgrammeResult, ProgrammeRunError, ProgrammeSetup, run_programme};
