//! The band that a calibration's uncertainty lays around a force, in every picture of one.

use super::picture::RIGHT;
use ecolor::Color32;
use palpate_figures::drawing::{Ink, Panel, Svg};
use palpate_figures::tokens::LIGHT;
use palpate_model::calibration::ForceUncertainty;
use palpate_model::units::Newtons;

/// How many standard uncertainties it reaches either way: about 95 % where errors are normal (JCGM 100:2008, 6.2).
const SIGMAS: f64 = 2.0;

/// What the band is, in words.
const WORDS: &str = "calibration, ± 2u";

/// A band around a curve of forces; empty where no uncertainty is stated.
#[derive(Default)]
pub(super) struct Band {
    above: Vec<[f64; 2]>,
    below: Vec<[f64; 2]>,
}

impl Band {
    /// Around points whose ordinates are forces in N.
    pub fn around(forces: &[[f64; 2]], uncertainty: Option<&ForceUncertainty>) -> Self {
        let edge = |sigmas: f64| {
            let at = |&[x, force]: &[f64; 2]| {
                let sigma = uncertainty?.sigma(Newtons(force))?;
                Some([x, force + sigmas * sigma.0])
            };
            forces.iter().filter_map(at).collect()
        };
        Self { above: edge(SIGMAS), below: edge(-SIGMAS) }
    }

    /// What a panel has to have room for.
    pub fn edges(&self) -> [&[[f64; 2]]; 2] {
        [&self.above, &self.below]
    }

    /// Draws it; curves go on top.
    pub fn draw(&self, svg: &mut Svg, panel: &Panel, color: Color32) {
        let [above, below] = self.edges().map(|edge| {
            let placed = edge.iter().map(|point| panel.at(*point));
            placed.collect::<Vec<_>>()
        });
        if !above.is_empty() {
            svg.band(&above, &below, color);
        }
    }
}

/// Says what bands are, in the line of the legend, where there is one.
pub(super) fn legend(svg: &mut Svg, uncertainty: Option<&ForceUncertainty>) {
    if uncertainty.is_none_or(|one| !one.is_stated()) {
        return;
    }
    let x = RIGHT - 360.0;
    svg.band(&[[x, 40.0], [x + 24.0, 40.0]], &[[x, 52.0], [x + 24.0, 52.0]], LIGHT.series);
    svg.text([x + 30.0, 50.0], Ink::plain(LIGHT.text), WORDS);
}
