use super::loading::{LoadingKnowledge, LoadingSample, ModulusTerm};
use super::unloading::fit_unloading;
use crate::document::{Indenter, PoissonBasis, PyramidFaces, Quantity, Specimen};
use crate::layer::Base;

fn known(value: f64, standard_uncertainty: f64) -> Quantity {
    Quantity { value, standard_uncertainty }
}

fn specimen(poisson: f64) -> Specimen {
    Specimen {
        thickness_mm: known(5000.0, 0.0),
        base: Base::Bonded,
        poisson_ratio: known(poisson, 0.01),
        poisson_basis: PoissonBasis::Assumed,
    }
}

const EXACT: LoadingKnowledge = LoadingKnowledge {
    noise_newtons: None,
    contact_error_mm: Some(0.0),
    zero_error_newtons: Some(0.0),
};

/// A way back from the top by a power.
fn unloading(top_newtons: f64, [top_mm, left_mm, exponent]: [f64; 3]) -> Vec<LoadingSample> {
    let sample = |index: u32| {
        let depth_mm = top_mm - (top_mm - left_mm) * f64::from(index) / 200.0;
        let share = ((depth_mm - left_mm) / (top_mm - left_mm)).max(0.0);
        LoadingSample { depth_mm, force_newtons: top_newtons * share.powf(exponent) }
    };
    (0..=200).map(sample).collect()
}

/// The maker's own numbers of a Bioindenter's press into cartilage with a sphere of 0.5 mm, "20260609 Crosslinking# 1.TXT" of
/// `artorg-unibe-ch/CartilageIndentationAnalysis`, commit 675d19e: 996.25 uN at 15.65 um, a slope of 201.5652 uN/um with the
/// exponent 2.8617 give a contact of 12.06 um, an area of 37420.07 um^2 and, for a Poisson's ratio of 0.3, 840.33 kPa.
#[test]
fn a_maker_s_numbers_are_those_of_the_method() {
    let (force, stiffness, exponent) = (996.25e-6, 0.201_565_2, 2.8617);
    let left = 0.01565 - exponent * force / stiffness;
    let samples = unloading(force, [0.01565, left, exponent]);
    let sphere = Indenter::Sphere { radius_mm: known(0.5, 0.0) };
    let fit = fit_unloading(&sphere, &specimen(0.3), &samples, EXACT).unwrap();
    assert!((fit.exponent / exponent - 1.0).abs() < 1e-6, "{fit:?}");
    assert!((fit.stiffness_n_per_mm / stiffness - 1.0).abs() < 1e-6, "{fit:?}");
    // The maker takes no epsilon below 0.727, that of an exponent of 2, and 0.713 belongs to this one: 0.6 % of the depth.
    assert!((fit.contact_depth_mm / 0.01206 - 1.0).abs() < 7e-3, "{fit:?}");
    assert!((fit.contact_area_mm2 / 0.037_420_07 - 1.0).abs() < 7e-3, "{fit:?}");
    assert!((fit.modulus_mpa / 0.840_33 - 1.0).abs() < 4e-3, "{fit:?}");
}

/// An elastic surface unloads as it was loaded, by the closed forms of Sneddon: the method gives the modulus back.
#[test]
fn an_elastic_unloading_gives_the_modulus_back() {
    let cone = Indenter::Cone { half_angle_degrees: known(75.0, 0.1) };
    let sphere = Indenter::Sphere { radius_mm: known(40.0, 0.4) };
    for (indenter, exponent, tolerance) in [
        // A cone is exact; a parabola is a sphere but for a tenth of depth over radius, 0.1 % here.
        (cone, 2.0, 1e-6),
        (sphere, 1.5, 2e-3),
    ] {
        let (modulus, depth) = (0.02, 0.4);
        let shape = indenter.shape().unwrap();
        let contact = shape.on_half_space(depth, 0.4).unwrap();
        let force = modulus * contact.force_over_modulus;
        let samples = unloading(force, [depth, 0.0, exponent]);
        let fit = fit_unloading(&indenter, &specimen(0.4), &samples, EXACT).unwrap();
        assert!((fit.modulus_mpa / modulus - 1.0).abs() < tolerance, "{fit:?}");
        // E falls as 1 - nu^2 rises.
        let of_poisson = fit.terms[&ModulusTerm::Poisson] / fit.modulus_mpa;
        assert!((of_poisson / (2.0 * 0.4 * 0.01 / (1.0 - 0.16)) - 1.0).abs() < 1e-3, "{fit:?}");
    }
    let vickers =
        Indenter::Pyramid { faces: PyramidFaces::Four, half_angle_degrees: known(74.0, 0.0) };
    let samples = unloading(0.1, [0.4, 0.1, 1.6]);
    let pyramid = fit_unloading(&vickers, &specimen(0.4), &samples, EXACT).unwrap();
    let half_angle_degrees = known(
        (std::f64::consts::FRAC_2_SQRT_PI * 74f64.to_radians().tan()).atan().to_degrees(),
        0.0,
    );
    let round = Indenter::Cone { half_angle_degrees };
    let cone = fit_unloading(&round, &specimen(0.4), &samples, EXACT).unwrap();
    assert!((cone.modulus_mpa / pyramid.modulus_mpa - 1.012).abs() < 1e-6);
}

#[test]
fn what_is_no_unloading_is_refused_in_one_sentence() {
    let sphere = Indenter::Sphere { radius_mm: known(40.0, 0.0) };
    let refusal = |samples: &[LoadingSample]| {
        fit_unloading(&sphere, &specimen(0.4), samples, EXACT).unwrap_err().to_string()
    };
    assert!(refusal(&[]).contains("0 samples"));
    let good = unloading(0.1, [0.4, 0.1, 1.6]);
    assert!(refusal(&good[..8]).contains("record the unloading too"), "{}", refusal(&good[..8]));
    let mut rising = good.clone();
    rising.iter_mut().for_each(|one| one.depth_mm = -one.depth_mm);
    assert!(refusal(&rising).contains("no power of the depth"), "{}", refusal(&rising));
    let shallow: Vec<LoadingSample> =
        good.iter().map(|one| LoadingSample { depth_mm: one.depth_mm - 0.39, ..*one }).collect();
    assert!(refusal(&shallow).contains("where this indenter has no area"), "{}", refusal(&shallow));
}
