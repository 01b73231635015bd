//! Small controls used in more than one place.

pub mod fact_row;
pub mod quantity_input;
pub mod reason_button;
pub mod state_badge;
pub mod step_mark;
pub mod table;
pub mod task_bar;
pub mod uncertain;
