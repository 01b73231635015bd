//! Fields and buttons by name, so that the palette leads to each without a pointer or a row of Tabs.

use eframe::egui::{Context, Id, Response};

/// Those that were drawn in a pass.
#[derive(Clone, Debug, Default)]
struct Places {
    pass: u64,
    drawn: Vec<(String, Id)>,
}

/// Something that the palette can lead to.
pub trait NamedControl {
    /// Says under which name.
    fn named(self, name: &str) -> Self;
}

impl NamedControl for Response {
    fn named(self, name: &str) -> Self {
        // Who comes here by key finds it in sight.
        if self.gained_focus() {
            self.scroll_to_me(None);
        }
        if self.enabled() {
            let pass = self.ctx.cumulative_pass_nr();
            self.ctx.data_mut(|data| {
                let places = data.get_temp_mut_or_default::<Places>(Id::unique("places"));
                if places.pass != pass {
                    places.drawn.clear();
                    places.pass = pass;
                }
                places.drawn.push((name.to_owned(), self.id));
            });
        }
        self
    }
}

/// Those drawn last, in the order of the screen.
#[must_use]
pub fn places(ctx: &Context) -> Vec<(String, Id)> {
    ctx.data(|data| data.get_temp::<Places>(Id::unique("places")))
        .map_or_else(Vec::new, |places| places.drawn)
}
