//! Pictures off the screen against a reference of their own. Without a graphics adapter they are skipped.

mod colours;
mod meshes;
mod ray_caster;
mod shapes;

use palpate_test_support::skip::{HAS_RENDERER, TestNeed, skip};
use palpate_tissue_view::OffScreen;

/// An adapter; `None`, with the reason printed, where there is none.
fn off_screen() -> Option<OffScreen> {
    match OffScreen::new() {
        Ok(off_screen) => Some(off_screen),
        Err(err) => {
            skip(TestNeed::Command(HAS_RENDERER), &err.to_string());
            None
        }
    }
}
