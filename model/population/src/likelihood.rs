//! The restricted likelihood of nested variances, and its exact gradient, in one pass up a tree and one down.
//!
//! Given what is above it, what a group says of its means is a quadratic form of the group's own shift, the effects and one:
//! the sum of its members' forms. Integrating the shift out is a step of the size of one group (Pinheiro & Bates,
//! Mixed-Effects Models in S and S-PLUS, 2000, section 2.2.3), so that cost and storage grow with the number of sessions and
//! not with its square. The shifts' covariance enters by its factor, L of L L', so that a standard deviation of zero is a value like
//! any other. The gradient follows the same steps backwards.

use crate::study::{Evidence, NestedStudy};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, LU};

/// Quadratic forms of one group's members, or their adjoints: of its shift, the effects and one.
type Form = DMatrix<f64>;

/// The covariance of the shifts of a level: a factor times signs times its transpose.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DeviationFactor {
    pub root: DMatrix<f64>,
    /// One, or minus one where a variance is below zero: of no shift, but what judges means without a bound in its way.
    pub signs: DVector<f64>,
}

impl DeviationFactor {
    pub fn covariance(&self) -> DMatrix<f64> {
        &self.root * DMatrix::from_diagonal(&self.signs) * self.root.transpose()
    }

    /// How many variances are below zero.
    fn negative_count(&self) -> usize {
        self.signs.iter().filter(|sign| **sign < 0.0).count()
    }
}

/// A shift that is integrated out of a form.
struct Integration {
    /// The columns of the shift times the factor.
    columns: DMatrix<f64>,
    /// Those times the inverse of `scaled`.
    weights: DMatrix<f64>,
    /// The inverse of the signs and the form of the shift in units of its standard deviation.
    inverse: DMatrix<f64>,
    log_determinant: f64,
}

impl Integration {
    /// `None` where variances below zero outweigh what the form says: the whole is a covariance as long as as many directions
    /// are below zero as signs are (Haynsworth, Linear Algebra and its Applications 1 (1968) 73-81).
    fn of(form: &Form, factor: &DeviationFactor) -> Option<Self> {
        let count = factor.signs.len();
        let columns = form.columns(0, count) * &factor.root;
        let mut scaled = factor.root.tr_mul(&columns.rows(0, count));
        (0..count).for_each(|k| scaled[(k, k)] += factor.signs[k]);
        let (inverse, log_determinant) = match factor.negative_count() {
            0 => {
                let scaled = Cholesky::new(scaled)?;
                (scaled.inverse(), log_determinant(&scaled))
            }
            negative => {
                let below = scaled.symmetric_eigenvalues().iter().filter(|one| **one < 0.0).count();
                let scaled = LU::new(scaled);
                let inverse = scaled.try_inverse().filter(|_| below == negative)?;
                (inverse, scaled.determinant().abs().ln())
            }
        };
        let weights = &columns * &inverse;
        Some(Self { columns, weights, inverse, log_determinant })
    }

    fn form(&self, form: &Form) -> Form {
        form - &self.weights * self.columns.transpose()
    }

    /// The adjoint of the form from that of what is left of it; adds to that of the factor.
    fn adjoint(
        &self,
        form: &Form,
        root: &DMatrix<f64>,
        after: &Form,
        of_root: &mut DMatrix<f64>,
    ) -> Form {
        let count = root.nrows();
        let of_columns = after * &self.weights * -2.0;
        let of_scaled = self.weights.tr_mul(&(after * &self.weights)) + &self.inverse;
        *of_root += form.columns(0, count).tr_mul(&of_columns)
            + form.view((0, 0), (count, count)) * root * &of_scaled * 2.0;
        let mut before = after.clone();
        let half = of_columns * root.transpose() * 0.5;
        let mut columns = before.columns_mut(0, count);
        columns += &half;
        let mut rows = before.rows_mut(0, count);
        rows += half.transpose();
        let mut own = before.view_mut((0, 0), (count, count));
        own += root * of_scaled * root.transpose();
        before
    }
}

