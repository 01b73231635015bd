//! One or several records with a family and one choice of free and shared parameters, as a linear problem for
//! any given outer parameters and contact positions (variable projection: Golub & Pereyra, SIAM J.
//! Numer. Anal. 10 (1973) 413-432).
//!
//! Every record is triangularised by itself with all its columns; the joint problem stacks those
//! small triangles with its columns mapped to the joint unknowns. So one record is the joint fit
//! of one, and fixing or sharing a parameter never touches the samples again.

use super::columns::{ColumnSource, ParameterPoint};
use super::options::{FitOptions, KnownParameter, Layout};
use super::parameters::union;
use super::record::{Record, check};
use super::sample::{FitError, FitSample, NamedSamples};
use super::signal::{ErrorColumns, SignalRecord, SignalTerm};
use crate::families::Family;
use std::sync::Arc;

/// Standard uncertainties from where its touch found it within which a contact is searched.
const CONTACT_REACH: f64 = 20.0;

/// One number the fit finds: a parameter of one record, or of all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unknown {
    pub parameter: usize,
    pub record: Option<usize>,
}

impl Unknown {
    pub fn is_of(self, record: usize) -> bool {
        self.record.is_none_or(|own| own == record)
    }
}

/// Where the outer parameters of a record may go.
#[derive(Clone, Debug)]
pub(super) struct Ranges {
    /// Of each outer parameter of the family, in its search coordinate.
    pub outers: Vec<(f64, f64)>,
    pub contact: (f64, f64),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rows {
    /// Blocks of samples, for searching.
    Thin,
    All,
}

/// Records, scales, and what is free.
#[derive(Clone, Debug)]
pub(super) struct System<'a> {
    pub records: Vec<Record<'a>>,
    pub source: ColumnSource,
    pub(super) options: FitOptions,
    /// Depth in mm that counts as one, in every record.
    pub depth_mm: f64,
    pub(super) sigma_scale: f64,
    /// Values in physical units, by record and parameter.
    pub(super) fixed: Vec<Vec<Option<f64>>>,
    pub(super) shared: Vec<bool>,
    /// Linear unknowns, then outer ones.
    pub unknowns: Vec<Unknown>,
    pub linear: usize,
    pub ranges: Vec<Ranges>,
    /// The signal of each record that has one, once the search is over.
    pub signals: Vec<Option<SignalTerm<'a>>>,
    pub errors: ErrorColumns,
}

