//! What is typed becomes the request of the command line, and what is wrong is said at its field.

use super::*;
use palpate_analysis::property::Property;
use palpate_indentation::Indenter;

/// The press of the guide.
fn punch() -> MaterialForm {
    let mut form = MaterialForm {
        radius: UncertainField::typed(["6", "0.02"]),
        thickness: UncertainField::typed(["60", "0.5"]),
        poisson: UncertainField::typed(["0.49", "0.01"]),
        ..MaterialForm::default()
    };
    form.take(Path::new("session"));
    form.check();
    form
}

#[test]
fn typed_values_reach_the_request() {
    let mut form = punch();
    form.limit_depth(0.9);
    form.contact = ErrorChoice::Stated;
    form.force_zero = ErrorChoice::Free;
    form.check();
    let PropertyRequest { press: request, property } = form.request().unwrap();
    assert_eq!(property, Property::Modulus);
    assert_eq!(request.source, Path::new("session"));
    assert_eq!(request.indenter, Indenter::FlatPunch { radius_mm: quantity([6.0, 0.02]) });
    assert_eq!(request.thickness_mm, Some(quantity([60.0, 0.5])));
    assert_eq!(request.poisson_ratio, quantity([0.49, 0.01]));
    assert_eq!(request.poisson_basis, PoissonBasis::Assumed);
    assert_eq!((request.base, request.law), (Base::Bonded, ContactLaw::Layer));
    assert_eq!(request.depth_max_mm, Some(0.9));
    assert_eq!(request.contact, ErrorSource::Stated(0.01));
    assert_eq!(request.force_zero, ErrorSource::Free);
    // Where all of the loading counts, what stands in a hidden field does not.
    form.is_depth_limited = false;
    form.depth_max.text = "deep".into();
    form.check();
    assert_eq!(form.request().unwrap().press.depth_max_mm, None);
}

#[test]
fn wrong_values_are_refused_at_their_field_by_name() {
    let refusal = |change: fn(&mut MaterialForm)| {
        let mut form = punch();
        change(&mut form);
        form.check();
        form.request().unwrap_err()
    };
    let typed = UncertainField::typed;
    for (refused, words) in [
        (refusal(|form| form.session.clear()), "choose a session first"),
        (refusal(|form| form.radius = UncertainField::typed(["-1", "0"])), "give a length above"),
        (refusal(|form| form.radius.error.text = "7".into()), "less than the value itself"),
        (refusal(|form| form.radius.error.text = "x".into()), "uncertainty of radius: 'x' is not"),
        (refusal(|form| form.shape = Shape::Cone), "half angle: type a number"),
        (refusal(|form| form.poisson.value.text = "0.6".into()), "Poisson: Poisson's ratio is 0.6"),
        (refusal(|form| form.thickness.value.text = String::new()), "thickness: type a number"),
        (refusal(|form| form.law = ContactLaw::Hertz), "a sphere only"),
        (refusal(|form| form.limit_depth(0.0)), "depth: must be above 0"),
    ] {
        assert!(refused.contains(words), "{words}: {refused}");
    }
    // Of a punch the half angle does not matter.
    let mut form = punch();
    form.half_angle = typed(["-1", "0"]);
    form.check();
    assert!(form.request().is_ok());
}

#[test]
fn a_measured_thickness_is_the_session_s_until_another_one_is_typed() {
    let mut form = punch();
    form.take_thickness(Some(quantity([12.345_678, 0.2])));
    form.check();
    assert_eq!(form.thickness.texts(), ["12.3457", "0.2"]);
    // To the last digit, and as the session's edits have it.
    assert_eq!(form.request().unwrap().press.thickness_mm, None);
    form.thickness.value.text = "13".into();
    form.check();
    assert_eq!(form.request().unwrap().press.thickness_mm, Some(quantity([13.0, 0.2])));
    // What was typed stays where the next session measured none; what was measured does not.
    form.take_thickness(None);
    assert_eq!(form.thickness.texts(), ["13", "0.2"]);
    form.take_thickness(Some(quantity([20.0, 0.1])));
    form.take_thickness(None);
    assert_eq!(form.thickness.texts(), ["", "0"]);
}

#[test]
fn the_session_in_front_is_followed_until_another_one_is_typed() {
    let mut form = MaterialForm::default();
    let [first, second] = ["first", "second"].map(PathBuf::from);
    form.follow(None);
    form.follow(Some(&first));
    assert_eq!(form.source(), first);
    form.follow(Some(&second));
    assert_eq!(form.source(), second);
    form.take(Path::new("typed"));
    form.follow(Some(&first));
    assert_eq!(form.source(), Path::new("typed"));
}

#[test]
fn the_next_window_opens_with_what_was_typed_but_for_the_session() {
    assert_eq!(MaterialForm::default().kept(), None);
    let form = punch();
    let mut again: MaterialForm = serde_json::from_value(form.kept().unwrap()).unwrap();
    assert!(again.source().as_os_str().is_empty());
    again.take(form.source());
    again.check();
    assert_eq!(again, form);
    // Settings of a later version may know more.
    let newer = serde_json::json!({ "shape": "Sphere", "from_the_future": 1 });
    assert_eq!(serde_json::from_value::<MaterialForm>(newer).unwrap().shape, Shape::Sphere);
}
