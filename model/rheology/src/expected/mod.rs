//! Precision that a protocol will reach, predicted before it is run.
//!
//! For small noise a least-squares fit scatters around the truth with the covariance
//! `(J'J)^-1 J'CJ (J'J)^-1`, where `J` holds the derivatives of the force by the unknowns along the
//! path and `C` is the covariance of the noise; for white noise of standard deviation `sigma` that is
//! `sigma^2 (J'J)^-1`, the bound of Cramér and Rao (Seber & Wild, Nonlinear Regression, 1989, sections
//! 2.1 and 6.2). `J` needs a path and a body but no measurement, so intervals can be known, and the
//! shortest protocol that reaches a wanted one found, before any tissue is touched.
//!
//! Where a run on the same rig was fitted in what its load cell reported, its noise, the drift of its zero and its contact
//! position are expected of the next run too ([`Measurement::Signal`]).
//!
//! Start at [`intervals`] for one protocol and at [`find_shortest_protocols`] for the search.
//!
//! ```
//! use palpate_rheology::expected::{FreeOffsets, MeasurementNoise, ProtocolPath, intervals};
//! use palpate_model::viscoelastic::ModifiedKelvin;
//! use palpate_model::{Depth, MmPerS, Newtons, Seconds};
//!
//! let protocol = ProtocolPath::ramp_hold(MmPerS(0.75), Depth(30.0), Seconds(50.0), 1000.0);
//! let noise = MeasurementNoise::white(Newtons(0.02));
//! let expected = intervals(&ModifiedKelvin::THESIS, &protocol, &noise, FreeOffsets::default())?;
//! let tau = &expected.parameters[0];
//! assert_eq!(tau.name, "tau_eps");
//! // 1.96 standard deviations of 0.166 %.
//! assert!((tau.percent.unwrap() - 0.325).abs() < 0.002);
//! # Ok::<(), palpate_rheology::expected::ExpectedError>(())
//! ```

mod curves;
mod information;
mod measurement;
mod noise;
mod protocol;
mod response;
mod rig;
mod search;
mod triangle;

pub use curves::{PrecisionCurve, PrecisionCurves, compute_precision_curves};
pub use information::{
    ExpectedError, ExpectedParameter, ExpectedPrecision, PARAMETER_NAMES, PARAMETER_UNITS,
    intervals,
};
pub use measurement::Measurement;
pub use noise::{CorrelatedNoise, FreeOffsets, MeasurementNoise};
pub use protocol::{PathPiece, ProtocolPath};
pub use rig::DesignLimits;
pub use search::{PrecisionTarget, ProtocolFamily, ProtocolProposal, find_shortest_protocols};
