//! One sine: from the stiffness that was measured to the moduli, and what makes them uncertain.

use super::DynamicError;
use palpate_indentation::{ContactLaw, Indenter, Specimen, load_and_slope, vary_uncertain_numbers};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::units::Newtons;
use palpate_rheology::cycles::Sinusoid;
use std::f64::consts::TAU;

/// A cone's moduli are up to 4 % too low here, because the contact shrinks on the way back; a flat punch has no such limit.
pub(super) const AMPLITUDE_OVER_DEPTH_MAX: f64 = 0.05;
/// Moduli are too low by up to this times amplitude over depth times the exponent of the law less one (compared with the force of
/// a contact that grows and shrinks).
const SHRINKING: f64 = 0.75;

/// Sources of uncertainty that differ from sine to sine, from session to session, or with the calibration.
pub(super) const RESIDUALS: &str = "residuals";
pub(super) const CONTACT: &str = "contact";
pub(super) const SHRINKING_CONTACT: &str = "shrinking contact";
pub(super) const CALIBRATION: &str = "calibration";

/// A smaller share of a modulus is rounding.
const ROUNDING: f64 = 1e-12;

/// Storage and loss of Young's modulus and of the shear modulus in MPa, and tan delta.
pub(super) type Moduli = [f64; 5];

/// A sine on a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct SineContact {
    pub law: ContactLaw,
    pub indenter: Indenter,
    pub specimen: Specimen,
    /// In phase with the slide and a quarter of a cycle ahead.
    pub stiffness_n_per_mm: [f64; 2],
    pub frequency_hz: f64,
    /// Mean depth of the slide from the contact.
    pub depth_mm: f64,
    /// Mean force.
    pub force_n: f64,
    /// Zero leaves the machine as it is.
    pub compliance_mm_per_n: f64,
    pub moving_mass_g: f64,
}

/// Standard uncertainties of what is not in the law; `None` where it is not known.
pub(super) struct SineUncertainty {
    pub contact_error_mm: Option<f64>,
    pub calibration: Option<ForceUncertainty>,
    pub compliance_error_mm_per_n: Option<f64>,
    pub moving_mass_error_g: Option<f64>,
}

impl SineContact {
    /// Mean depth of the probe.
    pub fn probe_depth(&self) -> f64 {
        self.depth_mm - self.compliance_mm_per_n * self.force_n
    }

    /// Machine and contact are in series, so their compliances add as complex numbers; the cell moves the mass as well as the
    /// specimen, so it feels the mass times its acceleration less.
    pub fn moduli(&self) -> Result<Moduli, DynamicError> {
        self.moduli_over(self.slope()?)
    }

    /// Of the law at the mean depth, over Young's modulus, in mm.
    fn slope(&self) -> Result<f64, DynamicError> {
        Ok(load_and_slope(self.law, &self.indenter, &self.specimen, self.probe_depth())?[1])
    }

    fn moduli_over(&self, slope: f64) -> Result<Moduli, DynamicError> {
        let [storage, loss] = inverse(self.stiffness_n_per_mm);
        let [storage, loss] = inverse([storage - self.compliance_mm_per_n, loss]);
        // g/s² is 1e-6 N/mm.
        let inertia = 1e-6 * self.moving_mass_g * (TAU * self.frequency_hz).powi(2);
        // A cell that accelerates a mass may well feel a negative stiffness, a specimen has none.
        if storage + inertia <= 0.0 {
            return Err(DynamicError::TooCompliant { frequency_hz: self.frequency_hz });
        }
        let [storage, loss] = [(storage + inertia) / slope, loss / slope];
        let shear = 0.5 / (1.0 + self.specimen.poisson_ratio.value);
        Ok([storage, loss, shear * storage, shear * loss, loss / storage])
    }

    /// Amplitude in mm over the mean depth, which the law must hold around.
    pub fn check_amplitude(&self, amplitude: f64) -> Result<(), DynamicError> {
        let depth = self.probe_depth();
        self.law.contact(&self.indenter, &self.specimen, depth + amplitude)?;
        let share = amplitude / depth;
        let is_small = (0.0..=AMPLITUDE_OVER_DEPTH_MAX).contains(&share);
        match is_small || matches!(self.indenter, Indenter::FlatPunch { .. }) {
            true => Ok(()),
            false => Err(DynamicError::Amplitude { frequency_hz: self.frequency_hz, share }),
        }
    }

