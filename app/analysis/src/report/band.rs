//! The band that a calibration's uncertainty lays around a force, in every picture of one.

use palpate_figures::figure::{Band, Ink};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::units::Newtons;

/// How many standard uncertainties it reaches either way: about 95 % where errors are normal (JCGM 100:2008, 6.2).
const SIGMAS: f64 = 2.0;

/// What the band is, in words.
const WORDS: &str = "calibration, ± 2u";

/// Around points whose ordinates are forces in N; `None` where no uncertainty is stated.
pub(super) fn around(forces: &[[f64; 2]], uncertainty: Option<&ForceUncertainty>) -> Option<Band> {
    let edge = |sigmas: f64| {
        let at = |&[x, force]: &[f64; 2]| {
            let sigma = uncertainty?.sigma(Newtons(force))?;
            Some([x, force + sigmas * sigma.0])
        };
        forces.iter().filter_map(at).collect::<Vec<_>>()
    };
    let edges = [edge(-SIGMAS), edge(SIGMAS)];
    let is_stated = !edges[0].is_empty();
    is_stated.then(|| Band { name: WORDS.to_owned(), ink: Ink::Series, edges })
}