impl<'a> System<'a> {
    pub fn new(
        records: &[NamedSamples<'a>],
        options: &FitOptions,
        shared: Vec<bool>,
    ) -> Result<Self, FitError> {
        let several = records.len() > 1;
        let layout = options.layout;
        let named = |name: &str, reason: FitError| match several {
            true => FitError::InRecord { record: name.to_owned(), reason: Box::new(reason) },
            false => reason,
        };
        let fixed = options.fixed.clone();
        let is_own = |k: &usize| fixed[*k].is_none() && !(several && shared[*k]);
        let own = (0..layout.count()).filter(is_own).count();
        let mut depth_mm = 0.0f64;
        for (name, samples) in records {
            let depth = check(samples, own, fixed[layout.contact()]);
            depth_mm = depth_mm.max(depth.map_err(|reason| named(name, reason))?);
        }
        let sigma_scale = records
            .iter()
            .flat_map(|(_, samples)| samples.iter())
            .find(|sample| sample.is_measured())
            .map_or(1.0, |sample| sample.sigma.0);
        let source = ColumnSource::new(Arc::clone(&options.family), options.is_at_rest);
        let mut system = Self {
            records: records
                .iter()
                .map(|&(name, samples)| Record::new(name, samples, depth_mm, sigma_scale))
                .collect(),
            source,
            options: options.clone(),
            depth_mm,
            sigma_scale,
            fixed: vec![fixed; records.len()],
            shared,
            unknowns: Vec::new(),
            linear: 0,
            ranges: Vec::new(),
            signals: vec![None; records.len()],
            errors: ErrorColumns::default(),
        };
        system.ranges = (0..records.len()).map(|k| system.range(k)).collect();
        for k in (0..layout.outers).filter(|&k| several && system.shared[k]) {
            // One relaxation time, one range: what any of the records can show.
            let all = union(system.ranges.iter().map(|one| one.outers[k]));
            system.ranges.iter_mut().for_each(|one| one.outers[k] = all);
        }
        let system = system.list_unknowns();
        let measured = system.measured();
        if measured < system.unknowns.len() {
            return Err(FitError::TooFewSamples {
                samples: measured,
                parameters: system.unknowns.len(),
            });
        }
        system.check_return()?;
        Ok(system)
    }

    pub fn layout(&self) -> Layout {
        self.source.layout
    }

    /// Name, unit and range of every parameter.
    pub fn known(&self) -> &[KnownParameter] {
        &self.options.known
    }

    fn list_unknowns(mut self) -> Self {
        let layout = self.layout();
        let records = self.records.len();
        let parameters = layout.linear().chain(0..layout.outers);
        let parameters = parameters.chain([layout.contact()]);
        self.unknowns = parameters
            .flat_map(|parameter| {
                let is_one = records == 1 || self.shared[parameter];
                (0..if is_one { 1 } else { records })
                    .filter(|&record| self.fixed[record][parameter].is_none())
                    .map(|record| Unknown { parameter, record: (!is_one).then_some(record) })
                    .collect::<Vec<_>>()
            })
            .collect();
        let linear = self.unknowns.iter();
        self.linear =
            linear.take_while(|unknown| layout.linear().contains(&unknown.parameter)).count();
        self
    }

    /// One of the records alone, with all its parameters its own.
    pub fn single_record(&self, record: usize) -> Self {
        Self {
            records: vec![self.records[record].clone()],
            fixed: vec![self.fixed[record].clone()],
            ranges: vec![self.range(record)],
            signals: vec![None],
            errors: ErrorColumns::default(),
            ..self.clone()
        }
        .list_unknowns()
    }

    /// The same with outer parameters the same in all records, and contact where each point has it.
    pub fn for_search(&self) -> Self {
        let mut system = self.clone();
        let outers = self.layout().outers;
        for k in 0..outers {
            let all = union(self.ranges.iter().map(|one| one.outers[k]));
            system.ranges.iter_mut().for_each(|one| one.outers[k] = all);
        }
        system.shared[..outers].fill(true);
        let contact = self.layout().contact();
        for fixed in &mut system.fixed {
            fixed[contact].get_or_insert(0.0);
        }
        system.list_unknowns()
    }

    /// The same with another member of the family, of the same parameters.
    pub fn with_member(&self, member: Arc<dyn Family>) -> Self {
        let mut system = self.clone();
        system.source.family = member;
        system
    }

    /// The same records with another family, its body the same in all.
    pub fn with_family(&self, options: &FitOptions) -> Self {
        let (own, layout) = (self.layout(), options.layout);
        let fixed = self.fixed.iter().map(|before| {
            let mut fixed = options.fixed.clone();
            fixed[layout.offset()] = before[own.offset()];
            fixed
        });
        let is_body = |k| layout.is_body(k);
        Self {
            fixed: fixed.collect(),
            source: ColumnSource::new(Arc::clone(&options.family), true),
            options: options.clone(),
            shared: (0..layout.count()).map(is_body).collect(),
            signals: vec![None; self.records.len()],
            errors: ErrorColumns::default(),
            ..self.clone()
        }
        .list_unknowns()
    }

    /// The same with a parameter of one record kept at a value, in all records where they share it.
    pub fn pinned(&self, record: usize, parameter: usize, value: f64) -> Self {
        let mut system = self.clone();
        for (other, fixed) in system.fixed.iter_mut().enumerate() {
            if self.shared[parameter] || other == record {
                fixed[parameter] = Some(value);
            }
        }
        system.list_unknowns()
    }

    /// Other records with the same choice of parameters.
    pub fn with_records<'b>(&self, records: &[NamedSamples<'b>]) -> Result<System<'b>, FitError>
    where
        'a: 'b,
    {
        System::new(records, &self.options, self.shared.clone())
    }

    /// The same with other forces in its records.
    pub fn with_samples<'b>(&self, samples: &'b [Vec<FitSample>]) -> System<'b>
    where
        'a: 'b,
    {
        let pairs = self.records.iter().zip(samples);
        System {
            records: pairs.map(|(record, samples)| Record { samples, ..record.clone() }).collect(),
            signals: vec![None; self.records.len()],
            errors: ErrorColumns::default(),
            ..self.clone()
        }
    }

    /// The same records with their signals: the measured zero takes the place of an offset, and contact is where its
    /// touch found it, to within the uncertainty of the touch. A contact position that was fixed stays, and with a fixed
    /// offset the forces are fitted: both are the caller's choice.
    pub fn with_signals(self, records: &[SignalRecord<'a>]) -> Self {
        let layout = self.layout();
        if self.options.fixed[layout.offset()].is_some() {
            return self;
        }
        let terms = records.iter().enumerate().map(|(record, own)| {
            let known = self.fixed[record][layout.contact()];
            SignalTerm::new(*own, known)
        });
        let terms = terms.collect();
        self.with_terms(terms)
    }

    /// The same records with these signals.
    pub fn with_terms(mut self, terms: Vec<Option<SignalTerm<'a>>>) -> Self {
        let layout = self.layout();
        for (record, term) in terms.into_iter().enumerate() {
            let Some(term) = term else { continue };
            let known = self.fixed[record][layout.contact()];
            self.fixed[record][layout.offset()] = Some(0.0);
            let assumed = known.filter(|_| self.options.is_contact_assumed);
            if let Some((contact, error)) = assumed.zip(term.contact_error_mm) {
                let reach = CONTACT_REACH * error;
                self.ranges[record].contact =
                    ((contact - reach) / self.depth_mm, (contact + reach) / self.depth_mm);
                self.fixed[record][layout.contact()] = None;
            }
            self.signals[record] = Some(term);
        }
        self.list_unknowns()
    }

    /// The same records without their signals.
    pub fn without_signals(&self) -> Self {
        if !self.has_signal() {
            return self.clone();
        }
        let mut system = self.clone();
        system.fixed = vec![self.options.fixed.clone(); self.records.len()];
        system.signals = vec![None; self.records.len()];
        system.errors = ErrorColumns::default();
        for record in 0..self.records.len() {
            system.ranges[record].contact = self.range(record).contact;
        }
        system.list_unknowns()
    }

    /// Points with contact positions where they are kept.
    pub fn at_fixed_contacts(&self, points: &[ParameterPoint]) -> Vec<ParameterPoint> {
        let mut points = points.to_vec();
        for (record, point) in points.iter_mut().enumerate() {
            if let Some(contact) = self.fixed_contact(record) {
                point.outer.contact = contact;
            }
        }
        points
    }

    pub fn has_signal(&self) -> bool {
        self.signals.iter().any(Option::is_some)
    }

    /// Samples whose force counts, in all records.
    pub fn measured(&self) -> usize {
        self.records.iter().map(|record| record.measured).sum()
    }

    /// Value a parameter of a record is kept at, in its unit.
    pub fn fixed(&self, record: usize, parameter: usize) -> Option<f64> {
        self.fixed[record][parameter]
    }

    /// Whether a record's contact position is found.
    pub fn is_contact_free(&self, record: usize) -> bool {
        self.fixed(record, self.layout().contact()).is_none()
    }

    /// Scaled contact position kept, if it is.
    pub fn fixed_contact(&self, record: usize) -> Option<f64> {
        let contact = self.fixed(record, self.layout().contact());
        contact.map(|mm| mm / self.depth_mm)
    }

    /// Which linear unknowns must not be negative.
    pub fn bounds(&self) -> Vec<bool> {
        let linear = self.unknowns[..self.linear].iter();
        linear.map(|unknown| self.known()[unknown.parameter].is_bound).collect()
    }

    /// The rows from which a solution is found many times cheaper, and a small share of a standard error from it; all of
    /// them where these cost as little.
    pub fn search_rows(&self) -> Rows {
        // Thinned records know neither the zero nor the curve of a signal.
        match self.source.is_fast() || self.has_signal() {
            true => Rows::All,
            false => Rows::Thin,
        }
    }

    /// The first coefficient that must not be negative and is at zero: what the records do not hold ends there.
    pub fn first_zero(&self, points: &[ParameterPoint]) -> Option<usize> {
        let layout = self.layout();
        let is_zero = |record: usize, point: &ParameterPoint, k: usize| {
            let parameter = layout.outers + k;
            let is_free = self.fixed(record, parameter).is_none();
            is_free && self.known()[parameter].is_bound && point.at[k] <= 0.0
        };
        let mut each = points.iter().enumerate();
        each.find_map(|(record, point)| {
            let mut all = 0..layout.coefficients;
            let place = all.find(|&k| is_zero(record, point, k));
            place.map(|k| layout.outers + k)
        })
    }

    /// The linear unknowns that are not at a bound of theirs.
    pub fn passive(&self, points: &[ParameterPoint]) -> Vec<usize> {
        let outers = self.layout().outers;
        let is_passive = |k: &usize| {
            let unknown = self.unknowns[*k];
            let at = &points[unknown.record.unwrap_or(0)].at;
            !self.known()[unknown.parameter].is_bound || at[unknown.parameter - outers] > 0.0
        };
        (0..self.linear).filter(is_passive).collect()
    }

    /// Weight of a sample relative to the first.
    pub fn weight(&self, sample: &FitSample) -> f64 {
        self.sigma_scale / sample.sigma.0
    }
}
