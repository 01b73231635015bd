//! The modified Kelvin body with an elastic part of one to five terms.

use crate::families::{DepthDrive, POWER_MAX, RelaxationTerm};
use palpate_model::viscoelastic::{BodyError, ModifiedKelvin};
use serde::{Deserialize, Serialize};

/// `F + tau_eps F' = mu1 x + .. + muN x^N + tau_sig x x'`, `N` from 1 to 5.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "[f64; N]: Serialize", deserialize = "[f64; N]: Deserialize<'de>"))]
pub struct SeriesBody<const N: usize> {
    /// Relaxation time in s.
    pub tau_eps: f64,
    /// `mu1 ..= muN` in N/mm^k.
    pub mu: [f64; N],
    /// Coefficient of depth times speed, in N*s/mm^2.
    pub tau_sig: f64,
}

impl From<ModifiedKelvin> for SeriesBody<3> {
    fn from(body: ModifiedKelvin) -> Self {
        Self { tau_eps: body.tau_eps, mu: body.mu, tau_sig: body.tau_sig }
    }
}

impl<const N: usize> SeriesBody<N> {
    /// The body itself if its numbers describe one.
    pub fn checked(self) -> Result<Self, BodyError> {
        const { assert!(N >= 1 && N <= POWER_MAX) };
        const NAMES: [&str; POWER_MAX] = ["mu1", "mu2", "mu3", "mu4", "mu5"];
        let named = NAMES.into_iter().zip(self.mu);
        let bad = |name, value| BodyError { name, value };
        if !(self.tau_eps > 0.0 && self.tau_eps.is_finite()) {
            return Err(bad("tau_eps", self.tau_eps));
        }
        match named.chain([("tau_sig", self.tau_sig)]).find(|(_, value)| !value.is_finite()) {
            Some((name, value)) => Err(bad(name, value)),
            None => Ok(self),
        }
    }

    /// The same body with as many terms as there may be, those it has not as zeros: its steps give the
    /// same bits.
    pub fn padded(&self) -> SeriesBody<POWER_MAX> {
        let mut mu = [0.0; POWER_MAX];
        mu[..N].copy_from_slice(&self.mu);
        SeriesBody { tau_eps: self.tau_eps, mu, tau_sig: self.tau_sig }
    }

    /// As the one relaxation term it is.
    pub fn term(&self) -> RelaxationTerm {
        let mut elastic = DepthDrive::default();
        elastic.powers[..N].copy_from_slice(&self.mu);
        RelaxationTerm {
            tau: self.tau_eps,
            elastic,
            // x x' is the rate of x^2 / 2.
            rate: DepthDrive::power(2, 0.5 * self.tau_sig),
        }
    }
}
