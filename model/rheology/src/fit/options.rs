//! Which family a fit takes, and which of its parameters it may move.

use super::sample::FitError;
use crate::families::{Family, OuterRange, PowerSeries, UnknownFamily, find_family};
use std::ops::Range;
use std::sync::Arc;

/// Names of the parameters of the modified Kelvin body, in the order of every report.
pub const PARAMETER_NAMES: [&str; 8] =
    ["tau_eps", "mu1", "mu2", "mu3", "tau_sig", "f0", "f_offset", "x_contact"];

/// Units of the parameters, in the same order.
pub const PARAMETER_UNITS: [&str; 8] =
    ["s", "N/mm", "N/mm^2", "N/mm^3", "N*s/mm^2", "N", "N", "mm"];

/// Position of `tau_eps` in [`PARAMETER_NAMES`].
pub(super) const TAU: usize = 0;
/// Position of the first of the six linear parameters `mu1 ..= f_offset`.
pub(super) const LINEAR: usize = 1;
/// How many linear parameters there are.
pub(super) const LINEAR_COUNT: usize = 6;

/// A parameter that a fit of a family has.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct KnownParameter {
    pub name: String,
    pub unit: &'static str,
    /// Where an outer parameter of the family is searched.
    pub range: Option<OuterRange>,
    /// Whether it must not be negative.
    pub is_bound: bool,
}

/// Where the parameters of a family's fit stand: outer ones of the family, its coefficients, then what each
/// record has of its own, the initial force only where the family has one relaxation time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub outers: usize,
    pub coefficients: usize,
    pub fades: bool,
}

impl Layout {
    pub fn of(family: &dyn Family) -> Self {
        let outers = family.outer().len();
        Self {
            outers,
            coefficients: family.linear().len(),
            fades: family.fading(&vec![1.0; outers]).is_some(),
        }
    }

    /// Parameters in which the model is linear.
    pub fn linear(self) -> Range<usize> {
        self.outers..self.contact()
    }

    pub fn linear_count(self) -> usize {
        self.linear().len()
    }

    pub fn initial(self) -> Option<usize> {
        self.fades.then_some(self.outers + self.coefficients)
    }

    pub fn offset(self) -> usize {
        self.contact() - 1
    }

    pub fn contact(self) -> usize {
        self.outers + self.coefficients + usize::from(self.fades) + 1
    }

    pub fn count(self) -> usize {
        self.contact() + 1
    }

    /// Whether it is a parameter of the specimen, which records may share.
    pub fn is_body(self, parameter: usize) -> bool {
        parameter < self.outers + self.coefficients
    }
}

/// A family and, for every parameter, whether the fit finds it or keeps it at a value.
///
/// The default is the modified Kelvin body of third order. All parameters are found but `x_contact`, which stays
/// at 0: depth is counted from contact. No starting values exist: the fit searches for itself.
#[derive(Clone, Debug)]
pub struct FitOptions {
    pub(super) family: Arc<dyn Family>,
    pub(super) known: Vec<KnownParameter>,
    pub(super) layout: Layout,
    pub(super) fixed: Vec<Option<f64>>,
    pub(super) is_at_rest: bool,
    /// Whether the contact position is where depths count from for want of a better one, rather than by choice.
    pub(super) is_contact_assumed: bool,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self::of(Arc::new(PowerSeries::THESIS))
    }
}

impl PartialEq for FitOptions {
    fn eq(&self, other: &Self) -> bool {
        self.family.key() == other.family.key()
            && (&self.fixed, self.is_at_rest, self.is_contact_assumed)
                == (&other.fixed, other.is_at_rest, other.is_contact_assumed)
    }
}

impl FitOptions {
    /// A family with all its parameters free but `x_contact`.
    #[must_use]
    pub fn of(family: Arc<dyn Family>) -> Self {
        let layout = Layout::of(&*family);
        let outer = family.outer().into_iter().map(|one| KnownParameter {
            name: one.name,
            unit: one.unit,
            range: Some(one.range),
            is_bound: false,
        });
        let plain =
            |name: String, unit| KnownParameter { name, unit, range: None, is_bound: false };
        let linear = family.linear().into_iter().enumerate();
        let linear = linear.map(|(k, (name, unit))| KnownParameter {
            is_bound: family.is_non_negative(k),
            ..plain(name, unit)
        });
        let initial = layout.initial().map(|_| plain("f0".to_owned(), "N"));
        let own = [("f_offset", "N"), ("x_contact", "mm")];
        let own = own.map(|(name, unit)| plain(name.to_owned(), unit));
        let known: Vec<KnownParameter> = outer.chain(linear).chain(initial).chain(own).collect();
        let mut fixed = vec![None; known.len()];
        fixed[layout.contact()] = Some(0.0);
        Self { family, known, layout, fixed, is_at_rest: false, is_contact_assumed: true }
    }

