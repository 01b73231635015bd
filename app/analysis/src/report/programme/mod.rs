//! The page of a programme: its runs, their results and figures, in one file for any browser.

mod lines;

pub use lines::{RunLine, SessionLoss, SpecimenPart};

use super::budget::budget_lines;
use super::calibration::{CalibrationDetails, calibration_page as calibration_text};
use super::cycles::{CycleReport, CycleSettings, cycles_text, picture as cycles_picture};
use super::fit_json::FitOverlay;
use super::picture;
use super::text::{parameter_lines, table};
use crate::cycles::of_session;
use crate::edited_session;
use crate::fit::SourceFit;
use crate::source::{self, RecordStretch};
use palpate_figures::page::{HtmlBody, document};
use palpate_model::calibration::{Calibration, ForceUncertainty};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::cycles::predict_cycles;
use palpate_rheology::fit::{FitOptions, FitReport, SystematicUncertainty};
use palpate_runner::programme::{
    FINISHED, Programme, ProgrammePosition, ProgrammeProgress, ProgrammeTask,
    calibration_from_session,
};
use palpate_sessions::{DataQuality, Manifest, Session};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug, Default, Serialize)]
pub struct TaskPart {
    pub task: String,
    /// Its protocol in words.
    pub title: String,
    /// Text beneath the title, line by line.
    pub text: String,
    /// Figures as SVG.
    #[serde(skip)]
    pub figures: Vec<String>,
    /// Parameters of the fit of each session that was fitted.
    pub fits: Vec<FitLine>,
    /// Error of the prediction for each session that was compared.
    pub predictions: Vec<PredictionLine>,
}

#[derive(Clone, Debug, Serialize)]
pub struct FitLine {
    pub session: String,
    pub parameters: Vec<palpate_rheology::fit::FittedParameter>,
    /// Root mean square of the residual in N.
    pub rmse_n: f64,
}

#[derive(Clone, Debug, Serialize)]
pub struct PredictionLine {
    pub session: String,
    /// The task whose fit predicted it.
    pub fitted: String,
    /// Root mean square in N.
    pub rms_n: f64,
    /// Root mean square in percent of the measured peak.
    pub rms_percent: f64,
    /// At the turning point, in N and percent of the peak.
    pub at_peak_n: f64,
    /// In percent of the peak.
    pub at_peak_percent: f64,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct ProgrammePage {
    /// The programme in words.
    pub title: String,
    pub purpose: String,
    pub runs: Vec<RunLine>,
    /// Every specimen, in the order in which it was met.
    pub specimens: Vec<SpecimenPart>,
    pub tasks: Vec<TaskPart>,
}

impl ProgrammePage {
    /// Reads every session of a programme and works out what it tells; `tell` hears of each task before it is read.
    pub fn of(
        programme: &Programme,
        folder: &Path,
        progress: &ProgrammeProgress,
        tell: &mut dyn FnMut(&str),
    ) -> Self {
        let mut page = Self {
            title: programme.title.clone(),
            purpose: programme.purpose.clone(),
            ..Self::default()
        };
        let mut bodies = FittedBodies::default();
        for (index, task) in programme.tasks.iter().enumerate() {
            tell(&task.name);
            let mut part = TaskPart {
                task: task.name.clone(),
                title: task.protocol.title.clone(),
                ..TaskPart::default()
            };
            for run in progress.runs.iter().filter(|run| run.0.task == index) {
                page.add_run(&mut part, &mut bodies, task, run, folder);
            }
            page.tasks.push(part);
        }
        page
    }