    /// The exponent of the law about the mean depth.
    fn exponent(&self) -> Result<f64, DynamicError> {
        let depth = self.probe_depth();
        let [load, slope] = load_and_slope(self.law, &self.indenter, &self.specimen, depth)?;
        Ok(depth * slope / load)
    }

    /// Half of what the higher case is above the lower; where one is beyond the law, what the other differs by from this one.
    fn effect(&self, low: Self, high: Self) -> Result<Moduli, DynamicError> {
        Ok(match (low.moduli(), high.moduli()) {
            (Ok(low), Ok(high)) => difference(low, high, 0.5),
            (Ok(low), Err(_)) => difference(low, self.moduli()?, 1.0),
            (Err(_), Ok(high)) => difference(self.moduli()?, high, 1.0),
            (Err(err), Err(_)) => return Err(err),
        })
    }

    fn scaled(self, factor: f64) -> Self {
        let stiffness_n_per_mm = self.stiffness_n_per_mm.map(|part| factor * part);
        Self { stiffness_n_per_mm, ..self }
    }
}

impl SineUncertainty {
    pub fn not_included(&self) -> Vec<&'static str> {
        let known = [
            ("contact", self.contact_error_mm.is_some()),
            ("calibration", self.calibration.is_some()),
            ("machine compliance", self.compliance_error_mm_per_n.is_some()),
            ("moving mass", self.moving_mass_error_g.is_some()),
        ];
        known.into_iter().filter(|(_, is_known)| !is_known).map(|(name, _)| name).collect()
    }

    /// What each independent error changes in the moduli; those of a source stand together.
    pub fn effects(
        &self,
        sine: &SineContact,
        found: &Sinusoid,
    ) -> Result<Vec<(&'static str, Moduli)>, DynamicError> {
        let about = |change: &dyn Fn(&mut SineContact, f64)| {
            let [low, high] = [-1.0, 1.0].map(|sign| {
                let mut other = *sine;
                change(&mut other, sign);
                other
            });
            sine.effect(low, high)
        };
        let in_phase =
            about(&|one, sign| one.stiffness_n_per_mm[0] += sign * found.storage.std_error)?;
        let ahead = about(&|one, sign| one.stiffness_n_per_mm[1] += sign * found.loss.std_error)?;
        let mut effects = vec![(RESIDUALS, in_phase), (RESIDUALS, ahead)];
        if let Some(error) = self.contact_error_mm {
            effects.push((CONTACT, about(&|one, sign| one.depth_mm += sign * error)?));
        }
        for (term, both) in vary_uncertain_numbers(&sine.indenter, &sine.specimen) {
            let [low, high] =
                both.map(|(indenter, specimen)| SineContact { indenter, specimen, ..*sine });
            effects.push((term.name(), sine.effect(low, high)?));
        }
        if let Some(known) = &self.calibration {
            effects.extend(calibration_effects(known, sine, found)?);
        }
        if let Some(error) = self.compliance_error_mm_per_n {
            let effect = about(&|one, sign| one.compliance_mm_per_n += sign * error)?;
            effects.push(("machine compliance", effect));
        }
        if let Some(error) = self.moving_mass_error_g {
            effects.push(("moving mass", about(&|one, sign| one.moving_mass_g += sign * error)?));
        }
        // Anywhere between nothing and the most with the same probability (JCGM 100:2008, 4.3.7).
        let share = found.depth_amplitude.0 / sine.probe_depth();
        let low_by = SHRINKING * (sine.exponent()? - 1.0).max(0.0) * share / 3f64.sqrt();
        let [storage, loss, shear_storage, shear_loss, tan_delta] = sine.moduli()?;
        let shrinking =
            [storage, loss, shear_storage, shear_loss, tan_delta].map(|one| low_by * one.abs());
        effects.push((SHRINKING_CONTACT, shrinking));
        Ok(effects)
    }
}

