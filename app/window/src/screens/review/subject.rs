//! One session of those shown: what was read of it, its fit, and the points drawn.

use super::ReviewSource;
use crate::plots::stretches::{LineWindow, Stretches};
use crate::widgets::ModelChoice;
use crate::workers::review::fit::{self, SessionFit};
use crate::workers::review::{Quantity, ReviewRecording, Stage, TimeOrigin};
use eframe::egui::Context;
use egui_plot::PlotPoint;
use palpate_analysis::report::session::SessionNameParts;
use palpate_model::rig::Phase;
use palpate_model::signal::pyramid::column_for;
use palpate_model::signal::track::SignalTrack;
use std::sync::Arc;

/// A session that is shown.
pub struct ReviewSubject {
    pub source: ReviewSource,
    /// Its own as long as it is shown.
    pub id: u64,
    /// Place of its colour among those of sessions.
    pub color: usize,
    pub name: String,
    /// The parts of its name; none before they are read.
    pub parts: Option<SessionNameParts>,
    pub recording: ReviewRecording,
    /// None before a fit was asked for.
    pub fit: Option<Result<Arc<SessionFit>, String>>,
    pub lines: [Stretches; 6],
    pub loop_means: LoopMeans,
    /// Lowest and highest of each quantity, found for so many samples.
    ends: (u64, [Option<[f64; 2]>; 4]),
}

/// The line through the means of force over those of depth.
#[derive(Debug)]
pub struct LoopMeans {
    /// Stretches without a gap.
    pub stretches: Vec<Vec<PlotPoint>>,
    /// Samples of whose mean a point is.
    pub column: usize,
}

/// Points of such a line: far more than a loop bends, and few enough for a frame.
const LOOP_POINTS: f64 = 2000.0;

impl Default for LoopMeans {
    fn default() -> Self {
        Self { stretches: Vec::new(), column: 1 }
    }
}

impl LoopMeans {
    fn of(track: &SignalTrack) -> Self {
        let Some(span) = track.span() else { return Self::default() };
        let means = |quantity: Quantity| {
            let mut found = Vec::new();
            track.columns(quantity as usize, span, LOOP_POINTS, |_, column| found.push(column));
            found
        };
        let (depths, forces) = (means(Quantity::Depth), means(Quantity::Force));
        let pairs = depths.into_iter().zip(forces).map(|(depth, force)| {
            let (depth, force) = (depth?, force?);
            Some(PlotPoint::new(f64::from(depth.mean), f64::from(force.mean)))
        });
        let pairs: Vec<Option<PlotPoint>> = pairs.collect();
        let stretches = pairs.split(Option::is_none).filter(|part| !part.is_empty());
        Self {
            stretches: stretches.map(|part| part.iter().copied().flatten().collect()).collect(),
            column: column_for(track.len(), LOOP_POINTS),
        }
    }
}

/// Places of the fit's lines behind those of the quantities.
pub const LINE_MODELLED: usize = 4;
pub const LINE_RESIDUAL: usize = 5;

impl ReviewSubject {
    /// A session that is still to be read.
    #[must_use]
    pub fn new(source: ReviewSource, id: u64) -> Self {
        let recording = ReviewRecording::new(&source.session, source.analysis.as_deref());
        Self {
            name: recording.name(),
            parts: None,
            source,
            id,
            color: 0,
            recording,
            fit: None,
            lines: Default::default(),
            loop_means: LoopMeans::default(),
            ends: (0, [None; 4]),
        }
    }

    /// Fetches what was read; a session that is to be read by another analysis begins again.
    pub fn poll(&mut self) {
        if self.recording.analysis != self.source.analysis {
            self.read_again();
            self.fit = None;
        }
        let before = self.recording.version;
        self.recording.poll();
        if self.recording.version == before {
            return;
        }
        self.name = self.recording.name();
        self.parts = self.recording.name_parts();
        if let Some(analysis) = &self.source.analysis {
            self.name = format!("{} as {analysis}", self.name);
        }
        let track = &self.recording.track;
        let ends = Quantity::ALL.map(|quantity| track.extremes(quantity as usize, 0, track.len()));
        self.ends = (self.recording.version, ends);
        self.loop_means = LoopMeans::of(track);
    }

