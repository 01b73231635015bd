//! Devices that speak in lines of text: what came cut into lines, and question and answer while one is opened.

mod console;
mod decimal;
mod error;
mod lines;

pub use crate::cell::OpenedCell;
pub use console::TextConsole;
pub use decimal::FixedDecimal;
pub use error::DeviceError;
pub(crate) use error::describe_unknown_device;
pub use lines::{Lines, ReceivedLine};
