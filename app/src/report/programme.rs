//! The page that a programme leaves: what was run, what it told, with figures, in one file that any browser shows.

use super::calibration::{Told, whole as calibration_text};
use super::cycles::{CycleReport, Question, picture as cycles_picture, whole as cycles_text};
use super::picture;
use super::text::{in_columns, parameter_lines};
use palpate_model::calibration::{Calibration, ForceUncertainty};
use palpate_model::cycles::predict;
use palpate_model::fit::{FitOptions, FitReport, fit};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_protocols::analysis::{self, Stretch};
use palpate_protocols::cycles::of_session;
use palpate_protocols::edited;
use palpate_protocols::programme::{Programme, Progress, Task, calibration_of};
use palpate_sessions::{Manifest, Session, Verdict};
use serde::Serialize;
use std::path::Path;

/// One run in the table of the page.
#[derive(Clone, Debug, Serialize)]
pub struct RunLine {
    /// Its task.
    pub task: String,
    /// Which repeat, from 1.
    pub repeat: u32,
    /// Which attempt at it, from 1.
    pub attempt: u32,
    /// Its session folder, from the programme's.
    pub session: String,
    /// How it ended; none if it broke off.
    pub ending: Option<String>,
    /// Who ran it, as its session says.
    pub operator: String,
    /// What was indented, as its session says.
    pub specimen: String,
    /// What it is worth, with the reason where it is not valid; none if nobody said.
    pub verdict: Option<String>,
    /// Session time in s.
    pub duration_s: f64,
    /// Highest force in N, where force was known.
    pub force_peak_n: Option<f64>,
}

/// What sessions tell of one specimen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpecimenPart {
    /// Its name.
    pub specimen: String,
    /// With which probe it was indented.
    pub indenter: String,
    /// What else is told of it, by key; not its place in the series.
    pub told: Vec<(String, String)>,
}

impl SpecimenPart {
    fn of(manifest: &Manifest) -> Self {
        let lines = manifest.about.lines().into_iter();
        Self {
            specimen: manifest.specimen.clone(),
            indenter: manifest.indenter.clone(),
            told: lines
                .filter(|(key, _)| !key.starts_with("series."))
                .map(|(key, value)| (key.to_owned(), value))
                .collect(),
        }
    }

    fn text(&self) -> String {
        let told = self.told.iter();
        let told: Vec<String> = told
            .map(|(key, value)| format!("  {key}: {value}"))
            .collect();
        let probe = match self.indenter.as_str() {
            "" => String::new(),
            indenter => format!(", with the {indenter}"),
        };
        format!("{}{probe}\n{}", self.specimen, told.join("\n"))
    }
}

