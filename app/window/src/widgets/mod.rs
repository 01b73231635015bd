//! Small controls used in more than one place.

mod buttons;
mod choice_box;
mod choice_table;
mod fields;
mod glyph;
mod loop_times;
pub mod places;
mod table;
mod task_bar;
mod text;

pub use buttons::*;
pub use choice_box::choice_box_ui;
pub use choice_table::*;
pub use fields::*;
pub use glyph::*;
pub use loop_times::loop_times_ui;
pub use places::{NamedControl, places};
pub use table::{Column, Emphasis, TableRow, table_ui, width_of};
pub use task_bar::*;
pub use text::*;
