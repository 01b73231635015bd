//! The restricted likelihood of nested variances, and its exact gradient, in one pass up a tree and one down.
//!
//! Given what is above it, what a group says of its means is a quadratic form of the group's own shift, the effects and one:
//! the sum of its members' forms. Integrating the shift out is a step of the size of one group (Pinheiro & Bates,
//! Mixed-Effects Models in S and S-PLUS, 2000, section 2.2.3), so that cost and storage grow with the number of sessions and
//! not with its square. The spreads enter by a factor L of their covariance L L', so that a spread of zero is a value like
//! any other. The gradient follows the same steps backwards.

use crate::study::{Evidence, NestedStudy};
use nalgebra::{Cholesky, DMatrix, DVector};

/// Quadratic forms of one group's members, or their adjoints: of its shift, the effects and one.
type Form = DMatrix<f64>;

/// A shift that is integrated out of a form.
struct Integration {
    /// The columns of the shift times the factor.
    columns: DMatrix<f64>,
    /// Those times the inverse of `scaled`.
    weights: DMatrix<f64>,
    /// One and the form of the shift in units of its spread.
    scaled: Cholesky<f64, nalgebra::Dyn>,
}

impl Integration {
    fn of(form: &Form, factor: &DMatrix<f64>) -> Option<Self> {
        let count = factor.nrows();
        let columns = form.columns(0, count) * factor;
        let mut scaled = factor.tr_mul(&columns.rows(0, count));
        (0..count).for_each(|k| scaled[(k, k)] += 1.0);
        let scaled = Cholesky::new(scaled)?;
        let weights = scaled.solve(&columns.transpose()).transpose();
        Some(Self { columns, weights, scaled })
    }

    fn form(&self, form: &Form) -> Form {
        form - &self.weights * self.columns.transpose()
    }

    fn log_determinant(&self) -> f64 {
        log_determinant(&self.scaled)
    }

    /// The adjoint of the form from that of what is left of it; adds to that of the factor.
    fn adjoint(
        &self,
        form: &Form,
        factor: &DMatrix<f64>,
        after: &Form,
        of_factor: &mut DMatrix<f64>,
    ) -> Form {
        let count = factor.nrows();
        let of_columns = after * &self.weights * -2.0;
        let of_scaled = self.weights.tr_mul(&(after * &self.weights)) + self.scaled.inverse();
        *of_factor += form.columns(0, count).tr_mul(&of_columns)
            + form.view((0, 0), (count, count)) * factor * &of_scaled * 2.0;
        let mut before = after.clone();
        let half = of_columns * factor.transpose() * 0.5;
        let mut columns = before.columns_mut(0, count);
        columns += &half;
        let mut rows = before.rows_mut(0, count);
        rows += half.transpose();
        let mut own = before.view_mut((0, 0), (count, count));
        own += factor * of_scaled * factor.transpose();
        before
    }
}

fn log_determinant(factor: &Cholesky<f64, nalgebra::Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|value| value.ln()).sum::<f64>()
}

/// The means at given spreads, and how well these explain the sessions.
#[derive(Clone, Debug)]
pub(crate) struct Evaluation {
    /// Minus twice the logarithm of the restricted likelihood, without what no spread changes.
    pub criterion: f64,
    /// Effects, those of the first column for all parameters first.
    pub effects: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// Sums over the members of every group at given spreads.
struct Sums {
    /// Of each level but the sessions' own.
    groups: Vec<Vec<Form>>,
    root: Form,
    log_determinant: f64,
}

impl NestedStudy {
    /// Length of a form.
    fn width(&self) -> usize {
        self.parameters * (1 + self.effects) + 1
    }

    fn levels(&self) -> usize {
        self.parents.len() + 1
    }

    /// Restricted likelihood and means; `None` where a spread of zero leaves a session impossible, or effects cannot be told
    /// apart.
    pub fn evaluate(&self, factors: &[DMatrix<f64>]) -> Option<Evaluation> {
        self.means(&self.sums(factors)?)
    }

