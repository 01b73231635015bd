//! Damping that a body needs over depth, what asks for it, and what the device has.

use super::figure::{PlotLook, legend_ui, patch_ui, plot_ui};
use eframe::egui::{Ui, vec2};
use palpate_analysis::margin::MarginPoint;
use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotBand, PlotLevel, PlotSeries, PlotStretch};
use palpate_haptics::margin::DepthBand;

/// The device's damping is in the picture up to so many times the most that is needed; more would flatten the parts.
const IN_SIGHT: f64 = 3.0;

/// The cut is so many times further than the end of the spike.
const CUT_PAST: f64 = 2.0;

pub struct MarginPicture<'a> {
    pub curve: &'a [MarginPoint],
    /// Damping that the device has, in N s/m.
    pub has: f64,
    /// Depths around which small slow cycles of the body return energy.
    pub cycles: &'a [DepthBand],
    /// Where the slave is, in mm, while the loop runs.
    pub now: Option<f64>,
}

/// Whether the device's damping belongs into a picture of what is needed.
fn is_in_sight(has: f64, needed_max: f64) -> bool {
    needed_max <= 0.0 || has <= IN_SIGHT * needed_max
}

/// Where the picture is cut in two, in mm: a spike near the surface would leave the rest flat.
fn cut_at(cycles: &[DepthBand], deepest: f64) -> Option<f64> {
    let shallow = cycles.first().filter(|band| band.from.0 <= 0.0)?;
    let at = CUT_PAST * shallow.to.0;
    (at < 0.25 * deepest).then_some(at)
}

/// Draws it in the space there is: the shallow depths on the left where they are another matter than the rest.
pub fn margin_ui(ui: &mut Ui, picture: &MarginPicture<'_>) {
    let deepest = picture.curve.last().map_or(0.0, |one| one.depth);
    let cut = cut_at(picture.cycles, deepest);
    let mut deep = part(picture, [cut.unwrap_or(0.0), deepest]);
    legend_ui(ui, &[&deep]);
    // The legend names them; the plots are too narrow for it.
    deep.stretches.iter_mut().for_each(|one| one.name.clear());
    ui.horizontal(|ui| {
        patch_ui(ui, Ink::Text, &format!("the device has {:.2} N s/m", picture.has));
    });
    let look = |shown| PlotLook { shown: Some(shown), ..PlotLook::default() };
    match cut {
        None => plot_ui(ui, "margin", &deep, look([0.0, deepest])),
        Some(at) => {
            let size = vec2(0.4 * ui.available_width(), ui.available_height());
            ui.horizontal_top(|ui| {
                let shallow =
                    Plot { stretches: deep.stretches.clone(), ..part(picture, [0.0, at]) };
                ui.allocate_ui(size, |ui| {
                    plot_ui(ui, "margin_shallow", &shallow, look([0.0, at]));
                });
                plot_ui(ui, "margin_deep", &deep, look([at, deepest]));
            });
        }
    }
}

/// Names and inks of what asks for damping, each with its edge above the one before.
type Part = (&'static str, Ink, fn(&MarginPoint) -> f64);
const PARTS: [Part; 3] = [
    ("relaxation of the model", Ink::Session(3), |one| one.lag),
    ("period of the loop", Ink::Session(1), |one| one.tick),
    ("delay of the loop", Ink::Session(0), |one| one.delay),
];

/// What is needed between two depths in mm.
fn part(picture: &MarginPicture<'_>, [from, to]: [f64; 2]) -> Plot {
    let points = || picture.curve.iter().filter(|one| (from..=to).contains(&one.depth));
    let most = points().map(|one| one.delay).fold(0.0, f64::max);
    let mut beneath: Vec<[f64; 2]> = points().map(|one| [one.depth, 0.0]).collect();
    // A body that needs none has a picture all the same.
    let seen = [0.0, if most > 0.0 { most } else { 1.0 }];
    let damping = PlotAxis::linear("damping needed (N s/m)").with_visible_values(&seen);
    let mut plot = Plot::new("", PlotAxis::linear("depth (mm)"), damping);
    for (name, ink, of) in PARTS {
        let edge: Vec<[f64; 2]> = points().map(|one| [one.depth, of(one)]).collect();
        plot.series.push(PlotSeries::line(name, ink, 1.0, edge.clone()));
        let edges = [std::mem::replace(&mut beneath, edge.clone()), edge];
        plot.bands.push(PlotBand { name: name.to_owned(), ink, edges });
    }
    plot.stretches = picture
        .cycles
        .iter()
        .map(|band| PlotStretch {
            name: "the model returns more energy than it takes".to_owned(),
            ends: [band.from.0, band.to.0],
            ink: Some(Ink::Line),
        })
        .collect();
    if is_in_sight(picture.has, most) {
        plot.levels.push(PlotLevel::plain(picture.has, Ink::Text));
    }
    let now = picture.now.filter(|depth| (from..=to).contains(depth));
    plot.x_levels.extend(now.map(|depth| PlotLevel::plain(depth, Ink::Quiet)));
    plot
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::Depth;

    #[test]
    fn a_device_far_above_does_not_flatten_the_parts() {
        assert!(is_in_sight(17.6, 8.0) && is_in_sight(0.5, 3.5));
        assert!(!is_in_sight(17.6, 3.5));
        // A body that needs nothing leaves the whole picture to the device.
        assert!(is_in_sight(17.6, 0.0));
    }

    #[test]
    fn the_picture_is_cut_past_a_spike_at_the_surface_and_nowhere_else() {
        let band = |from, to| DepthBand { from: Depth(from), to: Depth(to) };
        assert_eq!(cut_at(&[band(0.0, 0.7)], 30.0), Some(1.4));
        assert_eq!(cut_at(&[band(0.0, 0.7)], 2.0), None);
        assert_eq!(cut_at(&[band(0.0, 30.0)], 30.0), None);
        assert_eq!(cut_at(&[band(5.0, 6.0)], 30.0), None);
        assert_eq!(cut_at(&[], 30.0), None);
    }
}
