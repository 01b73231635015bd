//! The switches of the picture, and what they make of it.

use crate::theme::Tokens;
use crate::widgets::{NamedControl, quiet_ui, tick_box};
use eframe::egui::{Color32, Ui};
use palpate_figures::drawing::round_up;
use palpate_figures::tokens::viridis;
use palpate_haptics::surface::Heights;
use palpate_tissue_view::{
    ColourRamp, FieldData, Legend, ProbeKind, Rgb, SurfaceColours, SurfaceError, SurfaceStyle,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Radius of the drawn tip in lengths of the scene. The loop's stylus is a point.
const STEEL: f64 = 0.025;
const FINGER: f64 = 0.06;
/// Height of the block's sides in lengths of the scene.
const THICKNESS: f64 = 0.12;
/// Lines of equal depth in the range of the colours.
const CONTOURS: f64 = 10.0;
/// Colours of the ramp, in equal steps.
const RAMP: u8 = 64;

/// What the colours of the surface stand for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneColours {
    /// Nothing: moist tissue.
    #[default]
    Tissue,
    /// The depth below rest.
    Depth,
}

/// What the stylus is drawn as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DrawnProbe {
    #[default]
    Steel,
    Finger,
}

impl DrawnProbe {
    pub fn kind(self) -> ProbeKind {
        match self {
            Self::Steel => ProbeKind::Steel,
            Self::Finger => ProbeKind::Glove,
        }
    }

    /// Radius of the tip in mm, in a scene of this side.
    pub fn radius_mm(self, side_mm: f64) -> f64 {
        match self {
            Self::Steel => STEEL * side_mm,
            Self::Finger => FINGER * side_mm,
        }
    }
}

/// The switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SceneLook {
    pub colours: SceneColours,
    pub has_contours: bool,
    pub probe: DrawnProbe,
    /// Two pictures side by side, one for each eye.
    pub has_two_eyes: bool,
    /// The best picture, whatever its frames take.
    pub has_full_detail: bool,
}

impl SceneLook {
    /// Draws them, for a scene of this side in mm.
    pub fn ui(&mut self, ui: &mut Ui, side_mm: f64) {
        ui.horizontal_wrapped(|ui| {
            ui.label("colour");
            for (colours, name) in
                [(SceneColours::Tissue, "tissue"), (SceneColours::Depth, "depth")]
            {
                ui.radio_value(&mut self.colours, colours, name).named(name);
            }
        });
        ui.horizontal_wrapped(|ui| {
            ui.label("probe");
            for (probe, name) in [(DrawnProbe::Steel, "steel"), (DrawnProbe::Finger, "finger")] {
                ui.radio_value(&mut self.probe, probe, name).named(name);
            }
        });
        tick_box(ui, &mut self.has_contours, "lines of equal depth");
        tick_box(ui, &mut self.has_two_eyes, "two eyes, side by side");
        tick_box(ui, &mut self.has_full_detail, "full detail at any frame time");
        let radius = self.probe.radius_mm(side_mm);
        quiet_ui(
            ui,
            format!(
                "The loop's stylus is a point; its tip is drawn with a radius of {radius:.1} mm."
            ),
        );
    }

    /// What the next window opens with; none where all is as at first.
    pub fn kept(&self) -> Option<Value> {
        (*self != Self::default()).then(|| serde_json::to_value(self).ok()).flatten()
    }

    /// What a window before kept; the usual look where it is not understood.
    #[must_use]
    pub fn from_kept(kept: &Value) -> Self {
        serde_json::from_value(kept.clone()).unwrap_or_default()
    }

    /// The look of a surface of this side that was `deepest` at most, both in mm.
    pub fn look(&self, side_mm: f64, deepest: f64, tokens: &Tokens) -> SurfaceStyle {
        let range = [0.0, colour_depth(deepest)];
        let mut look = SurfaceStyle::values(range, rgb(tokens.canvas));
        if self.colours == SceneColours::Tissue {
            look.colours = SurfaceColours::Tissue { has_texture: true };
        }
        let steps = (0..=RAMP).map(|step| rgb(viridis(f32::from(step) / f32::from(RAMP))));
        look.ramp = ColourRamp::new(&steps.collect::<Vec<_>>());
        look.contour_mm = self.has_contours.then(|| contour_mm(deepest));
        look.thickness_mm = THICKNESS * side_mm;
        look
    }