/// An error of the calibration curve is one of its slope over the force that the sine spans.
fn calibration_effects(
    known: &ForceUncertainty,
    sine: &SineContact,
    found: &Sinusoid,
) -> Result<Vec<(&'static str, Moduli)>, DynamicError> {
    let amplitude = found.force_amplitude.value.0;
    let shift = |error: usize, force: f64| known.shift(error, Newtons(force)).0;
    // One slope for all: an error of force moves no contact.
    let slope = sine.slope()?;
    let effect = |error: usize| {
        let [low, high] = [-1.0, 1.0].map(|sign| shift(error, sine.force_n + sign * amplitude));
        let gain = 0.5 * (high - low) / amplitude;
        let [low, high] = [1.0 - gain, 1.0 + gain].map(|factor| sine.scaled(factor));
        Ok((CALIBRATION, difference(low.moduli_over(slope)?, high.moduli_over(slope)?, 0.5)))
    };
    (0..known.errors().count()).map(effect).collect()
}

fn difference(one: Moduli, other: Moduli, share: f64) -> Moduli {
    std::array::from_fn(|number| {
        let change = share * (other[number] - one[number]);
        if change.abs() > ROUNDING * one[number].abs() { change } else { 0.0 }
    })
}

pub(super) fn root_of_squares(effects: &[(&'static str, Moduli)]) -> Moduli {
    std::array::from_fn(|number| {
        effects.iter().map(|(_, effect)| effect[number].powi(2)).sum::<f64>().sqrt()
    })
}

/// One over a complex number.
fn inverse([real, imaginary]: [f64; 2]) -> [f64; 2] {
    let square = real * real + imaginary * imaginary;
    [real / square, -imaginary / square]
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_indentation::{Base, PoissonBasis, Quantity};

    fn exact(value: f64) -> Quantity {
        Quantity { value, standard_uncertainty: 0.0 }
    }

    /// A punch on a Maxwell element with a machine that gives way and a mass, written down as forces and motions: the slide moves by
    /// 1 mm, the cell's force bends the machine, and accelerates the mass.
    #[test]
    fn machine_and_mass_are_taken_away_exactly() {
        let (radius, poisson, modulus, time) = (2.0, 0.45, 0.03, 0.2);
        let (compliance, mass) = (0.4, 150.0);
        for frequency in [0.1, 1.0, 12.0] {
            let angle: f64 = TAU * frequency * time;
            let young = [angle * angle, angle].map(|part| modulus * part / (1.0 + angle * angle));
            let slope = 2.0 * radius / (1.0 - poisson * poisson);
            // The cell feels the specimen, less what accelerates the mass: m w^2 in kg/s² is 1e-3 N/mm.
            let inertia = 1e-3 * mass * 1e-3 * (TAU * frequency).powi(2);
            let cell = [slope * young[0] - inertia, slope * young[1]];
            // The probe moves by 1 mm less the bend: force over slide is k / (1 + C k).
            let under = [1.0 + compliance * cell[0], compliance * cell[1]];
            let square = under[0].powi(2) + under[1].powi(2);
            let measured = [
                (cell[0] * under[0] + cell[1] * under[1]) / square,
                (cell[1] * under[0] - cell[0] * under[1]) / square,
            ];
            let sine = SineContact {
                law: ContactLaw::Sneddon,
                indenter: Indenter::FlatPunch { radius_mm: exact(radius) },
                specimen: Specimen {
                    thickness_mm: exact(500.0),
                    base: Base::Bonded,
                    poisson_ratio: exact(poisson),
                    poisson_basis: PoissonBasis::Assumed,
                },
                stiffness_n_per_mm: measured,
                frequency_hz: frequency,
                depth_mm: 0.2,
                force_n: 0.01,
                compliance_mm_per_n: compliance,
                moving_mass_g: mass,
            };
            let found = sine.moduli().unwrap();
            assert!((found[0] - young[0]).abs() < 1e-12, "{frequency}: {found:?} {young:?}");
            assert!((found[1] - young[1]).abs() < 1e-12, "{frequency}: {found:?} {young:?}");
            assert!((found[2] / found[0] - 1.0 / 2.9).abs() < 1e-12);
            // A Maxwell element's tan delta is 1 / (w tau).
            assert!((found[4] * angle - 1.0).abs() < 1e-9, "{frequency}: {found:?}");
        }
    }
}
