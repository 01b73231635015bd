//! Recorded curves of the trade: their errors are found again, and a perturbed one is noticed.

use palpate_analysis::progress::NoProgress;
use palpate_analysis::trade::stored::read_trade;
use palpate_analysis::trade::{TradeExtent, errors};
use palpate_rheology::trade::{TradeCurves, rounding_share};
use palpate_tests::workspace;

fn recorded() -> TradeCurves {
    read_trade(&workspace().join("tests/trade/curves.json")).expect("recorded curves")
}

#[test]
fn recorded_errors_are_found_again_and_perturbed_ones_are_not() {
    let recorded = recorded();
    let now = errors(TradeExtent::Quick, &NoProgress).unwrap();
    let now = now.expect("it was not cancelled");
    recorded.agrees_with(&now).unwrap();
    // Every error counts, to a percent at least, whose percent is twice its rounding.
    let mut perturbed = 0;
    for index in 0..recorded.integrators.len() {
        let mut changed = recorded.clone();
        let row = &mut changed.integrators[index];
        let visible = 200.0 * rounding_share(row.precision) * recorded.peak.ramp_hold_n;
        if let Some(error) = &mut row.error
            && error.ramp_hold_n > visible
        {
            error.ramp_hold_n *= 1.01;
            assert!(changed.agrees_with(&now).is_err(), "{index}");
            perturbed += 1;
        }
    }
    let changes: [fn(&mut TradeCurves); 5] = [
        |curves| curves.peak.ramp_hold_n *= 1.01,
        |curves| curves.peak.poke_n *= 1.01,
        |curves| curves.fit[0].tau_error *= 1.01,
        |curves| {
            let error = curves.live[0].tau_error.as_mut().expect("an error");
            *error *= 1.01;
        },
        |curves| {
            let row = curves.integrators.iter_mut().find(|row| row.step_s == 0.01);
            let error = row.and_then(|row| row.error.as_mut()).expect("an error");
            error.poke_n *= 1.01;
        },
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let mut changed = recorded.clone();
        change(&mut changed);
        assert!(changed.agrees_with(&now).is_err(), "change {index}");
    }
    for index in 0..recorded.families.len() {
        let mut changed = recorded.clone();
        let row = &mut changed.families[index];
        if row.error_n > 1e-8 {
            row.error_n *= 1.01;
            assert!(changed.agrees_with(&now).is_err(), "{}", row_name(&recorded, index));
            perturbed += 1;
        }
    }
    for index in 0..recorded.fit.len() {
        let mut changed = recorded.clone();
        changed.fit[index].error_n *= 1.01;
        assert!(changed.agrees_with(&now).is_err(), "fit {index}");
        perturbed += 1;
    }
    assert!(perturbed > 40, "{perturbed}");
}

fn row_name(curves: &TradeCurves, index: usize) -> &str {
    &curves.families[index].family
}
