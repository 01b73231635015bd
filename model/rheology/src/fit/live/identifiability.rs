//! Whether the path so far separates the parameters, in words.

use super::super::design::{Columns, legendre_from_powers};
use super::super::options::{LINEAR, LINEAR_COUNT, PARAMETER_NAMES, TAU};
use super::super::triangle::Triangle;

/// Rows of the design at most; at least [`ROWS_PIECE_MIN`] on each straight piece.
const ROWS: usize = 768;
const ROWS_PIECE_MIN: usize = 4;
const ROWS_PIECE_MAX: usize = 48;
/// Parameters judged: six linear ones, then the relaxation time.
const JUDGED: usize = LINEAR_COUNT + 1;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BlindParameters {
    /// Combinations that leave the force as it is, as positions in [`PARAMETER_NAMES`].
    pub groups: Vec<Vec<usize>>,
}

impl BlindParameters {
    /// Judges a path of corners (s, scaled depth) at a relaxation time in s and the scaled
    /// coefficients of [`Columns`].
    pub fn of(corners: &[(f64, f64)], tau: f64, coefficients: &[f64; LINEAR_COUNT]) -> Self {
        let rows = rows(corners, tau, coefficients);
        let mut remaining: Vec<usize> = (0..JUDGED).collect();
        let mut groups = Vec::new();
        while !remaining.is_empty() {
            let mut triangle = Triangle::new(remaining.len() + 1);
            let mut chosen = [0.0; JUDGED + 1];
            for (row, weight) in &rows {
                for (slot, &k) in chosen.iter_mut().zip(&remaining) {
                    *slot = row[k];
                }
                chosen[remaining.len()] = 0.0;
                triangle.push(&chosen[..=remaining.len()], *weight);
            }
            let Some(blind) = triangle.finish().inseparable_columns(remaining.len()) else {
                break;
            };
            let group: Vec<usize> = blind.into_iter().map(|place| remaining[place]).collect();
            // Without one of them the others may still be separable; the viscous coefficient and
            // the levels go first, since a display can do without them.
            let Some(&dropped) = group.iter().max_by_key(|&&k| if k == 6 { 0 } else { k + 1 })
            else {
                break;
            };
            remaining.retain(|&k| k != dropped);
            let position = |k: &usize| if *k == LINEAR_COUNT { TAU } else { LINEAR + k };
            groups.push(group.iter().map(position).collect());
        }
        Self { groups }
    }

    /// Why a parameter, by its position in [`PARAMETER_NAMES`], cannot be identified.
    pub fn reason(&self, index: usize) -> Option<String> {
        let group = self.groups.iter().find(|group| group.contains(&index))?;
        let name = PARAMETER_NAMES[index];
        let others: Vec<&str> = group
            .iter()
            .filter(|&&other| other != index)
            .map(|&other| PARAMETER_NAMES[other])
            .collect();
        let is_pair = |a: &str, b: &str| name == a && others == [b];
        Some(if others.is_empty() {
            format!("{name} has not changed the force yet; move deeper")
        } else if is_pair("mu1", "tau_sig") || is_pair("tau_sig", "mu1") {
            format!(
                "{name} cannot yet be separated from {}: the depth has moved at one speed only; \
                 hold for about 5 tau",
                others[0]
            )
        } else {
            format!(
                "{name} cannot yet be separated from {}: along this path these parameters change the force in \
                 the same way; hold for about 5 tau or add a second speed",
                others.join(", ")
            )
        })
    }
}

/// Rows of the design with the root of the time each stands for: dense after each corner, where
/// the filters settle, and wider apart later.
fn rows(
    corners: &[(f64, f64)],
    tau: f64,
    coefficients: &[f64; LINEAR_COUNT],
) -> Vec<([f64; JUDGED], f64)> {
    let Some(&(mut t, depth)) = corners.first() else {
        return Vec::new();
    };
    let pieces = corners.len().saturating_sub(1).max(1);
    let count = (ROWS / pieces).clamp(ROWS_PIECE_MIN, ROWS_PIECE_MAX);
    let mut columns = Columns::<true>::new(tau, depth);
    let mut rows = Vec::with_capacity(count * pieces + 1);
    let mut push_row = |columns: &Columns<true>, weight: f64| {
        let mut row = [0.0; JUDGED];
        row[..LINEAR_COUNT].copy_from_slice(&columns.row());
        row[LINEAR_COUNT] = columns.tau_slope(&legendre_from_powers(coefficients));
        rows.push((row, weight));
    };
    for pair in corners.windows(2) {
        let ((from_t, from), (to_t, to)) = (pair[0], pair[1]);
        let span = to_t - from_t;
        if t <= from_t {
            push_row(&columns, (span / count as f64).sqrt());
        }
        // Steps grow geometrically from about an eighth of tau.
        let growth = (8.0 * span / (count as f64 * tau)).ln_1p();
        for i in 1..=count {
            let share = i as f64 / count as f64;
            let next = if i == count {
                to_t
            } else if growth < 1e-3 {
                from_t + span * share
            } else {
                from_t + span * (growth * share).exp_m1() / growth.exp_m1()
            };
            if next <= t {
                continue;
            }
            columns.advance(from + (to - from) * (next - from_t) / span, next - t);
            push_row(&columns, (next - t).sqrt());
            t = next;
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The thesis body on a scale of 30 mm.
    const SCALED: [f64; 6] = [1.6, -7.74, 11.7315, 54.0, 0.0, 0.0];

    fn groups(corners: &[(f64, f64)]) -> Vec<Vec<&'static str>> {
        let blind = BlindParameters::of(corners, 1.023, &SCALED);
        let name = |index: &usize| PARAMETER_NAMES[*index];
        let named = |group: &Vec<usize>| group.iter().map(name).collect();
        blind.groups.iter().map(named).collect()
    }

    #[test]
    fn one_ramp_does_not_separate_one_pair() {
        assert_eq!(groups(&[(0.0, 0.0), (40.0, 1.0)]), [["mu1", "tau_sig"]]);
        // Also where the ramp starts above the surface.
        assert_eq!(groups(&[(0.0, -0.1), (44.0, 1.0)]), [["mu1", "tau_sig"]]);
    }

    #[test]
    fn hold_or_second_speed_separates_all_parameters() {
        let none: Vec<Vec<&str>> = Vec::new();
        assert_eq!(groups(&[(0.0, 0.0), (40.0, 1.0), (45.0, 1.0)]), none);
        assert_eq!(groups(&[(0.0, 0.0), (20.0, 0.5), (30.0, 1.0)]), none);
        assert_eq!(groups(&[(0.0, 0.0), (20.0, 1.0), (40.0, 0.0)]), none);
    }

    #[test]
    fn reasons_name_the_parameters_and_the_remedy() {
        let blind = BlindParameters::of(&[(0.0, 0.0), (40.0, 1.0)], 1.023, &SCALED);
        let reason = blind.reason(1).unwrap();
        assert!(reason.contains("mu1") && reason.contains("tau_sig"), "{reason}");
        assert_eq!(blind.reason(2), None);
        let still = BlindParameters::of(&[(0.0, 0.0), (40.0, 0.0)], 1.023, &SCALED);
        assert!(still.reason(3).unwrap().contains("deeper"), "{still:?}");
    }
}