    /// Those with the gradient of the criterion by the factor of each level, the outermost first.
    pub fn evaluate_with_gradient(
        &self,
        factors: &[DMatrix<f64>],
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

    fn sums(&self, factors: &[DMatrix<f64>]) -> Option<Sums> {
        let zero = || DMatrix::zeros(self.width(), self.width());
        let mut groups: Vec<Vec<Form>> =
            self.parents.iter().map(|parents| vec![zero(); parents.len()]).collect();
        let mut root = zero();
        let mut logarithm = 0.0;
        let innermost = &factors[self.parents.len()];
        let exact = innermost.clone() * innermost.transpose();
        for (index, session) in self.sessions.iter().enumerate() {
            let weight = match &session.evidence {
                Evidence::Exact => {
                    let factor = Cholesky::new(exact.clone())?;
                    logarithm += log_determinant(&factor);
                    factor.inverse()
                }
                Evidence::Information(information) => {
                    let step = Integration::of(information, innermost)?;
                    logarithm += step.log_determinant();
                    step.form(information)
                }
            };
            let sum = match groups.last_mut() {
                Some(innermost) => &mut innermost[self.owner[index]],
                None => &mut root,
            };
            self.add_session(sum, index, &weight);
        }
        for level in (0..groups.len()).rev() {
            let (outer, own) = groups.split_at_mut(level);
            for (form, parent) in own[0].iter().zip(&self.parents[level]) {
                let step = Integration::of(form, &factors[level])?;
                logarithm += step.log_determinant();
                let sum = match outer.last_mut() {
                    Some(outer) => &mut outer[*parent],
                    None => &mut root,
                };
                *sum += step.form(form);
            }
        }
        Some(Sums { groups, root, log_determinant: logarithm })
    }

    /// One and the effects of a session.
    fn multipliers(&self, session: usize) -> impl Iterator<Item = f64> {
        std::iter::once(1.0).chain(self.sessions[session].design.iter().copied())
    }

    /// Adds what a session says, whose residual is shift + effects - values, each weighted.
    fn add_session(&self, sum: &mut Form, session: usize, weight: &DMatrix<f64>) {
        let (count, last) = (self.parameters, self.width() - 1);
        let values = self.sessions[session].vector();
        let weighted = weight * &values;
        for (a, first) in self.multipliers(session).enumerate() {
            for (b, second) in self.multipliers(session).enumerate() {
                let share = first * second;
                if share != 0.0 {
                    let mut block = sum.view_mut((a * count, b * count), (count, count));
                    block += weight * share;
                }
            }
            for k in 0..count {
                sum[(a * count + k, last)] -= first * weighted[k];
                sum[(last, a * count + k)] -= first * weighted[k];
            }
        }
        sum[(last, last)] += weighted.dot(&values);
    }

    /// The adjoint of a session's weight.
    fn weight_adjoint(&self, adjoint: &Form, session: usize) -> DMatrix<f64> {
        let (count, last) = (self.parameters, self.width() - 1);
        let values = self.sessions[session].vector();
        let mut sum = &values * values.transpose() * adjoint[(last, last)];
        for (a, first) in self.multipliers(session).enumerate() {
            for (b, second) in self.multipliers(session).enumerate() {
                sum += adjoint.view((a * count, b * count), (count, count)) * (first * second);
            }
            let column = adjoint.view((a * count, last), (count, 1)) * first;
            sum -= &column * values.transpose() + &values * column.transpose();
        }
        sum
    }

    fn gradient(
        &self,
        sums: &Sums,
        factors: &[DMatrix<f64>],
        root: &Form,
    ) -> Option<Vec<DMatrix<f64>>> {
        let count = self.parameters;
        let mut gradient = vec![DMatrix::zeros(count, count); self.levels()];
        let mut above: Vec<Form> = vec![root.clone()];
        for (level, forms) in sums.groups.iter().enumerate() {
            let own = forms.iter().zip(&self.parents[level]).map(|(form, parent)| {
                let step = Integration::of(form, &factors[level])?;
                let sum = &mut gradient[level];
                Some(step.adjoint(form, &factors[level], &above[*parent], sum))
            });
            above = own.collect::<Option<_>>()?;
        }
        let innermost = &factors[self.parents.len()];
        let sum = &mut gradient[self.parents.len()];
        for (index, session) in self.sessions.iter().enumerate() {
            let adjoint = self.weight_adjoint(&above[self.owner[index]], index);
            match &session.evidence {
                Evidence::Exact => {
                    let inverse = (innermost * innermost.transpose()).try_inverse()?;
                    let covariance = &inverse - &inverse * adjoint * &inverse;
                    *sum += covariance * innermost * 2.0;
                }
                Evidence::Information(information) => {
                    let step = Integration::of(information, innermost)?;
                    step.adjoint(information, innermost, &adjoint, sum);
                }
            }
        }
        Some(gradient)
    }

    /// The most probable shift of every group against the mean of its sessions' effects, with its covariance given the
    /// spreads and the effects; of each level, then of the sessions.
    pub fn shifts(
        &self,
        factors: &[DMatrix<f64>],
        effects: &DVector<f64>,
    ) -> Option<Vec<Vec<(DVector<f64>, DMatrix<f64>)>>> {
        let sums = self.sums(factors)?;
        let count = self.parameters;
        let mut above = vec![(DVector::zeros(count), DMatrix::zeros(count, count))];
        let mut all = Vec::with_capacity(self.levels());
        for (level, forms) in sums.groups.iter().enumerate() {
            let factor = &factors[level];
            let own = forms.iter().zip(&self.parents[level]).map(|(form, parent)| {
                let (shift, covariance) = &above[*parent];
                member(form, factor, &self.extended(shift, effects), covariance)
            });
            let own = own.collect::<Option<Vec<_>>>()?;
            all.push(own.clone());
            above = own;
        }
        let factor = &factors[self.parents.len()];
        let sessions = self.sessions.iter().enumerate().map(|(index, session)| {
            let (shift, covariance) = &above[self.owner[index]];
            let mean = self.session_mean(index, effects);
            match &session.evidence {
                Evidence::Exact => Some((session.vector() - mean, DMatrix::zeros(count, count))),
                Evidence::Information(information) => {
                    let residual = shift + mean - session.vector();
                    let (own, covariance) = member(information, factor, &residual, covariance)?;
                    // The form's first argument is the residual, so that only the change of it is the shift's.
                    Some((shift + (own - &residual), covariance))
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

/// The shift of a group in its population, given that of the group above with its covariance: the start of `extended` and
/// the change that the form asks for.
fn member(
    form: &Form,
    factor: &DMatrix<f64>,
    extended: &DVector<f64>,
    above: &DMatrix<f64>,
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let count = factor.nrows();
    let step = Integration::of(form, factor)?;
    let change = factor * step.weights.tr_mul(extended);
    let shift = extended.rows(0, count) - change;
    let own = factor * step.scaled.inverse() * factor.transpose();
    let keeps = DMatrix::identity(count, count) - factor * step.weights.rows(0, count).transpose();
    Some((shift, own + &keeps * above * keeps.transpose()))
}
