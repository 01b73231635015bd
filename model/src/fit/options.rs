//! Which parameters a fit may move.

use super::sample::FitError;

/// Names of the parameters, in the order of every report.
pub const PARAMETER_NAMES: [&str; 8] = [
    "tau_eps",
    "mu1",
    "mu2",
    "mu3",
    "tau_sig",
    "f0",
    "f_offset",
    "x_contact",
];

/// Units of the parameters, in the same order.
pub const PARAMETER_UNITS: [&str; 8] =
    ["s", "N/mm", "N/mm^2", "N/mm^3", "N*s/mm^2", "N", "N", "mm"];

/// Position of `tau_eps` in [`PARAMETER_NAMES`].
pub(super) const TAU: usize = 0;
/// Position of the first of the six linear parameters `mu1 ..= f_offset`.
pub(super) const LINEAR: usize = 1;
/// How many linear parameters there are.
pub(super) const LINEAR_COUNT: usize = 6;
/// Position of `x_contact`.
pub(super) const CONTACT: usize = 7;

/// For every parameter, whether the fit finds it or keeps it at a value.
///
/// The default finds all but `x_contact`, which stays at 0: depth is counted from contact. No
/// starting values exist: the fit searches for itself.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    fixed: [Option<f64>; 8],
}

impl Default for FitOptions {
    fn default() -> Self {
        let mut fixed = [None; 8];
        fixed[CONTACT] = Some(0.0);
        Self { fixed }
    }
}

impl FitOptions {
    /// Keeps a parameter at `value`, in its unit of [`PARAMETER_UNITS`].
    pub fn fix(&mut self, name: &str, value: f64) -> Result<(), FitError> {
        let index = index_of(name)?;
        let bad = |reason| FitError::BadValue {
            name: name.to_owned(),
            value,
            reason,
        };
        if !value.is_finite() {
            return Err(bad("give a finite number"));
        }
        if index == TAU && value <= 0.0 {
            return Err(bad("a relaxation time is greater than zero"));
        }
        self.fixed[index] = Some(value);
        Ok(())
    }

    /// Lets the fit find a parameter.
    pub fn free(&mut self, name: &str) -> Result<(), FitError> {
        self.fixed[index_of(name)?] = None;
        Ok(())
    }

    /// The value a parameter is kept at, `None` if the fit finds it.
    pub fn fixed_value(&self, name: &str) -> Result<Option<f64>, FitError> {
        Ok(self.fixed[index_of(name)?])
    }

    /// Fixed values in the order of [`PARAMETER_NAMES`].
    pub(super) fn fixed(&self) -> &[Option<f64>; 8] {
        &self.fixed
    }

    /// How many parameters the fit finds.
    #[must_use]
    pub fn free_count(&self) -> usize {
        self.fixed.iter().filter(|value| value.is_none()).count()
    }
}

fn index_of(name: &str) -> Result<usize, FitError> {
    PARAMETER_NAMES
        .iter()
        .position(|&known| known == name)
        .ok_or_else(|| FitError::UnknownParameter {
            name: name.to_owned(),
            known: PARAMETER_NAMES.join(", "),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_frees_all_but_the_contact() {
        let mut options = FitOptions::default();
        assert_eq!(options.free_count(), 7);
        assert_eq!(options.fixed_value("x_contact"), Ok(Some(0.0)));
        options.free("x_contact").unwrap();
        options.fix("tau_eps", 1.5).unwrap();
        assert_eq!(options.free_count(), 7);
        assert_eq!(options.fixed_value("tau_eps"), Ok(Some(1.5)));
    }

    #[test]
    fn refuses_in_words() {
        let mut options = FitOptions::default();
        let text = options.fix("mu9", 1.0).unwrap_err().to_string();
        assert!(
            text.contains("'mu9'") && text.contains("mu1, mu2"),
            "{text}"
        );
        assert!(options.fix("tau_eps", 0.0).is_err());
        assert!(options.fix("mu1", f64::NAN).is_err());
        assert_eq!(options, FitOptions::default());
    }
}
