//! What a person says about a fit: the family by its key, parameters by their names.

use palpate_rheology::families::UnknownFamily;
use palpate_rheology::fit::{FitError, FitOptions};
use thiserror::Error;

/// A family and which of its parameters are found, in words.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitChoice {
    /// Key of a model family; `None` is the modified Kelvin model.
    pub family: Option<String>,
    /// Parameters held, with their values.
    pub fixed: Vec<(String, f64)>,
    /// Parameters found that are held by default.
    pub free: Vec<String>,
}

#[derive(Debug, Error)]
pub enum FitChoiceError {
    #[error(transparent)]
    Family(#[from] UnknownFamily),
    #[error(transparent)]
    Parameter(#[from] FitError),
    #[error("{0} is given twice; give it once")]
    Twice(String),
}

impl FitChoice {
    pub fn options(&self) -> Result<FitOptions, FitChoiceError> {
        let mut options = match &self.family {
            Some(key) => FitOptions::by_key(key)?,
            None => FitOptions::default(),
        };
        let held = self.fixed.iter().map(|(name, _)| name.trim());
        let mut names: Vec<&str> = self.free.iter().map(|name| name.trim()).chain(held).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(FitChoiceError::Twice(pair[0].to_owned()));
        }
        for name in &self.free {
            options.free(name.trim())?;
        }
        for (name, value) in &self.fixed {
            options.fix(name.trim(), *value)?;
        }
        Ok(options)
    }
}
