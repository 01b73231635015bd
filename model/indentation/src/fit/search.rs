//! The search for the relaxation times.

use crate::triangle::Triangle;
use crate::viscoelastic::{Knot, Memory, Mode, PowerLaw};

pub(super) struct Record<'a> {
    pub law: PowerLaw,
    pub knots: &'a [Knot],
    pub forces: &'a [f64],
}

/// The best times, ascending, with their moduli and the equilibrium's behind them.
pub(super) struct Fitted {
    pub times: Vec<f64>,
    pub moduli: Vec<f64>,
    /// The sum of squares of the residuals.
    pub left_over: f64,
    pub residuals: Vec<f64>,
    /// How the forces rise with the moduli and with the logarithms of the times.
    pub tangents: Vec<Vec<f64>>,
    /// Of the moduli and of the logarithms of the times, for a variance of one; `None` where they are not independent.
    pub covariance: Option<Vec<Vec<f64>>>,
}

/// Candidates of a decade: the ratio of 1.8 between them is finer than what records resolve.
const CANDIDATES_PER_DECADE: f64 = 4.0;
const CANDIDATES_MAX: usize = 24;
const STEPS_MAX: usize = 100;
/// No step changes a time by more than its double or half.
const LOG_STEP_MAX: f64 = 0.7;

impl Record<'_> {
    pub fn fit(&self, count: usize) -> Option<Fitted> {
        let mut at = self.project(&self.best_of_grid(count)?)?;
        for _ in 0..STEPS_MAX {
            let Some(step) = Self::step(&at) else { break };
            let largest = step.iter().fold(0.0, |largest: f64, part| largest.max(part.abs()));
            let mut share = (LOG_STEP_MAX / largest).min(1.0);
            let better = (0..12).find_map(|_| {
                let moved: Vec<f64> = at
                    .times
                    .iter()
                    .zip(&step)
                    .map(|(time, part)| time * (share * part).exp())
                    .collect();
                share *= 0.5;
                self.project(&moved).filter(|moved| moved.left_over < at.left_over)
            });
            let Some(better) = better else { break };
            at = better;
            if largest < 1e-10 {
                break;
            }
        }
        at.times.sort_by(f64::total_cmp);
        let at = self.project(&at.times)?;
        let is_valid = at.moduli[..count].iter().all(|modulus| *modulus > 0.0);
        let tangents = at.tangents();
        let right = vec![0.0; self.forces.len()];
        let columns = tangents.iter().cloned().chain([right]);
        let covariance = Triangle::new(columns.collect()).covariance();
        is_valid.then_some(Fitted {
            times: at.times,
            moduli: at.moduli,
            left_over: at.left_over,
            residuals: at.residuals,
            tangents,
            covariance,
        })
    }

    /// Of all sets of so many candidates the one that leaves the least with moduli above zero.
    fn best_of_grid(&self, count: usize) -> Option<Vec<f64>> {
        let gaps = self.knots.windows(2).map(|pair| pair[1].time - pair[0].time);
        let mut gaps: Vec<f64> = gaps.filter(|gap| *gap > 0.0).collect();
        gaps.sort_by(f64::total_cmp);
        // The gap where the record is dense; a few samples may lie as close as they like.
        let dense = *gaps.get(gaps.len() / 10)?;
        let decades = (gaps.iter().sum::<f64>() / dense).log10();
        let wanted = (decades * CANDIDATES_PER_DECADE).ceil() as usize + 1;
        let number = wanted.clamp(count + 1, CANDIDATES_MAX.max(count + 1));
        let time = |index: usize| dense * 10f64.powf(decades * index as f64 / (number - 1) as f64);
        let times: Vec<f64> = (0..number).map(time).collect();
        let columns = times.iter().map(|time| self.values(*time));
        let columns = columns.chain([self.values(f64::INFINITY), self.forces.to_vec()]);
        let all = Triangle::new(columns.collect());
        let mut best: Option<(f64, Vec<usize>)> = None;
        let mut set: Vec<usize> = (0..count).collect();
        loop {
            let mut numbers = set.clone();
            numbers.push(number);
            let chosen = all.selected(&numbers);
            let moduli = chosen.solve();
            let is_valid = moduli.is_some_and(|m| m[..count].iter().all(|modulus| *modulus > 0.0));
            if is_valid && best.as_ref().is_none_or(|(least, _)| chosen.left_over() < *least) {
                best = Some((chosen.left_over(), set.clone()));
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
        best.map(|(_, set)| set.into_iter().map(|index| times[index]).collect())
    }

    /// The best moduli of these times.
    fn project(&self, times: &[f64]) -> Option<Projected> {
        let columns: Vec<Vec<Memory>> = times.iter().map(|time| self.column(*time)).collect();
        let values = columns.iter().map(|column| column.iter().map(|m| m.value).collect());
        let values: Vec<Vec<f64>> = values.chain([self.values(f64::INFINITY)]).collect();
        let right = self.forces.to_vec();
        let triangle = Triangle::new(values.iter().cloned().chain([right]).collect());
        let moduli = triangle.solve()?;
        let fitted = |index: usize| -> f64 {
            values.iter().zip(&moduli).map(|(column, modulus)| modulus * column[index]).sum()
        };
        let residuals: Vec<f64> =
            self.forces.iter().enumerate().map(|(index, force)| force - fitted(index)).collect();
        let left_over = residuals.iter().map(|residual| residual * residual).sum();
        Some(Projected { times: times.to_vec(), moduli, residuals, left_over, columns, values })
    }

    /// The step of the logarithms of the times that leaves the least in the tangent of all parameters.
    fn step(at: &Projected) -> Option<Vec<f64>> {
        let columns = at.tangents().into_iter().chain([at.residuals.clone()]);
        let steps = Triangle::new(columns.collect()).solve()?;
        Some(steps[at.values.len()..].to_vec())
    }

    /// The forces of a modulus of one that relaxes with this time, at the samples.
    fn column(&self, time_secs: f64) -> Vec<Memory> {
        let scale = self.law.coefficient();
        let memories = Mode::new(time_secs, self.law.exponent()).memories(self.knots);
        let scaled = |m: &Memory| Memory { value: scale * m.value, slope: scale * m.slope };
        memories[1..].iter().map(scaled).collect()
    }

    fn values(&self, time_secs: f64) -> Vec<f64> {
        self.column(time_secs).iter().map(|memory| memory.value).collect()
    }
}

struct Projected {
    times: Vec<f64>,
    moduli: Vec<f64>,
    residuals: Vec<f64>,
    left_over: f64,
    columns: Vec<Vec<Memory>>,
    /// The columns of the moduli, the equilibrium's last.
    values: Vec<Vec<f64>>,
}

impl Projected {
    /// How the forces rise with the moduli, the equilibrium's last, and with the logarithms of the times.
    fn tangents(&self) -> Vec<Vec<f64>> {
        let of_time = |(column, modulus): (&Vec<Memory>, &f64)| {
            column.iter().map(|memory| modulus * memory.slope).collect()
        };
        let of_times = self.columns.iter().zip(&self.moduli).map(of_time);
        self.values.iter().cloned().chain(of_times).collect()
    }
}
