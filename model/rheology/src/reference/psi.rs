//! The functions of the exact step, in many digits; see [`palpate_model::viscoelastic::psi`].

use super::digits::{Big, Digits};

/// Beyond this `r`, `e^-r` times any double is below the smallest double: nothing is left of the past.
pub(super) const FORGOTTEN: usize = 2000;

/// Weights of a step of `r = dt / tau` of a filter.
#[derive(Clone, Debug)]
pub(super) struct Weights {
    /// `r`; `None` where it is endless.
    pub r: Option<Big>,
    /// `e^-r`.
    pub decay: Big,
    /// `psi_0`, `psi_1` and so on.
    pub psi: Vec<Big>,
}

impl Weights {
    /// For `dt > 0` and `tau >= 0` seconds, `count` of the functions.
    pub fn new(digits: Digits, dt: &Big, tau: &Big, count: usize) -> Self {
        let one = digits.whole(1);
        if *tau == Big::ZERO {
            return Self { r: None, decay: digits.zero(), psi: vec![one; count] };
        }
        let r = dt / tau;
        let decay = if r > digits.whole(FORGOTTEN) { digits.zero() } else { (-&r).exp() };
        let psi = if r < one {
            (0..count).map(|j| series(digits, j, &r)).collect()
        } else {
            let mut all = vec![&one - &decay];
            for j in 1..count {
                let before = all[j - 1].clone();
                all.push(&one - digits.whole(j) / &r * before);
            }
            all
        };
        Self { r: Some(r), decay, psi }
    }
}

/// `sum_m (-1)^m r^(m+1) j! / (m+j+1)!`: below `r = 1` each term is less than half the one before.
fn series(digits: Digits, j: usize, r: &Big) -> Big {
    let mut term = r / digits.whole(j + 1);
    let mut sum = term.clone();
    // Terms shrink at least twofold, so that after so many the last digit is reached.
    for m in 1..=digits.bits() {
        term = -(term * r / digits.whole(m + j + 1));
        let next = &sum + &term;
        if next == sum {
            break;
        }
        sum = next;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::str::FromStr;

    /// The decimal numbers of the reference file are made by `scripts/psi_reference.py` with mpmath.
    #[test]
    fn agrees_with_the_file_to_its_last_digit() {
        let digits = Digits::decimal(70);
        let mut count = 0;
        for line in include_str!("../../../tests/data/psi_reference.txt").lines() {
            if line.starts_with('#') {
                continue;
            }
            let fields: Vec<&str> = line.split(' ').collect();
            let (j, r): (usize, f64) = (fields[0].parse().unwrap(), fields[1].parse().unwrap());
            let all = Weights::new(digits, &digits.exact(r), &digits.whole(1), j + 1);
            let exact = dashu_float::DBig::from_str(fields[2]).unwrap();
            let exact = exact.with_base_and_precision::<2>(digits.bits()).value();
            let exact: Big = exact.with_rounding();
            let miss = super::super::digits::nearest(&((&all.psi[j] - &exact) / &exact));
            assert!(miss.abs() < 1e-48, "psi_{j}({r}): {miss:e}");
            count += 1;
        }
        assert!(count > 2800);
    }
}