    /// The family of a key such as `prony-2`.
    pub fn by_key(key: &str) -> Result<Self, UnknownFamily> {
        find_family(key).map(Self::of)
    }

    pub fn family(&self) -> &dyn Family {
        &*self.family
    }

    /// Names of all parameters, in the order of every report.
    pub fn names(&self) -> Vec<&str> {
        self.known.iter().map(|one| one.name.as_str()).collect()
    }

    /// The unit of a parameter, if the fit has it.
    pub fn unit(&self, name: &str) -> Option<&'static str> {
        self.known.iter().find(|one| one.name == name).map(|one| one.unit)
    }

    /// Names of the parameters of the specimen: what records may share.
    pub fn body_names(&self) -> Vec<&str> {
        let mut names = self.names();
        names.truncate(self.layout.outers + self.layout.coefficients);
        names
    }

    /// Keeps a parameter at `value`, in its unit.
    pub fn fix(&mut self, name: &str, value: f64) -> Result<(), FitError> {
        let index = self.index_of(name)?;
        let bad = |reason| FitError::BadValue { name: name.to_owned(), value, reason };
        if !value.is_finite() {
            return Err(bad("give a finite number"));
        }
        match self.known[index].range {
            Some(OuterRange::Time) if value <= 0.0 => {
                return Err(bad("a relaxation time must be greater than zero"));
            }
            Some(range) => range.allows(value).map_err(bad)?,
            None => {}
        }
        self.fixed[index] = Some(value);
        self.is_contact_assumed &= index != self.layout.contact();
        Ok(())
    }

    /// Lets the fit find a parameter.
    pub fn free(&mut self, name: &str) -> Result<(), FitError> {
        let index = self.index_of(name)?;
        self.fixed[index] = None;
        self.is_contact_assumed &= index != self.layout.contact();
        Ok(())
    }

    /// Takes the body to be relaxed at the first depth of a record: no initial force is found.
    #[must_use]
    pub fn at_rest(mut self) -> Self {
        if let Some(initial) = self.layout.initial() {
            self.fixed[initial] = Some(0.0);
        }
        self.is_at_rest = true;
        self
    }

    /// How many parameters the fit finds.
    pub fn free_count(&self) -> usize {
        self.fixed.iter().filter(|value| value.is_none()).count()
    }

    pub(super) fn index_of(&self, name: &str) -> Result<usize, FitError> {
        let place = self.known.iter().position(|known| known.name == name);
        place.ok_or_else(|| FitError::UnknownParameter {
            name: name.to_owned(),
            known: self.names().join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_frees_all_but_the_contact() {
        let mut options = FitOptions::default();
        assert_eq!(options.names(), PARAMETER_NAMES);
        assert_eq!(options.free_count(), 7);
        assert_eq!(options.fixed[7], Some(0.0));
        options.free("x_contact").unwrap();
        options.fix("tau_eps", 1.5).unwrap();
        assert_eq!(options.free_count(), 7);
        assert_eq!(options.fixed[TAU], Some(1.5));
    }

    #[test]
    fn unknown_names_and_impossible_values_are_refused() {
        let mut options = FitOptions::default();
        let text = options.fix("mu9", 1.0).unwrap_err().to_string();
        assert!(text.contains("'mu9'") && text.contains("mu1, mu2"), "{text}");
        assert!(options.fix("tau_eps", 0.0).is_err());
        assert!(options.fix("mu1", f64::NAN).is_err());
        assert_eq!(options, FitOptions::default());
        // Several relaxation times have no one time in which a force could fade.
        assert!(FitOptions::by_key("prony-2").unwrap().free("f0").is_err());
        assert!(FitOptions::by_key("fractional").unwrap().fix("alpha", 2.0).is_err());
    }
}
