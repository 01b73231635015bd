//! The switches of the picture, and what they make of it.

use crate::theme::Tokens;
use crate::widgets::{NamedControl, quiet_ui, tick_box};
use crate::workers::scene_tissue::MeshTissue;
use eframe::egui::{Color32, Ui};
use palpate_figures::drawing::round_up;
use palpate_figures::tokens::viridis;
use palpate_haptics::surface::Heights;
use palpate_runner::haptics::SunkVertex;
use palpate_tissue_view::{
    ColourRamp, ElasticModel, FieldData, GrowingRange, Legend, ModelQuantity, MovedNode, ProbeKind,
    Rgb, SurfaceColours, SurfaceData, SurfaceError, SurfaceStyle,
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
    /// The force at which a contact settles that stays at the depth of a node.
    Force,
    /// How much that force grows with depth.
    Stiffness,
}

impl SceneColours {
    const ALL: [(Self, &'static str); 4] = [
        (Self::Tissue, "tissue"),
        (Self::Depth, "depth"),
        (Self::Force, "force"),
        (Self::Stiffness, "stiffness"),
    ];

    /// What the fitted model says of a node; `None` of what needs no model.
    fn quantity(self) -> Option<ModelQuantity> {
        match self {
            Self::Tissue | Self::Depth => None,
            Self::Force => Some(ModelQuantity::Force),
            Self::Stiffness => Some(ModelQuantity::Stiffness),
        }
    }

    /// The title of the legend; `None` where colours are no data.
    fn title(self) -> Option<&'static str> {
        match self {
            Self::Tissue => None,
            Self::Depth => Some("depth (mm)"),
            Self::Force | Self::Stiffness => self.quantity().map(ModelQuantity::title),
        }
    }

    /// The range of the legend before anything is touched.
    fn first_range(self) -> GrowingRange {
        self.quantity().map_or(GrowingRange::to(1.0), ModelQuantity::first_range)
    }
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
            for (colours, name) in SceneColours::ALL {
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

    /// The look of a surface of this side in mm, with what was seen of it.
    pub fn look(&self, side_mm: f64, seen: &SeenRanges, tokens: &Tokens) -> SurfaceStyle {
        let mut look = SurfaceStyle::values(seen.values.range(), rgb(tokens.canvas));
        if self.colours == SceneColours::Tissue {
            look.colours = SurfaceColours::Tissue { has_texture: true };
        }
        let steps = (0..=RAMP).map(|step| rgb(viridis(f32::from(step) / f32::from(RAMP))));
        look.ramp = ColourRamp::new(&steps.collect::<Vec<_>>());
        look.contour_mm = self.has_contours.then(|| seen.contour_mm());
        look.thickness_mm = self.thickness_mm(side_mm);
        look
    }

    /// Height of the sides of a square of this length, in mm.
    pub fn thickness_mm(&self, side_mm: f64) -> f64 {
        THICKNESS * side_mm
    }

    /// The tissue where it is, and what the colours stand for.
    pub fn surface(&self, shown: PicturedTissue) -> Result<SurfaceData, SurfaceError> {
        match shown {
            PicturedTissue::Square { now, model } => {
                let grid = now.grid();
                let field =
                    FieldData::new(grid.columns(), grid.spacing(), now.all())?.with_level_rest();
                Ok(SurfaceData::Field(match (self.colours, self.colours.quantity()) {
                    (_, Some(quantity)) => field.with_model_as_values(quantity, &model),
                    (SceneColours::Tissue, None) => field,
                    (_, None) => field.with_depth_as_values(),
                }))
            }
            PicturedTissue::Mesh { tissue, sunk } => {
                let moved = sunk.iter().map(|one| MovedNode {
                    node: one.vertex,
                    place: one.place,
                    depth_mm: one.depth,
                });
                let mesh = tissue.shape.displaced(moved)?;
                Ok(SurfaceData::Mesh(match (self.colours, self.colours.quantity()) {
                    (_, Some(quantity)) => mesh.with_model_as_values(quantity, &tissue.models)?,
                    (SceneColours::Tissue, None) => mesh,
                    (_, None) => mesh.with_depth_as_values(),
                }))
            }
        }
    }

    /// The numbers beside the colours; none where colours are no data.
    pub fn legend(&self, seen: &SeenRanges) -> Option<Legend> {
        self.colours.title().map(|title| Legend::new(title, seen.values.range()))
    }

    /// What lines stand for, in words.
    pub fn contour_words(&self, seen: &SeenRanges) -> Option<String> {
        self.has_contours.then(|| format!("a line for every {} mm of depth", seen.contour_mm()))
    }
}

/// The tissue of a picture.
#[derive(Clone, Copy, Debug)]
pub enum PicturedTissue<'a> {
    /// Heights in mm; at rest they are zero.
    Square { now: Heights<'a>, model: ElasticModel },
    /// What of a mesh is not at rest.
    Mesh { tissue: &'a MeshTissue, sunk: &'a [SunkVertex] },
}

impl PicturedTissue<'_> {
    /// The deepest place below rest, in mm.
    fn deepest(&self) -> f64 {
        match self {
            Self::Square { now, .. } => now.all().iter().map(|height| -height).fold(0.0, f64::max),
            Self::Mesh { sunk, .. } => sunk.iter().map(|one| one.depth).fold(0.0, f64::max),
        }
    }
}

/// What was seen since the scene began: colours and lines do not change their meaning while one looks.
#[derive(Clone, Copy, Debug)]
pub struct SeenRanges {
    colours: SceneColours,
    values: GrowingRange,
    /// The deepest depth in mm.
    deepest: f64,
}