    /// Begins to read it, if it waits for that.
    pub fn begin(&mut self, ctx: &Context) -> bool {
        let is_waiting = self.recording.stage == Stage::Waiting;
        if is_waiting {
            self.recording.start(ctx);
        }
        is_waiting && self.recording.is_reading()
    }

    pub fn read_again(&mut self) {
        let version = self.recording.version + 1;
        let analysis = self.source.analysis.as_deref();
        self.recording = ReviewRecording::new(&self.source.session, analysis);
        self.recording.version = version;
    }

    /// Whether nothing more of it will come.
    pub fn is_settled(&self) -> bool {
        !matches!(self.recording.stage, Stage::Waiting | Stage::Reading)
    }

    /// Changes with every fifth of it that was read, so that lines are not found again for every piece.
    pub fn fifths(&self) -> u64 {
        match self.is_settled() {
            true => (1 << 63) | self.recording.version,
            false => (self.recording.share() * 5.0) as u64,
        }
    }

    /// Takes a fit that was made of it.
    pub fn set_fit(&mut self, fit: Result<Arc<SessionFit>, String>) {
        self.fit = Some(fit);
        self.recording.version += 1;
    }

    pub fn fitted(&self) -> Option<&SessionFit> {
        self.fit.as_ref()?.as_ref().ok().map(Arc::as_ref)
    }

    /// Lowest and highest value of a quantity.
    pub fn extremes(&self, quantity: Quantity) -> Option<[f64; 2]> {
        self.ends.1[quantity as usize]
    }

    /// Time of the session that stands at zero; none where it has no such moment.
    pub fn moment(&self, time_origin: TimeOrigin) -> Option<f64> {
        match time_origin {
            TimeOrigin::Start => Some(0.0),
            TimeOrigin::Contact => {
                let facts = self.recording.facts.as_ref()?;
                facts.contact_time(&self.recording.track)
            }
            TimeOrigin::Ramp => self.recording.phase_start(Phase::Ramp),
        }
    }

    /// By how much it is laid earlier, in s.
    pub fn shift(&self, time_origin: TimeOrigin) -> f64 {
        self.moment(time_origin).unwrap_or(0.0)
    }

    /// What a fit takes of it.
    pub fn for_fit(&self, model: &ModelChoice) -> fit::FitSubject {
        let begins = [Phase::Ramp, Phase::Hold].map(|phase| self.recording.phase_start(phase));
        let first = begins.into_iter().flatten().reduce(f64::min);
        fit::FitSubject {
            path: self.source.session.clone(),
            name: self.name.clone(),
            analysis: self.source.analysis.clone(),
            family: model.family.clone(),
            is_rejected_included: model.is_rejected_included,
            ramp_t: first.unwrap_or(0.0),
        }
    }

    /// Finds the points of a quantity again where something changed.
    pub fn update(&mut self, quantity: Quantity, window: LineWindow) {
        let place = quantity as usize;
        self.lines[place].update(&self.recording.track, place, window);
    }

    /// Samples of whose mean a point of the lines over time is, of the coarsest of these quantities.
    pub fn column(&self, quantities: &[Quantity]) -> usize {
        let of = |quantity: &Quantity| self.lines[*quantity as usize].samples_per_column();
        quantities.iter().map(of).fold(1, usize::max)
    }

    /// The same of its fit.
    pub fn update_fit(&mut self, window: LineWindow) {
        let Some(Ok(fit)) = &self.fit else { return };
        for (line, column) in [(LINE_MODELLED, fit::MODELLED), (LINE_RESIDUAL, fit::RESIDUAL)] {
            self.lines[line].update(&fit.track, column, window);
        }
    }

    #[must_use]
    pub fn line_window(
        &self,
        window: [f64; 2],
        pixels: f64,
        time_origin: TimeOrigin,
    ) -> LineWindow {
        LineWindow {
            window,
            pixels,
            shift: self.shift(time_origin),
            version: self.recording.version,
        }
    }
}