/// What one task told.
#[derive(Clone, Debug, Serialize)]
pub struct TaskPart {
    /// Its name.
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

/// The fit of one session.
#[derive(Clone, Debug, Serialize)]
pub struct FitLine {
    /// Its folder.
    pub session: String,
    /// Names, values and standard errors.
    pub parameters: Vec<palpate_model::fit::Parameter>,
    /// Root mean square of the residual in N.
    pub rmse_n: f64,
}

/// The error of a prediction.
#[derive(Clone, Debug, Serialize)]
pub struct PredictionLine {
    /// The session that was predicted.
    pub session: String,
    /// The task whose fit predicted it.
    pub fitted: String,
    /// Root mean square in N.
    pub rms_n: f64,
    /// The same in percent of the measured peak.
    pub rms_percent: f64,
    /// At the turning point, in N and percent of the peak.
    pub at_peak_n: f64,
    /// In percent of the peak.
    pub at_peak_percent: f64,
}

/// Everything on the page.
#[derive(Clone, Debug, Serialize)]
pub struct Page {
    /// The programme in words.
    pub title: String,
    /// What it is for.
    pub purpose: String,
    /// Every run.
    pub runs: Vec<RunLine>,
    /// Every specimen, in the order in which it was met.
    pub specimens: Vec<SpecimenPart>,
    /// Every task.
    pub tasks: Vec<TaskPart>,
}

impl Page {
    /// Reads every session of a programme and works out what it tells; `tell` hears of each task before it is read.
    pub fn of(
        programme: &Programme,
        folder: &Path,
        progress: &Progress,
        tell: &mut dyn FnMut(&str),
    ) -> Self {
        let mut page = Self {
            title: programme.title.clone(),
            purpose: programme.purpose.clone(),
            runs: Vec::new(),
            specimens: Vec::new(),
            tasks: Vec::new(),
        };
        let mut bodies: Vec<(String, ModifiedKelvin)> = Vec::new();
        for (index, task) in programme.tasks.iter().enumerate() {
            tell(&task.name);
            let mut part = TaskPart {
                task: task.name.clone(),
                title: task.protocol.title.clone(),
                text: String::new(),
                figures: Vec::new(),
                fits: Vec::new(),
                predictions: Vec::new(),
            };
            for (place, session, ending) in progress.runs.iter().filter(|run| run.0.task == index) {
                let name = session.display().to_string();
                let opened = edited::open(&folder.join(session));
                let verdict = opened.as_ref().ok().and_then(|one| one.edits.verdict());
                let rejection = opened.as_ref().ok().and_then(|one| one.rejection());
                let is_rejected = rejection.is_some();
                let verdict = verdict.map(|(verdict, edit)| match verdict {
                    Verdict::Valid => verdict.to_string(),
                    _ => format!("{verdict}: {}", edit.reason),
                });
                let opened = opened.map(|one| one.session);
                let forces = opened.iter().flat_map(|session| &session.rows);
                let peak = forces.filter_map(|row| row.force).reduce(f64::max);
                let end = opened.as_ref().ok().and_then(|session| session.rows.last());
                let manifest = opened.as_ref().ok().map(|session| &session.manifest);
                let told = manifest.map(SpecimenPart::of);
                let told = told.filter(|one| !one.specimen.is_empty());
                page.specimens
                    .extend(told.filter(|one| !page.specimens.contains(one)));
                let word = |of: fn(&Manifest) -> &String| {
                    manifest.map_or(String::new(), |one| of(one).clone())
                };
                page.runs.push(RunLine {
                    task: task.name.clone(),
                    repeat: place.repeat,
                    attempt: place.attempt,
                    session: name.clone(),
                    ending: ending.clone(),
                    operator: word(|manifest| &manifest.operator),
                    specimen: word(|manifest| &manifest.specimen),
                    verdict,
                    duration_s: end.map_or(0.0, |row| row.host.seconds().0),
                    force_peak_n: peak,
                });
                match opened {
                    // It stays in the count and tells nothing.
                    Ok(_) if is_rejected => part.line(&format!("{name}: rejected, left out")),
                    Ok(session) if ending.as_deref() == Some("finish") => {
                        part.read(task, &name, &session, &mut bodies);
                    }
                    Ok(_) => {}
                    Err(err) => part.line(&format!("{name}: {err}")),
                }
            }
            page.tasks.push(part);
        }
        page
    }

    /// The table of runs as text.
    #[must_use]
    pub fn table(&self) -> String {
        let head = [
            "task", "repeat", "ended by", "s", "peak N", "session", "operator", "specimen",
            "verdict",
        ];
        let mut lines = vec![head.map(str::to_owned).to_vec()];
        lines.extend(self.runs.iter().map(|run| {
            let attempt = match run.attempt {
                1 => String::new(),
                attempt => format!(" ({attempt}. attempt)"),
            };
            vec![
                run.task.clone(),
                format!("{}{attempt}", run.repeat),
                run.ending.clone().unwrap_or_else(|| "breaking off".into()),
                format!("{:.1}", run.duration_s),
                run.force_peak_n
                    .map_or("-".into(), |peak| format!("{peak:.3}")),
                run.session.clone(),
                run.operator.clone(),
                run.specimen.clone(),
                run.verdict.clone().unwrap_or_default(),
            ]
        }));
        in_columns(&lines)
    }

