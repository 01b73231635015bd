//! Recorded curves of the trade: their errors are found again, and a perturbed one is noticed.

use palpate_app::trade::{Extent, errors};
use palpate_model::trade::TradeCurves;
use palpate_sessions::trade::read_trade;
use palpate_tests::workspace;
use std::ops::ControlFlow;

fn recorded() -> TradeCurves {
    read_trade(&workspace().join("tests/trade/curves.json")).expect("recorded curves")
}

#[test]
fn recorded_errors_are_found_again_and_perturbed_ones_are_not() {
    let recorded = recorded();
    let now = errors(Extent::Quick, &|_, _, _| ControlFlow::Continue(())).unwrap();
    let now = now.expect("nobody ended it");
    recorded.agrees_with(&now).unwrap();
    // Every error above the last digits counts, to a percent at least.
    let mut perturbed = 0;
    for index in 0..recorded.integrators.len() {
        let mut changed = recorded.clone();
        let row = &mut changed.integrators[index];
        if let Some(error) = &mut row.error
            && error.ramp_hold_n > 1e-8
        {
            error.ramp_hold_n *= 1.01;
            assert!(changed.agrees_with(&now).is_err(), "{index}");
            perturbed += 1;
        }
    }
    for index in 0..recorded.families.len() {
        let mut changed = recorded.clone();
        let row = &mut changed.families[index];
        if row.error_n > 1e-8 {
            row.error_n *= 1.01;
            assert!(
                changed.agrees_with(&now).is_err(),
                "{}",
                row_name(&recorded, index)
            );
            perturbed += 1;
        }
    }
    for index in 0..recorded.fit.len() {
        let mut changed = recorded.clone();
        changed.fit[index].error_n *= 1.01;
        assert!(changed.agrees_with(&now).is_err(), "fit {index}");
        perturbed += 1;
    }
    assert!(perturbed > 50, "{perturbed}");
}

fn row_name(curves: &TradeCurves, index: usize) -> &str {
    &curves.families[index].family
}
