//! Expected intervals against published figures, brute force and the scatter of real fits.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail by panicking")]

mod support;

use palpate_model::expected::{Memory, Noise, Protocol, Unknowns, intervals};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, MmPerS, Newtons, Seconds};

const DEPTH: Depth = Depth(30.0);
const WITHOUT_OFFSET: Unknowns = Unknowns {
    f0: true,
    f_offset: false,
};

/// Relative standard deviations in percent.
fn percents(protocol: &Protocol, noise: &Noise, unknowns: Unknowns) -> [f64; 5] {
    let expected = intervals(&ModifiedKelvin::THESIS, protocol, noise, unknowns).unwrap();
    expected
        .parameters
        .map(|parameter| 100.0 * parameter.std_error / parameter.value.abs())
}

#[test]
fn published_figures() {
    let one = Protocol::ramp_hold(MmPerS(0.75), DEPTH, Seconds(50.0), 1e3);
    let speeds = [MmPerS(0.75), MmPerS(1.5)];
    let two = Protocol::two_speeds(speeds, DEPTH, Seconds(50.0), Seconds(10.0), 1e3);
    let triangle = Protocol::triangle(MmPerS(0.75), DEPTH, 1, 1e3);
    let cases = [
        (&one, WITHOUT_OFFSET, [0.158, 0.111, 0.073, 0.036, 0.068]),
        (
            &one,
            Unknowns::default(),
            [0.166, 0.271, 0.126, 0.053, 0.068],
        ),
        (&two, WITHOUT_OFFSET, [0.072, 0.086, 0.056, 0.027, 0.027]),
        (
            &triangle,
            WITHOUT_OFFSET,
            [0.060, 0.078, 0.051, 0.025, 0.018],
        ),
    ];
    for (protocol, unknowns, published) in cases {
        let found = percents(protocol, &Noise::white(Newtons(0.02)), unknowns);
        for (found, published) in found.into_iter().zip(published) {
            // Published to three decimals.
            assert!((found - published).abs() < 6e-4, "{found} {published}");
        }
    }
    let _ = Memory {
        sd: Newtons(0.0),
        time: Seconds(1.0),
    };
}