    /// The page in HTML, whole in itself.
    #[must_use]
    pub fn html(&self) -> String {
        let mut body = format!(
            "<h1>{}</h1>\n<p>{}</p>\n<h2>Sessions</h2>\n<pre>{}</pre>\n",
            escape(&self.title),
            escape(&self.purpose),
            escape(&self.table())
        );
        if !self.specimens.is_empty() {
            let specimens: Vec<String> = self.specimens.iter().map(SpecimenPart::text).collect();
            body += &format!(
                "<h2>Specimens</h2>\n<pre>{}</pre>\n",
                escape(&specimens.join("\n"))
            );
        }
        for part in &self.tasks {
            body += &format!(
                "<h2>{}: {}</h2>\n<pre>{}</pre>\n{}\n",
                escape(&part.task),
                escape(&part.title),
                escape(part.text.trim_end()),
                part.figures.join("\n")
            );
        }
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{}</title>\n\
             <style>body {{ font-family: sans-serif; max-width: 62rem; margin: 2rem auto; }} \
             pre {{ overflow-x: auto; }} svg {{ max-width: 100%; height: auto; }}</style>\n</head>\n\
             <body>\n{body}</body>\n</html>\n",
            escape(&self.title)
        )
    }
}

impl TaskPart {
    fn line(&mut self, line: &str) {
        self.text += line;
        self.text += "\n";
    }

    /// What one session adds: a calibration, cycles, a fit or the error of a prediction.
    fn read(
        &mut self,
        task: &Task,
        name: &str,
        session: &Session,
        bodies: &mut Vec<(String, ModifiedKelvin)>,
    ) {
        if task.calibrates {
            match calibration_of(session, &task.name) {
                Ok(calibration) => self.calibration(&calibration),
                Err(err) => self.line(&err.to_string()),
            }
            return;
        }
        let Ok(cycles) = of_session(session) else {
            return;
        };
        let report = CycleReport::of(name.to_owned(), cycles, &Question::default());
        if report.cycles.len() > 1 || !report.sines.is_empty() {
            self.line(&cycles_text(&report));
            self.figures.push(cycles_picture(&report));
        } else if let Ok(samples) = analysis::samples_of(session, Stretch::RampHold)
            && report.cycles.len() == 1
        {
            match fit(&samples, &FitOptions::default()) {
                Ok(fitted) => self.fit(task, name, session, (&samples, &fitted), bodies),
                Err(err) => self.line(&format!("{name}: {err}")),
            }
        }
    }

    fn calibration(&mut self, calibration: &Calibration) {
        match Told::of(calibration) {
            Ok(told) => {
                self.line(&calibration_text(calibration, None, &told, &[]));
                self.figures
                    .push(super::calibration_plot::picture(calibration, &told));
            }
            Err(err) => self.line(&err.to_string()),
        }
    }

    fn fit(
        &mut self,
        task: &Task,
        name: &str,
        session: &Session,
        (samples, report): (&[palpate_model::fit::FitSample], &FitReport),
        bodies: &mut Vec<(String, ModifiedKelvin)>,
    ) {
        self.line(&format!("{name}:"));
        for line in parameter_lines(&report.parameters) {
            self.line(&line);
        }
        self.fits.push(FitLine {
            session: name.to_owned(),
            parameters: report.parameters.clone(),
            rmse_n: report.rmse_n,
        });
        let model = task.validates.as_ref();
        let body = model.and_then(|model| bodies.iter().find(|(task, _)| *task == model.task));
        if let Some((fitted, body)) = body {
            match predict(body, samples) {
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
            let calibration =
                serde_json::from_value::<Calibration>(session.manifest.calibration.clone());
            let band = calibration
                .ok()
                .and_then(|one| ForceUncertainty::of(&one).ok());
            self.figures
                .push(picture::of_report(name, samples, report, band.as_ref()));
        }
        if !bodies.iter().any(|(known, _)| *known == task.name) {
            bodies.push((task.name.clone(), report.body()));
        }
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_wrote_is_text_and_no_markup() {
        let page = Page {
            title: "a <b> & c".into(),
            purpose: String::new(),
            runs: Vec::new(),
            specimens: Vec::new(),
            tasks: Vec::new(),
        };
        assert!(page.html().contains("<h1>a &lt;b&gt; &amp; c</h1>"));
    }
}