    fn add_run(
        &mut self,
        part: &mut TaskPart,
        bodies: &mut FittedBodies,
        task: &ProgrammeTask,
        (place, session, ending): &(ProgrammePosition, PathBuf, Option<String>),
        folder: &Path,
    ) {
        let name = session.display().to_string();
        let path = folder.join(session);
        let opened = edited_session::open(&path);
        let loss = SessionLoss::of(&opened, &path, ending.as_deref());
        // Edits of a session hold for its recorded state only.
        let whole = opened.as_ref().ok().filter(|_| loss.is_none());
        let verdict = whole.and_then(|one| one.edits.verdict());
        let is_rejected = opened.as_ref().ok().and_then(|one| one.rejection()).is_some();
        let verdict = verdict.map(|(verdict, edit)| match verdict {
            DataQuality::Valid => verdict.to_string(),
            _ => format!("{verdict}: {}", edit.reason),
        });
        let opened = opened.map(|one| one.session);
        let forces = opened.iter().flat_map(|session| &session.rows);
        let peak = forces.filter_map(|row| row.force).reduce(f64::max);
        let end = opened.as_ref().ok().and_then(|session| session.rows.last());
        let manifest = opened.as_ref().ok().map(|session| &session.manifest);
        let specimen = manifest.map(SpecimenPart::of).filter(|one| !one.specimen.is_empty());
        self.specimens.extend(specimen.filter(|one| !self.specimens.contains(one)));
        let word =
            |of: fn(&Manifest) -> &String| manifest.map_or(String::new(), |one| of(one).clone());
        self.runs.push(RunLine {
            task: task.name.clone(),
            repeat: place.repeat,
            attempt: place.attempt,
            session: name.clone(),
            ending: ending.clone(),
            loss: loss.as_ref().map(|(loss, _)| *loss),
            operator: word(|manifest| &manifest.operator),
            specimen: word(|manifest| &manifest.specimen),
            verdict,
            duration_s: end.map(|row| row.host.seconds().0),
            force_peak_n: peak,
        });
        let mut leave_out = |reason: &str| {
            let line = format!("{name}: {reason}, left out");
            bodies.left_out.push((task.name.clone(), line.clone()));
            part.line(&line);
        };
        match opened {
            _ if let Some((loss, reason)) = &loss => {
                leave_out(&format!("{} ({reason})", loss.word()));
            }
            // It is counted, and not fitted.
            Ok(_) if is_rejected => leave_out("rejected"),
            Ok(session) if ending.as_deref() == Some(FINISHED) => {
                part.read(task, &name, &session, bodies);
            }
            Ok(_) => {}
            Err(err) => part.line(&format!("{name}: {err}")),
        }
    }

    /// The table of runs as text.
    pub fn table(&self) -> String {
        let row = |run: &RunLine| {
            let attempt = match run.attempt {
                1 => String::new(),
                attempt => format!(" ({attempt}. attempt)"),
            };
            vec![
                run.task.clone(),
                format!("{}{attempt}", run.repeat),
                run.ended_by(),
                run.duration_s.map_or("-".into(), |duration| format!("{duration:.1}")),
                run.force_peak_n.map_or("-".into(), |peak| format!("{peak:.3}")),
                run.session.clone(),
                run.operator.clone(),
                run.specimen.clone(),
                run.verdict.clone().unwrap_or_default(),
            ]
        };
        let head = "task | repeat | ended by | duration (s) | peak (N) | session | operator | specimen | verdict";
        table(head, self.runs.iter().map(row))
    }

    /// A sentence that names missing and damaged finished sessions; `None` without any.
    pub fn loss_sentence(&self) -> Option<String> {
        let finished = self.runs.iter().filter(|run| run.ending.as_deref() == Some(FINISHED));
        let loss: Vec<String> = finished
            .filter_map(|run| Some(format!("{} is {}", run.session, run.loss?.word())))
            .collect();
        (!loss.is_empty()).then(|| {
            format!(
                "finished sessions are lost, so the page leaves them out ({}); restore them from a backup and run the same command, or begin in a new folder",
                loss.join(", ")
            )
        })
    }

    /// The page as one HTML file.
    pub fn html(&self) -> String {
        let mut body = HtmlBody::default();
        body.heading(1, &self.title);
        body.paragraph(&self.purpose);
        if let Some(loss_sentence) = self.loss_sentence() {
            body.strong(&format!("{}.", super::text::capital(&loss_sentence)));
        }
        body.heading(2, "Sessions");
        body.pre(&self.table());
        if !self.specimens.is_empty() {
            let specimens: Vec<String> = self.specimens.iter().map(SpecimenPart::text).collect();
            body.heading(2, "Specimens");
            body.pre(&specimens.join("\n"));
        }
        for part in &self.tasks {
            body.heading(2, &format!("{}: {}", part.task, part.title));
            body.pre(part.text.trim_end());
            for figure in &part.figures {
                body.figure(figure, &part.title);
            }
        }
        document(&self.title, body)
    }
}

impl TaskPart {
    fn line(&mut self, line: &str) {
        self.text += line;
        self.text += "\n";
    }

