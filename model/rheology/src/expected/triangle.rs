//! The inverse of a small orthogonal factorisation, or the columns that it does not separate.

use super::information::{BODY, PARAMETER_NAMES};
use crate::fit::{CONDITION_MAX, dominant_entries};
use palpate_model::linalg::Triangle;

/// The inverse; the parameters in words where columns of these lengths do not separate them.
pub fn inverse(
    triangle: &Triangle<BODY>,
    lengths: &[f64; BODY],
) -> Result<[[f64; BODY]; BODY], String> {
    let mut unit = triangle.r;
    for row in &mut unit {
        for (value, length) in row.iter_mut().zip(lengths) {
            *value /= length;
        }
    }
    let columns: [[f64; BODY]; BODY] = std::array::from_fn(|column| {
        let mut solution = [0.0; BODY];
        for i in (0..=column).rev() {
            let known: f64 = (i + 1..=column).map(|j| unit[i][j] * solution[j]).sum();
            // A pivot smaller than its own rounding is that rounding.
            let pivot = unit[i][i].max(f64::EPSILON);
            solution[i] = (f64::from(u8::from(i == column)) - known) / pivot;
        }
        solution
    });
    let inverse = std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]));
    let (condition, blind) = largest_singular(&inverse);
    if condition.is_nan() || condition > CONDITION_MAX {
        return Err(combination_words(&blind));
    }
    Ok(std::array::from_fn(|i| inverse[i].map(|value| value / lengths[i])))
}

/// Largest singular value of a matrix and its left vector, by power iteration: what the inverse of a
/// design enlarges most is what the design is blind to. Twenty steps leave nothing of the others
/// where it matters, that is, where one value is far larger than the rest.
fn largest_singular(matrix: &[[f64; BODY]; BODY]) -> (f64, [f64; BODY]) {
    let mut vector = [1.0, 0.9, -0.8, 0.7, -0.6];
    let mut value = 0.0;
    for _ in 0..20 {
        let across: [f64; BODY] =
            std::array::from_fn(|k| (0..BODY).map(|i| matrix[i][k] * vector[i]).sum());
        let back: [f64; BODY] =
            std::array::from_fn(|i| (0..BODY).map(|k| matrix[i][k] * across[k]).sum());
        let norm = back.iter().map(|value| value * value).sum::<f64>().sqrt();
        let before = vector.iter().map(|value| value * value).sum::<f64>().sqrt();
        value = (norm / before).sqrt();
        vector = back.map(|value| value / norm);
    }
    (value, vector)
}

fn combination_words(blind: &[f64; BODY]) -> String {
    let names: Vec<&str> =
        dominant_entries(blind).into_iter().map(|place| PARAMETER_NAMES[place]).collect();
    match names.as_slice() {
        [one, other] => format!("{one} from {other}"),
        [rest @ .., last] if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        [only] => format!("{only} from initial force and offset"),
        _ => "the parameters".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_is_exact_and_inseparable_parameters_are_named() {
        let mut triangle = Triangle::<BODY>::default();
        let mut alike = Triangle::<BODY>::default();
        for i in 0..50 {
            let x = f64::from(i) * 0.02;
            triangle.push([1.0, x, x * x, x.powi(3), (7.0 * x).sin()]);
            alike.push([1.0, x, x * x, x.powi(3), -3.0 * x]);
        }
        let lengths =
            |triangle: &Triangle<BODY>| std::array::from_fn(|k| triangle.length_squared(k).sqrt());
        let product = inverse(&triangle, &lengths(&triangle)).unwrap();
        for (i, row) in triangle.r.iter().enumerate() {
            let mut products = [0.0; BODY];
            for (share, line) in row.iter().zip(&product) {
                for (product, value) in products.iter_mut().zip(line) {
                    *product += share * value;
                }
            }
            for (j, product) in products.iter().enumerate() {
                let one = if i == j { 1.0 } else { 0.0 };
                assert!((product - one).abs() < 1e-11, "{i} {j} {product}");
            }
        }
        let blind = inverse(&alike, &lengths(&alike)).unwrap_err();
        assert_eq!(blind, "mu1 from tau_sig");
    }
}
