//! The table of all families, and the reading of their keys.

use super::family::Family;
use std::ops::RangeInclusive;
use std::sync::Arc;
use thiserror::Error;

/// Every kind of family, the simplest first: a kind that is not here is in no list and has no key.
const TABLE: &[FamilyKind] = &[
    super::voigt::KIND,
    super::maxwell::KIND,
    super::kelvin::KIND,
    super::power_series::KIND,
    super::exponential::KIND,
    super::prony::KIND,
    super::fractional::KIND,
    super::stretched::KIND,
    super::quasi_linear::KIND,
    super::unloading::KIND,
];

/// Families of one equation.
pub(super) struct FamilyKind {
    /// Their key, before a hyphen and a number where there is one.
    pub word: &'static str,
    /// The family of the word alone or with a number; `None` where there is none.
    pub of: fn(Option<usize>) -> Option<Arc<dyn Family>>,
    /// Numbers of those that a selection compares; `None` for the word alone.
    pub compared: Option<RangeInclusive<usize>>,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("'{key}' is not a model family; choose from {known}")]
pub struct UnknownFamily {
    pub key: String,
    pub known: String,
}

/// All families, the simplest first: what a selection compares. One Prony term is the Kelvin body;
/// unloading of other orders than the third is there by its key.
#[must_use]
pub fn all_families() -> Vec<Arc<dyn Family>> {
    let members = |kind: &FamilyKind| -> Vec<Arc<dyn Family>> {
        match kind.compared.clone() {
            None => (kind.of)(None).into_iter().collect(),
            Some(numbers) => numbers.filter_map(|one| (kind.of)(Some(one))).collect(),
        }
    };
    TABLE.iter().flat_map(members).collect()
}

/// The family of a key such as `series-3`, `unloading-3` or `fung-8`.
pub fn find_family(key: &str) -> Result<Arc<dyn Family>, UnknownFamily> {
    let find = |word: &str, number| {
        let kind = TABLE.iter().find(|kind| kind.word == word)?;
        (kind.of)(number)
    };
    let found = match key.split_once('-') {
        None => find(key, None),
        Some((word, number)) => number.parse().ok().and_then(|one| find(word, Some(one))),
    };
    found.ok_or_else(|| UnknownFamily {
        key: key.to_owned(),
        known: all_families().iter().map(|family| family.key()).collect::<Vec<_>>().join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_is_found_by_its_own_key() {
        let all = all_families();
        assert!(all.len() >= TABLE.len());
        for family in &all {
            assert_eq!(find_family(&family.key()).unwrap().key(), family.key());
            for (simpler, words) in family.adds_to() {
                assert!(find_family(&simpler).is_ok() && words.len() > 5, "{simpler}");
            }
        }
        // Keys of families that are compared only where they are named.
        for key in ["prony-1", "prony-40", "unloading-1", "fung-8", "fractional-12"] {
            assert_eq!(find_family(key).unwrap().key(), key);
        }
        for key in ["", "voigt-1", "series", "series-0", "series-x", "prony-41", "fung-0"] {
            let refused = find_family(key).unwrap_err();
            assert!(refused.known.starts_with("voigt, maxwell, kelvin, series-1"));
        }
    }
}
