//! The body about a depth, and what a sampled step makes of it.

use palpate_model::units::Depth;
use palpate_rheology::families::POWER_MAX;
use palpate_rheology::integrators::{RuleWeights, Scheme, SeriesBody};

/// The body for small motions about a depth: `tau F' + F = stiffness x + damping x'`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearisedBody {
    /// `k0 = g'(x0)` in N/mm: stiffness of slow motions.
    pub stiffness: f64,
    /// `c0 = tau_sig x0` in N s/mm.
    pub damping: f64,
    /// `tau_eps` in s.
    pub tau: f64,
}

impl LinearisedBody {
    /// Of a body at a depth.
    #[must_use]
    pub fn of(body: &SeriesBody<POWER_MAX>, depth: Depth) -> Self {
        let x = depth.0.max(0.0);
        let powers = (1..=POWER_MAX).rev().zip(body.mu.iter().rev());
        let slope = powers.fold(0.0, |sum, (k, mu)| sum * x + k as f64 * mu);
        Self { stiffness: slope, damping: body.tau_sig * x, tau: body.tau_eps }
    }

    /// Damping in N s/mm that the lag alone takes, at any tick: `k0 tau - c0`.
    pub fn lag(&self) -> f64 {
        self.stiffness * self.tau - self.damping
    }
}

/// `F(+) = keep F + now x(+) + before x`: a step of length `tick` as a transfer function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledStep {
    /// Tick in s.
    pub tick: f64,
    /// Share of the force that goes: `1 - keep`.
    pub share: f64,
    /// Of the new depth, in N/mm.
    pub now: f64,
    /// Of the depth before, in N/mm.
    pub before: f64,
    /// Their sum, `stiffness * share`, without the cancellation of large rates.
    pub both: f64,
}

impl SampledStep {
    /// Of a body by a scheme, its speed the difference of two depths, as the integrators take it.
    #[must_use]
    pub fn of(linear: &LinearisedBody, scheme: Scheme, tick: f64) -> Self {
        if linear.tau <= 0.0 {
            let rate = linear.damping / tick;
            return Self {
                tick,
                share: 1.0,
                now: linear.stiffness + rate,
                before: -rate,
                both: linear.stiffness,
            };
        }
        let RuleWeights { forcing, share } = scheme.weights(tick / linear.tau);
        let [left, middle, right] = forcing;
        let all = left + middle + right;
        let rate = linear.damping / tick;
        Self {
            tick,
            share,
            now: (right + 0.5 * middle) * linear.stiffness + all * rate,
            before: (left + 0.5 * middle) * linear.stiffness - all * rate,
            both: all * linear.stiffness,
        }
    }

    /// Damping in N s/mm that slow motions need, by the criterion's limit at `theta = 0`.
    pub fn slow(&self) -> f64 {
        // With q = e^{-j theta} = 1 - j theta + .. : H = H(1) + j theta h, and the limit is T/2 (H(1) - 2 h).
        let keep = 1.0 - self.share;
        let at_rest = self.both / self.share;
        let h = (-self.before - at_rest * keep) / self.share;
        0.5 * self.tick * (at_rest - 2.0 * h)
    }

    /// Damping in N s/mm that the fastest motions need, which change at every tick: the criterion at
    /// `theta = pi`.
    pub fn fast(&self) -> f64 {
        0.5 * self.tick * (self.now - self.before) / (2.0 - self.share)
    }

    /// Force in N/mm that one count more changes at once and in the end, the larger.
    pub fn per_count(&self) -> f64 {
        self.now.abs().max((self.both / self.share).abs())
    }
}
