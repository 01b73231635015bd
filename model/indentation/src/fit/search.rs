//! The search for the relaxation times, and for the exponent of a fractional relaxation.

use super::RelaxationFamily;
use crate::triangle::Triangle;
use crate::viscoelastic::{EXPONENT_MIN, Knot, Memory, Mode, PowerLaw, fractional_rates};
use palpate_model::viscoelastic::rate_shares;

pub(super) struct Record<'a> {
    pub law: PowerLaw,
    pub knots: &'a [Knot],
    pub forces: &'a [f64],
}

/// The best fit of a family.
pub(super) struct Fitted {
    /// Logarithms of the times, ascending, and of the exponent behind them where the family has one.
    pub logs: Vec<f64>,
    /// Of the times, and the equilibrium's behind them.
    pub moduli: Vec<f64>,
    /// The sum of squares of the residuals.
    pub left_over: f64,
    pub residuals: Vec<f64>,
    /// How the forces rise with the moduli and with the logarithms.
    pub tangents: Vec<Vec<f64>>,
    /// Of the moduli and of the logarithms, for a variance of one; `None` where they are not independent.
    pub covariance: Option<Vec<Vec<f64>>>,
}

/// Candidates of a decade: the ratio of 1.8 between them is finer than what records resolve.
const CANDIDATES_PER_DECADE: f64 = 4.0;
const CANDIDATES_MAX: usize = 24;
/// Exponents from which the search may start.
const EXPONENTS: [f64; 10] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97];
/// To a percent, `exp(-5)`, a start knows its rates.
const START_ACCURACY: f64 = 5.0;
const STEPS_MAX: usize = 100;
/// No step changes a time by more than its double or half.
const LOG_STEP_MAX: f64 = 0.7;