    /// Adds the result of one session: a calibration, cycles, a fit or the error of a prediction.
    fn read(
        &mut self,
        task: &ProgrammeTask,
        name: &str,
        session: &Session,
        bodies: &mut FittedBodies,
    ) {
        if task.calibrates {
            match calibration_from_session(session, &task.name) {
                Ok(calibration) => self.calibration(&calibration),
                Err(err) => self.line(&err.to_string()),
            }
            return;
        }
        let Ok(cycles) = of_session(session) else {
            return;
        };
        let report = CycleReport::of(name.to_owned(), cycles, &CycleSettings::default());
        if report.cycles.len() > 1 || !report.sines.is_empty() {
            self.line(&cycles_text(&report));
            self.figures.push(cycles_picture(&report));
        } else if let Ok(source) = source::of_session(session.clone(), RecordStretch::RampHold, &[])
            && report.cycles.len() == 1
        {
            let options = FitOptions::default();
            let fitted = SourceFit::with_systematic(source, None, &options);
            match &fitted.result {
                Ok(report) => self.fit(task, name, (&fitted, report), bodies),
                Err(err) => {
                    let line = format!("{name}: {err}");
                    self.line(&line);
                    bodies.left_out.push((task.name.clone(), line));
                }
            }
        }
    }

    fn calibration(&mut self, calibration: &Calibration) {
        match CalibrationDetails::of(calibration) {
            Ok(details) => {
                self.line(&calibration_text(calibration, None, &details, &[]));
                self.figures.push(super::calibration_plot::picture(calibration, &details));
            }
            Err(err) => self.line(&err.to_string()),
        }
    }

    fn fit(
        &mut self,
        task: &ProgrammeTask,
        name: &str,
        (fitted, report): (&SourceFit, &FitReport),
        bodies: &mut FittedBodies,
    ) {
        let samples = fitted.samples.as_slice();
        self.line(&format!("{name}:"));
        let budget = budget_lines(&report.parameters);
        for line in parameter_lines(&report.parameters).into_iter().chain(budget) {
            self.line(&line);
        }
        let systematic = fitted.systematic.iter().map(SystematicUncertainty::sentence);
        for remark in systematic.chain(fitted.notes.iter().cloned()) {
            self.line(&format!("  {remark}"));
        }
        self.fits.push(FitLine {
            session: name.to_owned(),
            parameters: report.parameters.clone(),
            rmse_n: report.rmse_n,
        });
        let model = task.validates.as_ref();
        let body = model.map(|model| bodies.of(&model.task));
        if let Some(Err(reason)) = &body {
            self.line(&format!("  not compared: {reason}"));
        }
        if let Some(Ok((fitted, body))) = body {
            match predict_cycles(body, samples) {
                Ok(found) => {
                    let line = PredictionLine {
                        session: name.to_owned(),
                        fitted: fitted.clone(),
                        rms_n: found.rms.0,
                        rms_percent: found.percent(found.rms),
                        at_peak_n: found.at_peak.value.0,
                        at_peak_percent: found.percent(found.at_peak.value),
                    };
                    self.line(&format!(
                        "  predicted by the fit of {fitted}: rms error {:.3} N, {:.1} % of the peak; at the peak {:+.3} N, {:+.1} %",
                        line.rms_n, line.rms_percent, line.at_peak_n, line.at_peak_percent
                    ));
                    self.predictions.push(line);
                }
                Err(err) => self.line(&format!("  {err}")),
            }
        }
        if self.figures.is_empty() {
            let band = fitted.calibration.as_ref().and_then(|one| ForceUncertainty::of(one).ok());
            let overlay = FitOverlay::of(report, samples);
            let drawn = picture::of_report(name, (samples, &overlay), report, band.as_ref());
            self.figures.push(drawn);
        }
        if !bodies.known.iter().any(|(known, _)| *known == task.name) {
            let found = report.kelvin().map(|body| (task.name.clone(), body));
            bodies.known.extend(found);
        }
    }
}

/// Fitted bodies that later tasks are compared with.
#[derive(Default)]
struct FittedBodies {
    /// Name of a task and the body of its first session that was fitted.
    known: Vec<(String, ModifiedKelvin)>,
    /// Name of a task and why a session of it was not fitted.
    left_out: Vec<(String, String)>,
}

impl FittedBodies {
    fn of(&self, task: &str) -> Result<&(String, ModifiedKelvin), String> {
        let body = self.known.iter().find(|(known, _)| known == task);
        body.ok_or_else(|| {
            let own = self.left_out.iter().filter(|(name, _)| name == task);
            let reasons: Vec<&str> = own.map(|(_, reason)| reason.as_str()).collect();
            match reasons.as_slice() {
                [] => format!("no session of task '{task}' was fitted"),
                reasons => {
                    format!("no session of task '{task}' was fitted: {}", reasons.join("; "))
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_wrote_is_text_and_no_markup() {
        let page = ProgrammePage {
            title: "a <b> & c".into(),
            purpose: String::new(),
            runs: Vec::new(),
            specimens: Vec::new(),
            tasks: Vec::new(),
        };
        assert!(page.html().contains("<h1>a &lt;b&gt; &amp; c</h1>"));
    }
}
