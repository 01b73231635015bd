//! Variables and arrays.

use super::expression::NAME_MAX;
use super::model::GalilModel;
use palpate_drivers::galil::ErrorCode;
use std::collections::BTreeMap;

/// Arrays at once (DMC-40x0 user manual: "up to 30 arrays").
const ARRAYS_MAX: usize = 30;

/// What a program and its clients keep.
#[derive(Clone, Debug, Default)]
pub struct ControllerMemory {
    variables: BTreeMap<String, f64>,
    arrays: BTreeMap<String, Vec<f64>>,
}

/// Whether a text can name a variable or an array.
pub fn is_name(text: &str) -> bool {
    text.len() <= NAME_MAX
        && text.starts_with(|first: char| first.is_ascii_alphabetic())
        && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

impl ControllerMemory {
    pub fn variable(&self, name: &str) -> Option<f64> {
        self.variables.get(name).copied()
    }

    /// Sets a variable, which may be new.
    pub fn set(&mut self, name: &str, value: f64, model: GalilModel) -> Result<(), ErrorCode> {
        if !is_name(name) || self.arrays.contains_key(name) {
            return Err(ErrorCode::VARIABLE);
        }
        if let Some(known) = self.variables.get_mut(name) {
            *known = value;
            return Ok(());
        }
        if self.variables.len() >= model.variables() {
            return Err(ErrorCode::TOO_MANY_NAMES);
        }
        self.variables.insert(name.to_owned(), value);
        Ok(())
    }

    /// Variables with their values.
    pub fn variables(&self) -> impl Iterator<Item = (&String, f64)> {
        self.variables.iter().map(|(name, value)| (name, *value))
    }

    /// Arrays with their lengths.
    pub fn arrays(&self) -> impl Iterator<Item = (&String, usize)> {
        self.arrays.iter().map(|(name, all)| (name, all.len()))
    }

    /// `DM`: a new array of zeros.
    pub fn dimension(
        &mut self,
        name: &str,
        length: f64,
        model: GalilModel,
    ) -> Result<(), ErrorCode> {
        if !is_name(name) || self.variables.contains_key(name) {
            return Err(ErrorCode::VARIABLE);
        }
        if length < 1.0 {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        if self.arrays.len() >= ARRAYS_MAX && !self.arrays.contains_key(name) {
            return Err(ErrorCode::TOO_MANY_NAMES);
        }
        let old = self.arrays.get(name).map_or(0, Vec::len);
        if length > (self.free(model) + old) as f64 {
            return Err(ErrorCode::ARRAY_SPACE);
        }
        self.arrays.insert(name.to_owned(), vec![0.0; length as usize]);
        Ok(())
    }

    /// Elements that are not in an array yet.
    pub fn free(&self, model: GalilModel) -> usize {
        let taken: usize = self.arrays.values().map(Vec::len).sum();
        model.array_elements().saturating_sub(taken)
    }

    /// `DA` of one name or of all arrays or variables.
    pub fn deallocate(&mut self, name: &str) -> Result<(), ErrorCode> {
        match name {
            "*" => self.variables.clear(),
            "*[]" | "*[0]" => self.arrays.clear(),
            _ => {
                let is_gone = match name.split_once('[') {
                    Some((array, _)) => self.arrays.remove(array).is_some(),
                    None => self.variables.remove(name).is_some(),
                };
                if !is_gone {
                    return Err(ErrorCode::NO_ARRAY);
                }
            }
        }
        Ok(())
    }

    pub fn array(&self, name: &str) -> Result<&[f64], ErrorCode> {
        self.arrays.get(name).map(Vec::as_slice).ok_or(ErrorCode::NO_ARRAY)
    }

    /// An array to be written.
    pub fn array_mut(&mut self, name: &str) -> Result<&mut [f64], ErrorCode> {
        self.arrays.get_mut(name).map(Vec::as_mut_slice).ok_or(ErrorCode::NO_ARRAY)
    }

    /// An element; index -1 is the length.
    pub fn element(&self, name: &str, index: f64) -> Result<f64, ErrorCode> {
        let array = self.array(name)?;
        if index == -1.0 {
            return Ok(array.len() as f64);
        }
        position(array.len(), index).map(|at| array[at])
    }

    pub fn set_element(&mut self, name: &str, index: f64, value: f64) -> Result<(), ErrorCode> {
        let array = self.array_mut(name)?;
        let at = position(array.len(), index)?;
        array[at] = value;
        Ok(())
    }
}

fn position(length: usize, index: f64) -> Result<usize, ErrorCode> {
    if index >= 0.0 && index < length as f64 {
        Ok(index as usize)
    } else {
        Err(ErrorCode::ARRAY_INDEX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_bounded() {
        let model = GalilModel::Dmc4143;
        let mut memory = ControllerMemory::default();
        assert_eq!(memory.dimension("a", 8000.0, model), Ok(()));
        assert_eq!(memory.dimension("b", 8000.0, model), Ok(()));
        assert_eq!(memory.dimension("c", 1.0, model), Err(ErrorCode::ARRAY_SPACE));
        assert_eq!(memory.dimension("b", 7999.0, model), Ok(()));
        assert_eq!(memory.free(model), 1);
        assert_eq!(memory.element("a", -1.0), Ok(8000.0));
        assert_eq!(memory.element("a", 8000.0), Err(ErrorCode::ARRAY_INDEX));
        assert_eq!(memory.set("a", 1.0, model), Err(ErrorCode::VARIABLE));
        assert_eq!(memory.set("ninechars", 1.0, model), Err(ErrorCode::VARIABLE));
        for at in 0..model.variables() {
            assert_eq!(memory.set(&format!("v{at}"), 1.0, model), Ok(()));
        }
        assert_eq!(memory.set("w", 1.0, model), Err(ErrorCode::TOO_MANY_NAMES));
        assert_eq!(memory.deallocate("a[]"), Ok(()));
        assert_eq!(memory.deallocate("*"), Ok(()));
        assert_eq!(memory.variables().count() + memory.arrays().count(), 1);
    }
}