impl Record<'_> {
    pub fn fit(&self, family: RelaxationFamily) -> Option<Fitted> {
        let count = family.term_count();
        let mut at = self.project(count, &self.best_of_grid(family)?)?;
        for _ in 0..STEPS_MAX {
            let Some(step) = at.step(count) else { break };
            let largest = step.iter().fold(0.0, |largest: f64, part| largest.max(part.abs()));
            let mut share = (LOG_STEP_MAX / largest).min(1.0);
            let better = (0..12).find_map(|_| {
                let mut moved: Vec<f64> =
                    at.logs.iter().zip(&step).map(|(log, part)| log + share * part).collect();
                for exponent in &mut moved[count..] {
                    *exponent = exponent.clamp(EXPONENT_MIN.ln(), 0.0);
                }
                share *= 0.5;
                self.project(count, &moved).filter(|moved| moved.left_over < at.left_over)
            });
            let Some(better) = better else { break };
            at = better;
            if largest < 1e-10 {
                break;
            }
        }
        at.logs[..count].sort_by(f64::total_cmp);
        let at = self.project(count, &at.logs)?;
        let is_valid = at.moduli[..count].iter().all(|modulus| *modulus > 0.0);
        let tangents = at.tangents();
        let right = vec![0.0; self.forces.len()];
        let columns = tangents.iter().cloned().chain([right]);
        let covariance = Triangle::new(columns.collect()).covariance();
        is_valid.then_some(Fitted {
            logs: at.logs,
            moduli: at.moduli,
            left_over: at.left_over,
            residuals: at.residuals,
            tangents,
            covariance,
        })
    }

    /// The logarithms of the family from which the search starts.
    fn best_of_grid(&self, family: RelaxationFamily) -> Option<Vec<f64>> {
        let gaps = self.knots.windows(2).map(|pair| pair[1].time - pair[0].time);
        let mut gaps: Vec<f64> = gaps.filter(|gap| *gap > 0.0).collect();
        gaps.sort_by(f64::total_cmp);
        // The gap where the record is dense; a few samples may lie as close as they like.
        let dense = *gaps.get(gaps.len() / 10)?;
        let decades = (gaps.iter().sum::<f64>() / dense).log10();
        let wanted = (decades * CANDIDATES_PER_DECADE).ceil() as usize + 1;
        let least = family.term_count() + 1;
        let number = wanted.clamp(least, CANDIDATES_MAX.max(least));
        let time = |index: usize| dense * 10f64.powf(decades * index as f64 / (number - 1) as f64);
        let times: Vec<f64> = (0..number).map(time).collect();
        let columns = times.iter().map(|time| self.column(*time, None).values);
        let columns = columns.chain([self.equilibrium(), self.forces.to_vec()]);
        let grid = Grid { triangle: Triangle::new(columns.collect()), times };
        match family {
            RelaxationFamily::Prony { terms } => grid.best_set(terms),
            RelaxationFamily::Fractional => grid.best_fractional(),
        }
    }

    /// The best moduli of so many times and of an exponent behind them, by their logarithms.
    fn project(&self, count: usize, logs: &[f64]) -> Option<Projected> {
        let exponent = logs.get(count).map(|log| log.exp());
        let columns: Vec<Column> =
            logs[..count].iter().map(|log| self.column(log.exp(), exponent)).collect();
        let values = columns.iter().map(|column| column.values.clone());
        let values: Vec<Vec<f64>> = values.chain([self.equilibrium()]).collect();
        let right = self.forces.to_vec();
        let triangle = Triangle::new(values.iter().cloned().chain([right]).collect());
        let moduli = triangle.solve()?;
        let fitted = |index: usize| -> f64 {
            values.iter().zip(&moduli).map(|(column, modulus)| modulus * column[index]).sum()
        };
        let residuals: Vec<f64> =
            self.forces.iter().enumerate().map(|(index, force)| force - fitted(index)).collect();
        let left_over = residuals.iter().map(|residual| residual * residual).sum();
        Some(Projected { logs: logs.to_vec(), moduli, residuals, left_over, columns, values })
    }

    /// The forces of a modulus of one that relaxes with this time, at the samples.
    fn column(&self, time_secs: f64, exponent: Option<f64>) -> Column {
        let Some(exponent) = exponent else {
            let memories = self.memories(time_secs);
            return Column {
                values: memories.iter().map(|memory| memory.value).collect(),
                slopes: vec![memories.iter().map(|memory| memory.slope).collect()],
            };
        };
        let mut values = vec![0.0; self.forces.len()];
        let mut slopes = vec![values.clone(), values.clone()];
        for rate in fractional_rates(time_secs, exponent, self.knots) {
            let memories = self.memories(time_secs * (-rate.ln_rate).exp());
            for (index, memory) in memories.iter().enumerate() {
                values[index] += rate.share * memory.value;
                slopes[0][index] += rate.share * memory.slope;
                slopes[1][index] -= rate.share * rate.slope * memory.slope;
            }
        }
        Column { values, slopes }
    }

    fn equilibrium(&self) -> Vec<f64> {
        self.column(f64::INFINITY, None).values
    }

    fn memories(&self, time_secs: f64) -> Vec<Memory> {
        let scale = self.law.coefficient();
        let memories = Mode::new(time_secs, self.law.exponent()).memories(self.knots);
        let scaled = |m: &Memory| Memory { value: scale * m.value, slope: scale * m.slope };
        memories[1..].iter().map(scaled).collect()
    }
}

/// Candidates of the times, with the triangle of their columns, the equilibrium's behind them.
struct Grid {
    triangle: Triangle,
    times: Vec<f64>,
}

impl Grid {
    /// Of all sets of so many candidates the one that leaves the least with moduli above zero.
    fn best_set(&self, count: usize) -> Option<Vec<f64>> {
        let number = self.times.len();
        let mut best: Option<(f64, Vec<usize>)> = None;
        let mut set: Vec<usize> = (0..count).collect();
        loop {
            let columns = set.iter().map(|index| vec![(*index, 1.0)]);
            let left_over = self.left_over(columns.collect());
            if left_over.is_some_and(|left| best.as_ref().is_none_or(|(least, _)| left < *least)) {
                best = left_over.map(|left| (left, set.clone()));
            }
            // The next set in the order of its members.
            let Some(place) = (0..count).rfind(|place| set[*place] < number - count + place) else {
                break;
            };
            set[place] += 1;
            for later in place + 1..count {
                set[later] = set[later - 1] + 1;
            }
        }
        best.map(|(_, set)| set.into_iter().map(|index| self.times[index].ln()).collect())
    }