impl Default for SeenRanges {
    fn default() -> Self {
        let colours = SceneColours::default();
        Self { colours, values: colours.first_range(), deepest: 0.0 }
    }
}

impl SeenRanges {
    /// Takes what a picture shows. Colours that stand for something else begin again.
    pub fn take(&mut self, colours: SceneColours, shown: PicturedTissue, surface: &SurfaceData) {
        if colours != self.colours {
            *self = Self { colours, values: colours.first_range(), ..*self };
        }
        self.deepest = self.deepest.max(shown.deepest());
        if let Some(range) = surface.value_range() {
            self.values.take(range);
        }
    }

    fn contour_mm(&self) -> f64 {
        colour_depth(self.deepest) / CONTOURS
    }
}

fn rgb(colour: Color32) -> Rgb {
    [colour.r(), colour.g(), colour.b()]
}

/// The depth that lines divide: the deepest, rounded up to 1, 2 or 5 times a power of ten, so that they stand while the tool
/// moves a little.
fn colour_depth(deepest: f64) -> f64 {
    round_up(deepest.clamp(1.0, 1e6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theme;
    use palpate_haptics::surface::Grid;

    const MODEL: ElasticModel = ElasticModel { mu: [0.05, -0.008, 0.0004] };

    /// A square with a dent of so many mm in one node.
    fn dented(deep: f64, take: impl FnOnce(PicturedTissue)) {
        let grid = Grid::new(3, 3, 1.0).unwrap();
        let mut heights = [0.0; 9];
        heights[4] = -deep;
        let now = Heights::new(grid, &heights).unwrap();
        take(PicturedTissue::Square { now, model: MODEL });
    }

    fn seen(look: &SceneLook, depths: &[f64]) -> SeenRanges {
        let mut seen = SeenRanges::default();
        for deep in depths {
            dented(*deep, |shown| seen.take(look.colours, shown, &look.surface(shown).unwrap()));
        }
        seen
    }

    #[test]
    fn lines_divide_a_round_depth_and_ranges_only_grow() {
        for (deepest, wanted) in [(0.0, 1.0), (1.2, 2.0), (3.0, 5.0), (f64::INFINITY, 1e6)] {
            let depth = colour_depth(deepest);
            assert!((depth - wanted).abs() < 1e-9 * wanted, "{deepest}");
        }
        let look = SceneLook { has_contours: true, ..SceneLook::default() };
        let words = "a line for every 0.5 mm of depth";
        assert_eq!(look.contour_words(&seen(&look, &[3.0, 0.2])).unwrap(), words);
        let depth = SceneLook { colours: SceneColours::Depth, ..look };
        assert_eq!(seen(&depth, &[3.0, 0.2]).values.range(), [0.0, 5.0]);
        // Another meaning begins again: 0.05 * 3 - 0.008 * 9 + 0.0004 * 27 is 0.0888 N.
        let mut one = seen(&depth, &[3.0]);
        let force = SceneLook { colours: SceneColours::Force, ..look };
        dented(3.0, |shown| one.take(force.colours, shown, &force.surface(shown).unwrap()));
        assert_eq!(one.values.range(), [0.0, 0.1]);
    }

    #[test]
    fn colours_are_those_of_the_figures_and_have_a_legend_where_they_are_data() {
        let tokens = theme::Tokens::of(true);
        let tissue = SceneLook::default();
        assert_eq!(tissue.legend(&seen(&tissue, &[3.0])), None);
        let depth = SceneLook { colours: SceneColours::Depth, ..tissue };
        let of_depth = seen(&depth, &[3.0]);
        let look = depth.look(60.0, &of_depth, tokens);
        assert_eq!(look.colours, SurfaceColours::Values { range: [0.0, 5.0] });
        assert_eq!(look.background, rgb(tokens.canvas));
        for share in [0.0_f32, 0.2, 0.55, 1.0] {
            let [drawn, wanted] = [look.ramp.at(f64::from(share)), rgb(viridis(share))];
            // Between two of 65 colours, and rounded twice.
            assert!((0..3).all(|at| drawn[at].abs_diff(wanted[at]) <= 2), "{drawn:?} {wanted:?}");
        }
        for (colours, title) in [
            (SceneColours::Depth, "depth (mm)"),
            (SceneColours::Force, "relaxed force at this depth (N)"),
            (SceneColours::Stiffness, "stiffness at this depth (N/mm)"),
        ] {
            let look = SceneLook { colours, ..tissue };
            assert_eq!(look.legend(&seen(&look, &[3.0])).unwrap().title, title);
        }
    }

    #[test]
    fn a_mesh_has_the_places_that_the_loop_computed() {
        let text = "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nf 1 2 3\nf 1 3 4\n";
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("pad.toml");
        std::fs::write(folder.path().join("pad.obj"), text).unwrap();
        std::fs::write(&scene, "name = \"pad\"\n[mesh]\nfile = \"pad.obj\"\n").unwrap();
        let (file, _) = palpate_analysis::scene::read_scene(Some(&scene)).unwrap();
        let tissue = MeshTissue::of(&file).unwrap().unwrap();
        let sunk = [SunkVertex { vertex: 2, place: [9.0, 9.0, -4.0], depth: 4.0 }];
        let shown = PicturedTissue::Mesh { tissue: &tissue, sunk: &sunk };
        assert_eq!(shown.deepest(), 4.0);
        let look = SceneLook { colours: SceneColours::Depth, ..SceneLook::default() };
        let surface = look.surface(shown).unwrap();
        assert_eq!(surface.value_range(), Some([0.0, 4.0]));
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
