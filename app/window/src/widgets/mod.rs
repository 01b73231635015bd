//! Small controls used in more than one place.

pub mod choice;
pub mod choice_box;
pub mod choice_table;
pub mod fact_row;
pub mod glyph;
pub mod loop_times;
pub mod model_choice;
pub mod places;
pub mod quantity_input;
pub mod reason_button;
pub mod remark;
pub mod state_badge;
pub mod steady;
pub mod step_mark;
pub mod table;
pub mod task_bar;
pub mod text_row;
pub mod tick_box;