    /// Of all candidates and exponents those that leave the least with a modulus above zero.
    fn best_fractional(&self) -> Option<Vec<f64>> {
        let both = self.times.iter().flat_map(|time| EXPONENTS.map(|exponent| [*time, exponent]));
        let left_over = |[time, exponent]: [f64; 2]| {
            let column = self.fractional(time, exponent);
            Some((self.left_over(vec![column])?, vec![time.ln(), exponent.ln()]))
        };
        let best = both.filter_map(left_over).min_by(|(one, _), (other, _)| one.total_cmp(other));
        best.map(|(_, logs)| logs)
    }

    /// A fractional relaxation with each of its rates moved to the nearest candidate.
    fn fractional(&self, time_secs: f64, exponent: f64) -> Vec<(usize, f64)> {
        let (first, last) = (self.times[0].ln(), self.times.len() - 1);
        let spacing = (self.times[last].ln() - first) / last as f64;
        let everything = [f64::NEG_INFINITY, f64::INFINITY];
        let rates = rate_shares(exponent, START_ACCURACY, everything).into_iter();
        let nearest = |log: f64| ((log - first) / spacing).round().clamp(0.0, last as f64) as usize;
        rates.map(|one| (nearest(time_secs.ln() - one.ln_rate), one.share)).collect()
    }

    /// What columns leave beside the equilibrium's; `None` where one of their moduli is not above zero.
    fn left_over(&self, mut columns: Vec<Vec<(usize, f64)>>) -> Option<f64> {
        let count = columns.len();
        columns.push(vec![(self.times.len(), 1.0)]);
        let chosen = self.triangle.combined(&columns);
        let is_valid = chosen.solve()?[..count].iter().all(|modulus| *modulus > 0.0);
        is_valid.then(|| chosen.left_over())
    }
}

/// The forces of a modulus of one at the samples, and how they rise with each of its logarithms.
struct Column {
    values: Vec<f64>,
    slopes: Vec<Vec<f64>>,
}

struct Projected {
    logs: Vec<f64>,
    moduli: Vec<f64>,
    residuals: Vec<f64>,
    left_over: f64,
    columns: Vec<Column>,
    /// The columns of the moduli, the equilibrium's last.
    values: Vec<Vec<f64>>,
}

impl Projected {
    /// The step of the logarithms of so many times and of an exponent that leaves the least in the tangent of all parameters. An
    /// exponent of one stays where it is if it would rise.
    fn step(&self, count: usize) -> Option<Vec<f64>> {
        let solve = |tangents: Vec<Vec<f64>>| {
            let columns = tangents.into_iter().chain([self.residuals.clone()]);
            let steps = Triangle::new(columns.collect()).solve()?;
            Some(steps[self.values.len()..].to_vec())
        };
        let mut tangents = self.tangents();
        let step = solve(tangents.clone())?;
        let is_stuck = self.logs.get(count) == Some(&0.0) && step[count] >= 0.0;
        if !is_stuck {
            return Some(step);
        }
        tangents.pop();
        Some(solve(tangents)?.into_iter().chain([0.0]).collect())
    }

    /// How the forces rise with the moduli, the equilibrium's last, and with the logarithms.
    fn tangents(&self) -> Vec<Vec<f64>> {
        let of_logs = self.columns.iter().zip(&self.moduli).flat_map(|(column, modulus)| {
            let tangent = move |slope: &Vec<f64>| slope.iter().map(|one| modulus * one).collect();
            column.slopes.iter().map(tangent)
        });
        self.values.iter().cloned().chain(of_logs).collect()
    }
}
