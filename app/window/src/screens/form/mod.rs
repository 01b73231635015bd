//! The protocol and its values as typed, checked on every change and previewed before anything moves.

mod field;

pub use field::{LabelField, ParamField};

use crate::command::ManualMove;
use crate::widgets::require;
use palpate_analysis::daily::{DAILY_CHECK, DailyCheckGate, is_daily_check, needs_daily_check};
use palpate_analysis::protocol_sources::ProtocolSource;
use palpate_model::calibration::{Calibration, CalibrationCurve, CalibrationError};
use palpate_model::metadata::{METADATA_KEYS, SessionLabels};
use palpate_model::rig::{Limits, RigDescription};
use palpate_protocols::file::{Protocol, ProtocolProblem, built_in};
use palpate_protocols::plans::{Plan, Step};
use palpate_protocols::preview::{OutlinePoint, Preview, outline, preview};
use palpate_runner::{AfterStop, PromptResponder, RigView, RunRequest};
use palpate_sessions::specimen_queue::QueuedSpecimen;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The protocol a window opens with.
const FIRST: &str = "ramp-hold";

/// Numbered session folders in a chosen folder. More in one folder are hard to find again.
const SESSIONS_MAX: u32 = 9_999;

/// Calibration and limits of new sessions.
#[derive(Clone, Debug)]
pub struct RunSetup {
    pub calibration: Calibration,
    /// Of the calibration.
    pub curve: CalibrationCurve,
    /// Reasons to doubt the calibration, to be acknowledged with the others.
    pub doubts: Vec<String>,
    pub limits: Limits,
    /// What must be acknowledged before any run, such as a daily check that failed.
    pub to_acknowledge: Vec<String>,
}

/// Why the weight of a daily check proves nothing with this calibration.
fn uncheckable(plan: &Plan, calibration: &Calibration) -> Option<String> {
    let is_check = is_daily_check(plan);
    let mut masses = plan.steps.iter().filter_map(|planned| match &planned.step {
        Step::Weigh(weigh) if is_check && weigh.mass_g > 0.0 => Some(weigh.mass_g),
        _ => None,
    });
    masses.find_map(|mass_g| {
        calibration.check_refusal(mass_g).unwrap_or_else(|err| Some(err.to_string()))
    })
}

impl RunSetup {
    /// What must be acknowledged before a plan: nothing where it touches no specimen, as a daily check does.
    pub fn to_acknowledge_for(&self, plan: &Plan) -> Vec<String> {
        if needs_daily_check(plan) { self.all_to_acknowledge() } else { Vec::new() }
    }

    /// What must be acknowledged before a run that touches a specimen.
    pub fn all_to_acknowledge(&self) -> Vec<String> {
        self.to_acknowledge.iter().chain(&self.doubts).cloned().collect()
    }

    /// Takes another calibration, with the reasons to doubt it in place of those to doubt the one before.
    pub fn take_calibration(
        &mut self,
        calibration: Calibration,
        doubts: Vec<String>,
    ) -> Result<(), CalibrationError> {
        self.curve = calibration.curve()?;
        (self.calibration, self.doubts) = (calibration, doubts);
        Ok(())
    }

    /// Takes over what a daily check that was just made has to say of runs, in place of what one before said.
    pub fn take_gate(&mut self, gate: Vec<String>) {
        self.to_acknowledge.retain(|words| !DailyCheckGate::has_said(words));
        self.to_acknowledge.extend(gate);
    }
}

/// The protocol that is chosen, with the values typed for it.
#[derive(Clone, Debug)]
pub struct ProtocolForm {
    /// Or the problems of its file.
    pub protocol: Result<Protocol, Vec<ProtocolProblem>>,
    /// None for a built-in protocol.
    pub file: Option<PathBuf>,
    pub fields: Vec<ParamField>,
    /// The values of the fields cannot be changed.
    pub is_locked: bool,
    /// The labels of the specimen, but for its name, are not shown.
    pub is_blinded: bool,
    /// In the order of [`METADATA_KEYS`].
    pub label_fields: Vec<LabelField>,
    /// Folder for new sessions; empty for the library.
    pub folder: String,
    labels: SessionLabels,
    acknowledged: Vec<String>,
    checked: Option<(CheckKey, Result<CheckedPlan, Vec<ProtocolProblem>>)>,
}