fn log_determinant(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|value| value.ln()).sum::<f64>()
}

/// The means at given standard deviations, and how well these explain the sessions.
#[derive(Clone, Debug)]
pub(crate) struct Evaluation {
    /// Minus twice the logarithm of the restricted likelihood, without what no standard deviation changes.
    pub criterion: f64,
    /// Effects, those of the first column for all parameters first.
    pub effects: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// The most probable shift of a group.
#[derive(Clone, Debug)]
pub(crate) struct ShiftEstimate {
    /// With those it belongs to: from the effects of its sessions.
    pub whole: DVector<f64>,
    pub whole_covariance: DMatrix<f64>,
    /// From the group that it belongs to.
    pub own: DVector<f64>,
    pub own_covariance: DMatrix<f64>,
}

/// Sums over the members of every group at given standard deviations.
struct Sums {
    /// Of each level but the sessions' own.
    groups: Vec<Vec<Form>>,
    /// How the shift of each of these groups was integrated out.
    steps: Vec<Vec<Integration>>,
    /// How that of each session was; none where its values are exact.
    session_steps: Vec<Option<Integration>>,
    root: Form,
    log_determinant: f64,
}

#[cfg(test)]
thread_local! {
    /// How often all sessions were summed: what a fit costs, on a busy machine as on an idle one.
    pub(crate) static PASSES: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

impl NestedStudy {
    /// Length of a form.
    fn width(&self) -> usize {
        self.parameters * (1 + self.effects) + 1
    }

    fn levels(&self) -> usize {
        self.parents.len() + 1
    }

    /// Restricted likelihood and means; `None` where a standard deviation of zero leaves a session impossible, or effects cannot be
    /// separated.
    pub fn evaluate(&self, factors: &[DeviationFactor]) -> Option<Evaluation> {
        self.means(&self.sums(factors)?)
    }

    /// Those with the gradient of the criterion by the factor of each level, the outermost first.
    pub fn evaluate_with_gradient(
        &self,
        factors: &[DeviationFactor],
    ) -> Option<(Evaluation, Vec<DMatrix<f64>>)> {
        let sums = self.sums(factors)?;
        let evaluation = self.means(&sums)?;
        let extended = self.extended(&DVector::zeros(self.parameters), &evaluation.effects);
        let (shift, effects) = (self.parameters, self.parameters * self.effects);
        let mut adjoint = &extended * extended.transpose();
        let mut own = adjoint.view_mut((shift, shift), (effects, effects));
        own += &evaluation.covariance;
        let gradient = self.gradient(&sums, factors, &adjoint)?;
        Some((evaluation, gradient))
    }

    fn means(&self, sums: &Sums) -> Option<Evaluation> {
        let (shift, effects) = (self.parameters, self.parameters * self.effects);
        let own = sums.root.view((shift, shift), (effects, effects)).into_owned();
        let own = Cholesky::new(own)?;
        let last = self.width() - 1;
        let means = -own.solve(&sums.root.view((shift, last), (effects, 1)).column(0));
        let extended = self.extended(&DVector::zeros(shift), &means);
        let square = (&sums.root * &extended).dot(&extended);
        Some(Evaluation {
            criterion: sums.log_determinant + log_determinant(&own) + square,
            covariance: own.inverse(),
            effects: means,
        })
    }

    /// What a form takes: a shift, effects and one.
    fn extended(&self, shift: &DVector<f64>, effects: &DVector<f64>) -> DVector<f64> {
        let mut extended = DVector::from_element(self.width(), 1.0);
        extended.rows_mut(0, shift.len()).copy_from(shift);
        extended.rows_mut(shift.len(), effects.len()).copy_from(effects);
        extended
    }

    fn sums(&self, factors: &[DeviationFactor]) -> Option<Sums> {
        #[cfg(test)]
        PASSES.with(|passes| passes.set(passes.get() + 1));
        let zero = || DMatrix::zeros(self.width(), self.width());
        let mut groups: Vec<Vec<Form>> =
            self.parents.iter().map(|parents| vec![zero(); parents.len()]).collect();
        let mut root = zero();
        let mut logarithm = 0.0;
        let innermost = &factors[self.parents.len()];
        let exact = innermost.covariance();
        let mut session_steps = Vec::with_capacity(self.sessions.len());
        for (index, session) in self.sessions.iter().enumerate() {
            let weight = match &session.evidence {
                Evidence::Exact => {
                    let factor = Cholesky::new(exact.clone())?;
                    logarithm += log_determinant(&factor);
                    session_steps.push(None);
                    factor.inverse()
                }
                Evidence::Information(information) => {
                    let step = Integration::of(information, innermost)?;
                    logarithm += step.log_determinant;
                    let weight = step.form(information);
                    session_steps.push(Some(step));
                    weight
                }
            };
            let sum = match groups.last_mut() {
                Some(innermost) => &mut innermost[self.owner[index]],
                None => &mut root,
            };
            self.add_session(sum, index, &weight);
        }
        let mut steps: Vec<Vec<Integration>> = groups.iter().map(|_| Vec::new()).collect();
        for level in (0..groups.len()).rev() {
            let (outer, own) = groups.split_at_mut(level);
            for (form, parent) in own[0].iter().zip(&self.parents[level]) {
                let step = Integration::of(form, &factors[level])?;
                logarithm += step.log_determinant;
                let sum = match outer.last_mut() {
                    Some(outer) => &mut outer[*parent],
                    None => &mut root,
                };
                *sum += step.form(form);
                steps[level].push(step);
            }
        }
        Some(Sums { groups, steps, session_steps, root, log_determinant: logarithm })
    }

    /// One and the effects of a session that are not zero, each with its place in a form.
    fn multipliers(&self, session: usize) -> impl Iterator<Item = (usize, f64)> {
        let effects = self.sessions[session].design.iter().copied();
        std::iter::once(1.0).chain(effects).enumerate().filter(|(_, share)| *share != 0.0)
    }

    /// Adds what a session says, whose residual is shift + effects - values, each weighted.
    fn add_session(&self, sum: &mut Form, session: usize, weight: &DMatrix<f64>) {
        let (count, last) = (self.parameters, self.width() - 1);
        let values = &self.sessions[session].values;
        for row in 0..count {
            let weighted: f64 = (0..count).map(|k| weight[(row, k)] * values[k]).sum();
            for (a, first) in self.multipliers(session) {
                for (b, second) in self.multipliers(session) {
                    let share = first * second;
                    for column in 0..count {
                        sum[(a * count + row, b * count + column)] += share * weight[(row, column)];
                    }
                }
                sum[(a * count + row, last)] -= first * weighted;
                sum[(last, a * count + row)] -= first * weighted;
            }
            sum[(last, last)] += weighted * values[row];
        }
    }

    /// The adjoint of a session's weight.
    fn weight_adjoint(&self, adjoint: &Form, session: usize) -> DMatrix<f64> {
        let (count, last) = (self.parameters, self.width() - 1);
        let values = &self.sessions[session].values;
        // By a row of the residual, then by a column: every step over the few entries that are not zero.
        let residual = |of: &dyn Fn(usize) -> f64, row: usize| {
            let means = self.multipliers(session).map(|(a, first)| first * of(a * count + row));
            means.sum::<f64>() - values[row] * of(last)
        };
        DMatrix::from_fn(count, count, |row, column| {
            residual(&|at| residual(&|other| adjoint[(at, other)], column), row)
        })
    }

    fn gradient(
        &self,
        sums: &Sums,
        factors: &[DeviationFactor],
        root: &Form,
    ) -> Option<Vec<DMatrix<f64>>> {
        let count = self.parameters;
        let mut gradient = vec![DMatrix::zeros(count, count); self.levels()];
        let mut above: Vec<Form> = vec![root.clone()];
        for (level, forms) in sums.groups.iter().enumerate() {
            let own = forms.iter().zip(&sums.steps[level]).zip(&self.parents[level]);
            let own = own.map(|((form, step), parent)| {
                let sum = &mut gradient[level];
                step.adjoint(form, &factors[level].root, &above[*parent], sum)
            });
            above = own.collect();
        }
        let innermost = &factors[self.parents.len()];
        let sum = &mut gradient[self.parents.len()];
        for (index, session) in self.sessions.iter().enumerate() {
            let adjoint = self.weight_adjoint(&above[self.owner[index]], index);
            match (&session.evidence, &sums.session_steps[index]) {
                (Evidence::Information(information), Some(step)) => {
                    step.adjoint(information, &innermost.root, &adjoint, sum);
                }
                _ => {
                    let inverse = innermost.covariance().try_inverse()?;
                    let covariance = &inverse - &inverse * adjoint * &inverse;
                    *sum += covariance
                        * &innermost.root
                        * DMatrix::from_diagonal(&innermost.signs)
                        * 2.0;
                }
            }
        }
        Some(gradient)
    }

    /// The most probable shift of every group against the mean of its sessions' effects, with its covariance given the
    /// standard deviations and the effects; of each level, then of the sessions.
    pub fn shifts(
        &self,
        factors: &[DeviationFactor],
        effects: &DVector<f64>,
    ) -> Option<Vec<Vec<ShiftEstimate>>> {
        let sums = self.sums(factors)?;
        let count = self.parameters;
        let (zero, none) = (DVector::zeros(count), DMatrix::zeros(count, count));
        let root = ShiftEstimate {
            whole: zero.clone(),
            whole_covariance: none.clone(),
            own: zero,
            own_covariance: none,
        };
        let mut above = vec![root];
        let mut all = Vec::with_capacity(self.levels());
        for (level, forms) in sums.groups.iter().enumerate() {
            let factor = &factors[level];
            let own = forms.iter().zip(&self.parents[level]).map(|(form, parent)| {
                let above = &above[*parent];
                member(form, factor, &self.extended(&above.whole, effects), above)
            });
            let own = own.collect::<Option<Vec<_>>>()?;
            all.push(own.clone());
            above = own;
        }
        let factor = &factors[self.parents.len()];
        let sessions = self.sessions.iter().enumerate().map(|(index, session)| {
            let above = &above[self.owner[index]];
            let residual = session.vector() - self.session_mean(index, effects);
            match &session.evidence {
                Evidence::Exact => Some(ShiftEstimate {
                    own: &residual - &above.whole,
                    own_covariance: above.whole_covariance.clone(),
                    whole: residual,
                    whole_covariance: DMatrix::zeros(count, count),
                }),
                Evidence::Information(information) => {
                    // The form of a session takes its residual.
                    member(information, factor, &(&above.whole - residual), above)
                }
            }
        });
        all.push(sessions.collect::<Option<_>>()?);
        Some(all)
    }

    /// The sum of effects of a session.
    pub fn session_mean(&self, session: usize, effects: &DVector<f64>) -> DVector<f64> {
        let count = self.parameters;
        let mut mean = DVector::zeros(count);
        for (j, factor) in self.sessions[session].design.iter().enumerate() {
            mean += effects.rows(j * count, count) * *factor;
        }
        mean
    }
}

/// The shift of a group, given that of the group above: `extended` is what the form takes at the shift of the group above.
fn member(
    form: &Form,
    factor: &DeviationFactor,
    extended: &DVector<f64>,
    above: &ShiftEstimate,
) -> Option<ShiftEstimate> {
    let (root, count) = (&factor.root, factor.signs.len());
    let step = Integration::of(form, factor)?;
    let own = root * step.weights.tr_mul(extended) * -1.0;
    // The group follows the one above by what it does not know itself.
    let known = root * step.weights.rows(0, count).transpose();
    let follows = DMatrix::identity(count, count) - &known;
    let given = root * &step.inverse * root.transpose();
    let covariance =
        |share: &DMatrix<f64>| &given + share * &above.whole_covariance * share.transpose();
    Some(ShiftEstimate {
        whole: &above.whole + &own,
        whole_covariance: covariance(&follows),
        own,
        own_covariance: covariance(&known),
    })
}
