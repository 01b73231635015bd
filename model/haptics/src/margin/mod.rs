//! The stability margin: damping that a device needs to render a body, before use and in every tick.
//!
//! With `k0 = g'(x0)`, `c0 = tau_sig x0`, `k_inf = c0 / tau_eps`, tick `T` and a delay of `d` ticks, the body about depth
//! `x0`, stepped exactly, needs `b >= max(k0 (T/2 + d T + tau_eps) - c0, k_inf (T/2 + d T))` (from the criterion in
//! [`criterion`], which the tests compare with it). The first term has a part without `T`, `k0 tau_eps - c0`: where it is
//! above zero the lag of the body itself returns energy, and no faster loop mends that.
//!
//! An encoder of step `D` lets a wall of stiffness `K` return `K D^2 / 2` unseen with every count, and Coulomb friction
//! `f` takes `f D`: no buzz if `K <= 2 f / D` (Abbott & Okamura, IEEE Trans. Robotics 21 (2005) 952-964, who have
//! `K <= min(2 b / T, 2 f / D)` for a spring; here `K` is the larger stiffness of slow and of sudden moves).

mod bands;
pub mod criterion;
mod linear;

pub use bands::{DepthBand, active_cycles, active_pokes};
pub use linear::{LinearisedBody, SampledStep};

use super::Period;
use palpate_model::units::{Depth, MmPerS, Newtons};
use palpate_rheology::families::POWER_MAX;
use palpate_rheology::integrators::{Scheme, SeriesBody};
use serde::{Deserialize, Serialize};

/// Properties of a device that the stability margin depends on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopDevice {
    /// Its own damping in N s/mm; a voltage drive adds its motor's.
    pub damping: f64,
    pub friction: Newtons,
    /// Step of its encoder at the handle, in mm.
    pub count_mm: f64,
    /// Ticks from a count to the force made of it, in addition to the half tick that holding costs.
    pub delay_ticks: f64,
}

/// Depths looked at before play: 0.03 mm apart on the 30 mm stroke, as the shallow bands are below 1 mm.
const DEPTHS: u32 = 1000;

/// Everything the margin depends on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarginSettings {
    pub body: SeriesBody<POWER_MAX>,
    pub scheme: Scheme,
    pub period: Period,
    pub device: LoopDevice,
}

/// Why damping is needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MarginCause {
    /// The body's own lag: it needs this much at any tick.
    #[default]
    Lag,
    /// Tick and delay, in slow motion.
    Tick,
    /// Tick and delay, in sudden motion, which feels the stiffness `k_inf`.
    Sudden,
}

/// The margin at one depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Margin {
    pub depth: Depth,
    /// Damping needed there in N s/mm; zero or less where the body brings its own.
    pub needed: f64,
    /// Damping the device has, in N s/mm.
    pub has: f64,
    /// Why so much.
    pub cause: MarginCause,
    /// Friction needed against a buzz of a count or so.
    pub friction_needed: Newtons,
    pub friction: Newtons,
}

impl Margin {
    /// Damping there is over damping needed; `None` where none is needed.
    pub fn ratio(&self) -> Option<f64> {
        (self.needed > 0.0).then(|| self.has / self.needed)
    }

    /// Whether the device has the damping needed.
    pub fn is_enough(&self) -> bool {
        self.needed <= self.has
    }

    /// Whether friction is enough that single counts do not swing by themselves.
    pub fn is_quiet(&self) -> bool {
        self.friction_needed <= self.friction
    }
}

impl MarginSettings {
    /// The margin at a depth and speed; for every tick.
    pub fn at(&self, depth: Depth, speed: MmPerS) -> Margin {
        let tick = self.period.seconds().0;
        let linear = LinearisedBody::of(&self.body, depth);
        let sampled = SampledStep::of(&linear, self.scheme, tick);
        let delay = self.device.delay_ticks.max(0.0);
        let moving = self.moving(speed);
        let slow = sampled.slow() + linear.stiffness * delay * tick + moving;
        let sudden = sampled.fast() * (1.0 + 2.0 * delay);
        let lag = linear.lag();
        let cause = if sudden > slow {
            MarginCause::Sudden
        } else if lag > 0.5 * slow {
            MarginCause::Lag
        } else {
            MarginCause::Tick
        };
        let half_count = 0.5 * self.device.count_mm;
        Margin {
            depth,
            needed: slow.max(sudden),
            has: self.device.damping,
            cause,
            friction_needed: Newtons(sampled.per_count() * half_count),
            friction: self.device.friction,
        }
    }

    /// The same with the whole criterion instead of its two ends, which with a delay are up to a few times too
    /// careful. For before play: it looks at some hundreds of frequencies.
    pub fn exact_margin_at(&self, depth: Depth, speed: MmPerS) -> Margin {
        if self.device.delay_ticks <= 0.0 {
            return self.at(depth, speed);
        }
        let linear = LinearisedBody::of(&self.body, depth);
        let sampled = SampledStep::of(&linear, self.scheme, self.period.seconds().0);
        let (needed, _) = criterion::damping_needed(&sampled, self.device.delay_ticks.max(0.0));
        Margin { needed: needed + self.moving(speed), ..self.at(depth, speed) }
    }