/// What a preview depends on apart from the protocol: values by name, `None` while one is wrong, and whether the axis is
/// homed.
type CheckKey = (Option<BTreeMap<String, String>>, bool);

/// The plan for the values typed, with its preview.
#[derive(Clone, Debug)]
pub struct CheckedPlan {
    pub plan: Plan,
    pub warnings: Vec<ProtocolProblem>,
    pub preview: Preview,
    /// Expected depth and force over time for an average specimen.
    pub outline: Vec<OutlinePoint>,
}

impl CheckedPlan {
    pub fn deepest_mm(&self) -> f64 {
        let depths = self.outline.iter().map(|point| point.depth.0);
        depths.fold(0.0, f64::max)
    }
}

impl Default for ProtocolForm {
    fn default() -> Self {
        let empty = |key| LabelField { key, text: String::new(), error: None, is_required: false };
        let mut form = Self {
            protocol: Err(Vec::new()),
            file: None,
            fields: Vec::new(),
            is_locked: false,
            is_blinded: false,
            label_fields: METADATA_KEYS.iter().map(empty).collect(),
            folder: String::new(),
            labels: SessionLabels::default(),
            acknowledged: Vec::new(),
            checked: None,
        };
        form.set_label("indenter", "blunt 12 mm probe");
        form.choose_built_in(FIRST);
        form
    }
}

impl ProtocolForm {
    /// Takes a built-in protocol; an unknown name changes nothing.
    pub fn choose_built_in(&mut self, name: &str) {
        if let Some(protocol) = built_in(name) {
            self.choose(protocol, None);
        }
    }

    /// Takes the text of a file, or a locked protocol by its name.
    pub fn choose_file(&mut self, path: &Path, source: Result<ProtocolSource, String>) {
        let (protocol, locked) = match source {
            Ok(source) => (Protocol::read(&source.text), source.locked),
            Err(reason) => (Err(vec![ProtocolProblem::error(0, reason)]), None),
        };
        self.choose(protocol, Some(path.to_owned()));
        self.is_locked = locked.is_some();
        for (name, text) in locked.unwrap_or_default() {
            let mut fields = self.fields.iter_mut();
            if let Some(field) = fields.find(|field| field.parameter.name == name) {
                field.text = text;
            }
        }
    }

    fn choose(&mut self, protocol: Result<Protocol, Vec<ProtocolProblem>>, file: Option<PathBuf>) {
        let parameters = protocol.iter().flat_map(|one| one.parameters.iter());
        self.fields = parameters.cloned().map(ParamField::new).collect();
        for field in &mut self.label_fields {
            let mut required = protocol.iter().flat_map(|one| one.ask.iter());
            field.is_required = required.any(|name| name == field.key.name);
        }
        self.protocol = protocol;
        self.file = file;
        self.is_locked = false;
        self.forget();
    }

    /// Drops the preview, because the protocol or the calibration has changed.
    pub fn forget(&mut self) {
        self.checked = None;
        self.acknowledged.clear();
    }

    /// Checks what is typed, and previews the plan again if something that it depends on has changed.
    pub fn refresh(&mut self, rig: &RigDescription, bench: &RunSetup, is_homed: bool) {
        self.read_labels();
        self.fields.iter_mut().for_each(|field| field.check(rig));
        let Ok(protocol) = &self.protocol else { return };
        let values = self.fields.iter().map(|field| {
            let value = field.value.as_ref().ok()?;
            Some((field.parameter.name.clone(), value.clone()))
        });
        let key = (values.collect(), is_homed);
        if self.checked.as_ref().is_some_and(|(old, _)| *old == key) {
            return;
        }
        let Some(values) = &key.0 else {
            self.fields.iter_mut().for_each(|field| field.objection = None);
            self.checked = Some((key, Err(Vec::new())));
            return;
        };
        let checked = protocol.write_out(values).map(|written| {
            let mut preview = preview(&written.plan, rig, &bench.limits, &bench.curve, is_homed);
            preview.refusals.extend(uncheckable(&written.plan, &bench.calibration));
            // Only the built-in plans are known to touch nothing.
            let has_file = self.file.is_some();
            let acknowledgements = if has_file {
                bench.all_to_acknowledge()
            } else {
                bench.to_acknowledge_for(&written.plan)
            };
            preview.acknowledgements.extend(acknowledgements);
            CheckedPlan {
                preview,
                outline: outline(&written.plan, rig, &bench.limits, &bench.curve),
                warnings: written.warnings,
                plan: written.plan,
            }
        });
        let problems = checked.as_ref().err().map_or(&[][..], Vec::as_slice);
        for field in &mut self.fields {
            let own = problems.iter().find(|problem| field.is_named_in(&problem.message));
            // Whoever wrote the file finds the line; a built-in one has none that matters.
            let words = |problem: &ProtocolProblem| match &self.file {
                Some(_) => problem.to_string(),
                None => problem.message.clone(),
            };
            field.objection = own.map(words);
        }
        self.checked = Some((key, checked));
    }