    /// The heights as they are, and what the colours stand for.
    pub fn field(&self, now: Heights, rest: &[f64]) -> Result<FieldData, SurfaceError> {
        let grid = now.grid();
        let field = FieldData::new(grid.columns(), grid.spacing(), now.all())?.with_rest(rest)?;
        Ok(match self.colours {
            SceneColours::Tissue => field,
            SceneColours::Depth => field.with_depth_as_values(),
        })
    }

    /// The numbers beside the colours; none where colours are no data.
    pub fn legend(&self, deepest: f64) -> Option<Legend> {
        let range = [0.0, colour_depth(deepest)];
        (self.colours == SceneColours::Depth).then(|| Legend::new("depth (mm)", range))
    }

    /// What lines stand for, in words.
    pub fn contour_words(&self, deepest: f64) -> Option<String> {
        self.has_contours.then(|| format!("a line for every {} mm of depth", contour_mm(deepest)))
    }
}

fn rgb(colour: Color32) -> Rgb {
    [colour.r(), colour.g(), colour.b()]
}

/// The depth at which the colours of a scene end: the deepest, rounded up to 1, 2 or 5 times a power of ten, so that
/// colours stand while the tool moves a little.
#[must_use]
pub fn colour_depth(deepest: f64) -> f64 {
    round_up(deepest.clamp(1.0, 1e6))
}

fn contour_mm(deepest: f64) -> f64 {
    colour_depth(deepest) / CONTOURS
}

/// The deepest of heights below rest, in mm.
#[must_use]
pub fn deepest_of(now: Heights, rest: &[f64]) -> f64 {
    let depths = now.all().iter().zip(rest).map(|(height, rest)| rest - height);
    depths.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theme;
    use palpate_haptics::surface::Grid;

    #[test]
    fn colours_end_at_a_round_depth_and_lines_divide_it() {
        for (deepest, wanted) in [(0.0, 1.0), (1.2, 2.0), (3.0, 5.0), (f64::INFINITY, 1e6)] {
            let depth = colour_depth(deepest);
            assert!((depth - wanted).abs() < 1e-9 * wanted, "{deepest}");
        }
        let look = SceneLook { has_contours: true, ..SceneLook::default() };
        assert_eq!(look.contour_words(3.0).unwrap(), "a line for every 0.5 mm of depth");
    }

    #[test]
    fn colours_are_those_of_the_figures_and_have_a_legend_where_they_are_data() {
        let tokens = theme::Tokens::of(true);
        let tissue = SceneLook::default();
        assert_eq!(tissue.legend(3.0), None);
        let depth = SceneLook { colours: SceneColours::Depth, ..tissue };
        let look = depth.look(60.0, 3.0, tokens);
        assert_eq!(look.colours, SurfaceColours::Values { range: [0.0, 5.0] });
        assert_eq!(look.background, rgb(tokens.canvas));
        for share in [0.0_f32, 0.2, 0.55, 1.0] {
            let [drawn, wanted] = [look.ramp.at(f64::from(share)), rgb(viridis(share))];
            // Between two of 65 colours, and rounded twice.
            assert!((0..3).all(|at| drawn[at].abs_diff(wanted[at]) <= 2), "{drawn:?} {wanted:?}");
        }
        assert_eq!(depth.legend(3.0).unwrap().title, "depth (mm)");
    }

    #[test]
    fn depths_are_counted_from_rest() {
        let grid = Grid::new(3, 3, 1.0).unwrap();
        let heights: Vec<f64> = (0..9).map(|node| -0.5 * f64::from(node)).collect();
        let now = Heights::new(grid, &heights).unwrap();
        assert!((deepest_of(now, &[0.25; 9]) - 4.25).abs() < 1e-12);
        assert_eq!(deepest_of(now, &[-9.0; 9]), 0.0);
        assert!(SceneLook::default().field(now, &[0.0; 9]).is_ok());
    }

    #[test]
    fn switches_are_kept_and_the_usual_ones_are_not_written() {
        assert_eq!(SceneLook::default().kept(), None);
        let look = SceneLook {
            colours: SceneColours::Depth,
            probe: DrawnProbe::Finger,
            has_two_eyes: true,
            ..SceneLook::default()
        };
        assert_eq!(SceneLook::from_kept(&look.kept().unwrap()), look);
        assert_eq!(SceneLook::from_kept(&Value::from("no look")), SceneLook::default());
    }
}