    /// Damping that tick and delay ask for where the probe moves in, in N s/mm: the viscous term `tau_sig x x'` then
    /// has a stiffness of `tau_sig v` in addition to its damping. It counts for the tick alone; over a relaxation time the
    /// probe is elsewhere, and the term is the rate of `tau_sig x^2 / 2`, which no loop lives on.
    fn moving(&self, speed: MmPerS) -> f64 {
        let inwards = speed.0.max(0.0) * self.body.tau_sig.max(0.0);
        let late = 0.5 + self.device.delay_ticks.max(0.0);
        inwards * late * self.period.seconds().0
    }

    /// Margins over a stroke, from the surface to `deepest`, at a speed.
    fn over(&self, deepest: Depth, speed: MmPerS) -> impl Iterator<Item = Margin> {
        let at = move |i: u32| Depth(deepest.0 * f64::from(i) / f64::from(DEPTHS));
        (0..=DEPTHS).map(move |i| self.exact_margin_at(at(i), speed))
    }

    /// The margin over a stroke to `deepest`, entered at up to `speed`, before the device is used.
    pub fn assess_stroke(&self, deepest: Depth, speed: MmPerS) -> MarginReport {
        let all = || self.over(deepest, speed).chain(self.over(deepest, MmPerS(0.0)));
        let worst = |more: fn(&Margin, &Margin) -> bool| {
            all().fold(self.at(Depth(0.0), MmPerS(0.0)), |worst, one| {
                if more(&one, &worst) { one } else { worst }
            })
        };
        MarginReport {
            worst: worst(|one, worst| one.needed > worst.needed),
            loudest: worst(|one, worst| one.friction_needed > worst.friction_needed),
            bands: bands::where_above(deepest, DEPTHS, |depth| {
                self.exact_margin_at(depth, speed).needed - self.device.damping
            }),
            cycles: active_cycles(&self.body, deepest),
            pokes: active_pokes(&self.body, deepest),
            deepest,
        }
    }
}

/// The margin before play.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MarginReport {
    /// The margin where most damping is needed.
    pub worst: Margin,
    /// The margin where most friction is needed.
    pub loudest: Margin,
    /// Depths at which the device has less damping than needed.
    pub bands: Vec<DepthBand>,
    /// Depths around which small slow cycles of the body return energy.
    pub cycles: Vec<DepthBand>,
    /// Depths to which slow pokes return energy.
    pub pokes: Vec<DepthBand>,
    /// End of the stroke looked at.
    pub deepest: Depth,
}

impl MarginReport {
    /// Damping there is over damping needed, at the worst depth; `None` where none is needed.
    pub fn ratio(&self) -> Option<f64> {
        self.worst.ratio()
    }

    /// Whether nothing on the stroke can return energy that the device does not take.
    pub fn is_calm(&self) -> bool {
        self.worst.is_enough() && self.loudest.is_quiet()
    }

    /// In words, the most important first.
    pub fn sentences(&self) -> Vec<String> {
        let mut all = vec![self.damping_sentence()];
        if !self.bands.is_empty() {
            all.push(format!(
                "The damping is too small at depths {}; the energy guard adds what is missing there.",
                bands::words(&self.bands, self.deepest)
            ));
        }
        let Margin { depth, friction_needed, friction, .. } = self.loudest;
        all.push(if self.loudest.is_quiet() {
            format!("A friction of {friction:.3} suppresses limit cycles of one or two encoder counts.")
        } else {
            format!(
                "A limit cycle of one or two encoder counts is possible at a depth of {depth:.1}: a friction of {friction_needed:.3} is needed to suppress it, but the device has {friction:.3}. A finer encoder needs less friction."
            )
        });
        if !self.cycles.is_empty() {
            all.push(format!(
                "In small slow cycles at depths {}, the model returns more energy than it receives.",
                bands::words(&self.cycles, self.deepest)
            ));
        }
        if !self.pokes.is_empty() {
            all.push(format!(
                "In a slow press to depths {} and back, the model returns more energy than it receives.",
                bands::words(&self.pokes, self.deepest)
            ));
        }
        all
    }

    fn damping_sentence(&self) -> String {
        let Margin { depth, needed, has, cause, .. } = self.worst;
        // N s/mm as N s/m, which is what catalogues have.
        let (needed_si, has_si) = (needed * 1e3, has * 1e3);
        let Some(ratio) = self.ratio() else {
            return "The model itself dissipates enough energy; the device needs no damping."
                .into();
        };
        let why = match cause {
            MarginCause::Lag => {
                "this damping is needed because of the model's relaxation; a faster loop would not need less"
            }
            MarginCause::Tick => {
                "this damping is needed because of the loop's period and delay; a faster loop would need less"
            }
            MarginCause::Sudden => {
                "this damping is needed because of sudden moves; a faster loop or a shorter delay would need less"
            }
        };
        if self.worst.is_enough() {
            format!(
                "The device has {ratio:.2} times the damping needed: it has {has_si:.2} N s/m and needs {needed_si:.2} N s/m at a depth of {depth:.1}."
            )
        } else {
            format!(
                "The device has {ratio:.2} times the damping needed: it has {has_si:.2} N s/m and needs {needed_si:.2} N s/m at a depth of {depth:.1}; {why}."
            )
        }
    }
}