    fn read_labels(&mut self) {
        self.labels = SessionLabels::default();
        for field in &mut self.label_fields {
            field.error = None;
            if !field.text.trim().is_empty() {
                let read = self.labels.set(field.key.name, &field.text);
                field.error = read.err().map(|err| err.to_string());
            }
        }
    }

    /// Writes into the field of a label; an unknown name changes nothing.
    pub fn set_label(&mut self, name: &str, text: &str) {
        let mut fields = self.label_fields.iter_mut();
        if let Some(field) = fields.find(|field| field.key.name == name) {
            text.clone_into(&mut field.text);
        }
    }

    /// Takes the labels of a queued specimen; those of the specimen before do not stay, those of operator and probe do.
    ///
    /// Where whoever measures is blinded, those of the specimen are recorded and not shown.
    pub fn take_labels(&mut self, wanted: &QueuedSpecimen, is_blinded: bool) {
        self.is_blinded = is_blinded;
        for field in &mut self.label_fields {
            let name = field.key.name;
            if name == "specimen" {
                field.text.clone_from(&wanted.specimen);
            } else if let Some(text) = wanted.labels.get(name) {
                field.text.clone_from(text);
            } else if field.key.describes_specimen() {
                field.text.clear();
            }
        }
        self.read_labels();
    }

    /// Specimen and protocol that a start would run.
    pub fn next_start(&self) -> [String; 2] {
        [self.specimen().to_owned(), self.source_name()]
    }

    /// Name or file of the protocol, as the queue has it.
    pub fn source_name(&self) -> String {
        match (&self.file, &self.protocol) {
            (Some(file), _) => file.display().to_string(),
            (None, Ok(protocol)) => protocol.name.clone(),
            (None, Err(_)) => FIRST.to_owned(),
        }
    }

    /// The same for specimens that are added to the queue: a calibration or a daily check is for none.
    pub fn specimen_protocol(&self) -> String {
        let is_check = self.file.is_none() && self.source_name() == DAILY_CHECK;
        let is_for_none =
            is_check || self.checked().is_some_and(|checked| !needs_daily_check(&checked.plan));
        if is_for_none { FIRST.to_owned() } else { self.source_name() }
    }

    pub fn label_text(&self, name: &str) -> &str {
        let field = self.label_fields.iter().find(|field| field.key.name == name);
        field.map_or("", |field| &field.text)
    }

    /// The request for a manual move, or why there is none.
    pub fn manual_request(
        &self,
        manual: &ManualMove,
        rig: &RigView,
        bench: &RunSetup,
    ) -> Result<RunRequest, String> {
        let words = |problems: Vec<ProtocolProblem>| {
            problems.first().map_or_else(String::new, ToString::to_string)
        };
        let protocol = built_in(manual.protocol).ok_or("this move has no built-in protocol")?;
        let plan = protocol.and_then(|protocol| protocol.plan(&manual.values)).map_err(words)?;
        let preview = preview(&plan, &rig.description, &bench.limits, &bench.curve, rig.is_homed);
        // A button of a manual move acknowledges nothing.
        if let Some(reason) = bench.to_acknowledge_for(&plan).first() {
            return Err(format!(
                "{reason}; run the daily check, or acknowledge this on the Run screen, where the protocol {} makes the same move",
                manual.protocol
            ));
        }
        preview.check_start(false)?;
        Ok(RunRequest { to_acknowledge: Vec::new(), ..self.request_for(plan, bench, false) })
    }

    fn request_for(&self, plan: Plan, bench: &RunSetup, is_acknowledged: bool) -> RunRequest {
        RunRequest {
            calibration: bench.calibration.clone(),
            limits: bench.limits,
            out: self.session_folder(),
            labels: self.labels.clone(),
            is_acknowledged,
            to_acknowledge: bench.to_acknowledge_for(&plan),
            plan,
            after_stop: AfterStop::Wait,
            answers: PromptResponder::Operator,
            leader: None,
        }
    }

    /// Empty where none is typed.
    pub fn specimen(&self) -> &str {
        &self.labels.specimen
    }

    /// The plan and its preview; `None` while something is wrong.
    pub fn checked(&self) -> Option<&CheckedPlan> {
        self.checked.as_ref()?.1.as_ref().ok()
    }

    /// Problems of the file, or of the values together.
    pub fn problems(&self) -> &[ProtocolProblem] {
        match (&self.protocol, &self.checked) {
            (Err(problems), _) | (Ok(_), Some((_, Err(problems)))) => problems,
            _ => &[],
        }
    }

    /// Whether all warnings of the preview are acknowledged in their present words.
    pub fn is_acknowledged(&self) -> bool {
        self.checked().is_some_and(|checked| {
            !checked.preview.acknowledgements.is_empty()
                && checked.preview.acknowledgements == self.acknowledged
        })
    }

    /// Ticks or clears the acknowledgement. It holds for these words only: other forces need another one.
    pub fn acknowledge(&mut self, is_acknowledged: bool) {
        self.acknowledged = match self.checked() {
            Some(checked) if is_acknowledged => checked.preview.acknowledgements.clone(),
            _ => Vec::new(),
        };
    }

    /// Whether the plan may start, or why not.
    pub fn verdict(&self) -> Result<(), String> {
        let is_read = self.protocol.is_ok();
        require(is_read, "correct the protocol file or choose another protocol")?;
        let wrong = self.fields.iter().find(|field| field.value.is_err());
        let wrong = wrong.map(|field| field.parameter.name.as_str());
        let mut labels = self.label_fields.iter();
        let wrong_label = labels.find(|field| field.error.is_some()).map(|field| field.key.name);
        if let Some(name) = wrong.or(wrong_label) {
            return Err(format!("correct the {name} first"));
        }
        self.labels.check().map_err(|err| err.to_string())?;
        let missing = self.label_fields.iter();
        let missing = missing.filter(|field| field.is_required && field.text.trim().is_empty());
        let missing: Vec<&str> = missing.map(|field| field.key.name).collect();
        require(missing.is_empty(), format!("fill in {} first", missing.join(", ")))?;
        if let Some(field) = self.fields.iter().find(|field| field.objection.is_some()) {
            return Err(format!("correct the {} first", field.parameter.name));
        }
        if let Some(problem) = self.problems().first() {
            return Err(problem.to_string());
        }
        let checked = self.checked().ok_or("the plan is not checked yet")?;
        let preview = &checked.preview;
        let is_box_open = preview.refusals.is_empty() && !preview.acknowledgements.is_empty();
        require(!is_box_open || self.is_acknowledged(), "tick the box above first")?;
        preview.check_start(self.is_acknowledged())
    }

    /// The request to run the plan; `None` while it may not start.
    pub fn request(&self, bench: &RunSetup) -> Option<RunRequest> {
        self.verdict().ok()?;
        Some(self.request_for(self.checked()?.plan.clone(), bench, self.is_acknowledged()))
    }

    /// The next free numbered folder in the chosen folder; `None` leaves the choice to the library.
    fn session_folder(&self) -> Option<PathBuf> {
        let chosen = self.folder.trim();
        if chosen.is_empty() {
            return None;
        }
        let numbered = |number: u32| Path::new(chosen).join(format!("session-{number:04}"));
        // If every number is taken, the runner refuses the last and says that it is not empty.
        (1..SESSIONS_MAX).map(numbered).find(|path| !path.exists()).or(Some(numbered(SESSIONS_MAX)))
    }
}

#[cfg(test)]
mod tests;
