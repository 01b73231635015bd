//! What the technician chooses and types, checked on every change and previewed before anything moves.

mod field;

pub use field::{LabelField, ParamField};

use crate::command::ManualMove;
use palpate_analysis::daily::is_gated;
use palpate_model::about::KEYS;
use palpate_model::about::Labels;
use palpate_model::calibration::{Calibration, Curve};
use palpate_model::rig::{Limits, RigDescription};
use palpate_protocols::file::{Problem, Protocol, built_in};
use palpate_protocols::plans::Plan;
use palpate_protocols::preview::{OutlinePoint, Preview, outline, preview};
use palpate_runner::{AfterStop, Answers, RigView, RunRequest};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The protocol a window opens with.
const FIRST: &str = "ramp-hold";

/// Numbered session folders in a chosen folder. More in one folder are hard to find again.
const SESSIONS_MAX: u32 = 9_999;

/// What is known about the load cell and its limits.
#[derive(Clone, Debug)]
pub struct RunSetup {
    /// Volts to newtons, as recorded in each session.
    pub calibration: Calibration,
    /// The same as a curve.
    pub curve: Curve,
    /// Interlock thresholds.
    pub limits: Limits,
    /// What must be acknowledged before any run, such as a daily check that failed.
    pub to_acknowledge: Vec<String>,
}

/// A protocol that was chosen, with what is typed for it.
#[derive(Clone, Debug)]
pub struct ProtocolForm {
    /// The protocol, or what is wrong with its file.
    pub protocol: Result<Protocol, Vec<Problem>>,
    /// The file it was read from; none for a built-in one.
    pub file: Option<PathBuf>,
    /// Its parameters.
    pub fields: Vec<ParamField>,
    /// What can be told about the session, in the order of [`KEYS`].
    pub told: Vec<LabelField>,
    /// Folder for new sessions; empty for the library.
    pub folder: String,
    labels: Labels,
    acknowledged: Vec<String>,
    checked: Option<(CheckKey, Result<CheckedPlan, Vec<Problem>>)>,
}

/// What a preview depends on beside the protocol: values by name and whether the axis is homed. `None` while a
/// value is wrong.
type CheckKey = (Option<BTreeMap<String, String>>, bool);

/// A plan written out for what was typed, with its preview.
#[derive(Clone, Debug)]
pub struct CheckedPlan {
    /// The plan.
    pub plan: Plan,
    /// What to look at before the start.
    pub warnings: Vec<Problem>,
    /// What the plan will do.
    pub preview: Preview,
    /// Depth and force over time as an average specimen would answer.
    pub outline: Vec<OutlinePoint>,
}

impl CheckedPlan {
    /// Greatest depth in mm.
    pub fn deepest_mm(&self) -> f64 {
        let depths = self.outline.iter().map(|point| point.depth.0);
        depths.fold(0.0, f64::max)
    }
}

impl Default for ProtocolForm {
    fn default() -> Self {
        let told = KEYS.iter().map(|key| LabelField {
            key,
            text: match key.name {
                "indenter" => "blunt 12 mm probe".into(),
                _ => String::new(),
            },
            error: None,
            is_asked: false,
        });
        let mut form = Self {
            protocol: Err(Vec::new()),
            file: None,
            fields: Vec::new(),
            told: told.collect(),
            folder: String::new(),
            labels: Labels::default(),
            acknowledged: Vec::new(),
            checked: None,
        };
        form.choose_built_in(FIRST);
        form
    }
}

impl ProtocolForm {
    /// Takes a built-in protocol; a name that is none changes nothing.
    pub fn choose_built_in(&mut self, name: &str) {
        if let Some(protocol) = built_in(name) {
            self.choose(protocol, None);
        }
    }

    /// Takes the text of a file.
    pub fn choose_file(&mut self, path: &Path, text: Result<String, String>) {
        let protocol = match text {
            Ok(text) => Protocol::read(&text),
            Err(reason) => Err(vec![Problem::error(0, reason)]),
        };
        self.choose(protocol, Some(path.to_owned()));
    }

    fn choose(&mut self, protocol: Result<Protocol, Vec<Problem>>, file: Option<PathBuf>) {
        let parameters = protocol.iter().flat_map(|one| one.parameters.iter());
        self.fields = parameters.cloned().map(ParamField::new).collect();
        for told in &mut self.told {
            let mut asked = protocol.iter().flat_map(|one| one.ask.iter());
            told.is_asked = asked.any(|name| name == told.key.name);
        }
        self.protocol = protocol;
        self.file = file;
        self.forget();
    }

    /// Previews again at the next chance: the protocol or the calibration is another.
    pub fn forget(&mut self) {
        self.checked = None;
        self.acknowledged.clear();
    }

    /// Checks what was typed and previews the plan again, if anything it depends on changed.
    pub fn refresh(&mut self, rig: &RigDescription, bench: &RunSetup, is_homed: bool) {
        self.tell();
        for field in &mut self.fields {
            field.check(rig);
        }
        let Ok(protocol) = &self.protocol else {
            return;
        };
        let name = |field: &ParamField| field.parameter.name.clone();
        let values = self.fields.iter().map(|field| {
            let value = field.value.as_ref().ok()?;
            Some((name(field), value.clone()))
        });
        let key = (values.collect(), is_homed);
        if self.checked.as_ref().is_some_and(|(old, _)| *old == key) {
            return;
        }
        let Some(values) = &key.0 else {
            self.checked = Some((key, Err(Vec::new())));
            return;
        };
        let checked = protocol.write_out(values).map(|written| {
            let mut preview = preview(&written.plan, rig, &bench.limits, &bench.curve, is_homed);
            let beside = bench.to_acknowledge.iter().cloned();
            preview.acknowledgements.extend(beside);
            CheckedPlan {
                preview,
                outline: outline(&written.plan, rig, &bench.limits, &bench.curve),
                warnings: written.warnings,
                plan: written.plan,
            }
        });
        self.checked = Some((key, checked));
    }

    fn tell(&mut self) {
        self.labels = Labels::default();
        for field in &mut self.told {
            field.error = None;
            if !field.text.trim().is_empty() {
                let told = self.labels.tell(field.key.name, &field.text);
                field.error = told.err().map(|err| err.to_string());
            }
        }
    }

    /// Writes into a field of what is told; a name that is none changes nothing.
    pub fn set_label(&mut self, name: &str, text: &str) {
        let field = self.told.iter_mut().find(|field| field.key.name == name);
        if let Some(field) = field {
            text.clone_into(&mut field.text);
        }
    }

    /// What stands in a field of what is told.
    pub fn label_text(&self, name: &str) -> &str {
        let field = self.told.iter().find(|field| field.key.name == name);
        field.map_or("", |field| &field.text)
    }

    /// The request for a run beside what stands in the form, or why there is none.
    pub fn aside(
        &self,
        aside: &ManualMove,
        rig: &RigView,
        bench: &RunSetup,
    ) -> Result<RunRequest, String> {
        let words =
            |problems: &[Problem]| problems.first().map_or_else(String::new, ToString::to_string);
        let protocol = built_in(aside.protocol)
            .ok_or("the protocol is not built in")?
            .map_err(|problems| words(&problems))?;
        let plan = protocol.plan(&aside.values).map_err(|problems| words(&problems))?;
        let preview = preview(&plan, &rig.description, &bench.limits, &bench.curve, rig.is_homed);
        // What must be acknowledged is not acknowledged by a button that is pressed in passing.
        if let (true, Some(reason)) = (is_gated(&plan), bench.to_acknowledge.first()) {
            return Err(format!(
                "{reason}; make the daily check, or accept it on the run screen with the protocol {}",
                aside.protocol
            ));
        }
        preview.verdict(false)?;
        Ok(RunRequest {
            plan,
            calibration: bench.calibration.clone(),
            limits: bench.limits,
            out: self.session_folder(),
            labels: self.labels.clone(),
            is_acknowledged: false,
            to_acknowledge: Vec::new(),
            after_stop: AfterStop::Wait,
            answers: Answers::Operator,
            leader: None,
        })
    }

    /// What is indented, as far as it is told.
    pub fn specimen(&self) -> &str {
        &self.labels.specimen
    }

    /// The plan and its preview; `None` while something is wrong.
    pub fn checked(&self) -> Option<&CheckedPlan> {
        self.checked.as_ref()?.1.as_ref().ok()
    }

    /// What is wrong with the file, or with the values together.
    pub fn problems(&self) -> &[Problem] {
        match (&self.protocol, &self.checked) {
            (Err(problems), _) | (Ok(_), Some((_, Err(problems)))) => problems,
            _ => &[],
        }
    }

    /// Whether everything the preview asks to acknowledge is acknowledged, in its present words.
    pub fn is_acknowledged(&self) -> bool {
        self.checked().is_some_and(|checked| {
            !checked.preview.acknowledgements.is_empty()
                && checked.preview.acknowledgements == self.acknowledged
        })
    }

    /// Ticks or unticks the acknowledgement. It holds for these words only: other forces ask anew.
    pub fn acknowledge(&mut self, is_acknowledged: bool) {
        self.acknowledged = match self.checked() {
            Some(checked) if is_acknowledged => checked.preview.acknowledgements.clone(),
            _ => Vec::new(),
        };
    }

    /// Whether the plan may start as it stands in the form, or the reason why not.
    pub fn verdict(&self) -> Result<(), String> {
        if self.protocol.is_err() {
            return Err("correct the protocol file or choose another protocol".into());
        }
        let wrong = self.fields.iter().find(|field| field.value.is_err());
        let wrong = wrong.map(|field| field.parameter.name.as_str());
        let told = self.told.iter().find(|field| field.error.is_some());
        if let Some(name) = wrong.or(told.map(|field| field.key.name)) {
            return Err(format!("correct the {name} first"));
        }
        self.labels.check().map_err(|err| err.to_string())?;
        let open = self.told.iter();
        let open = open.filter(|field| field.is_asked && field.text.trim().is_empty());
        let open: Vec<&str> = open.map(|field| field.key.name).collect();
        if !open.is_empty() {
            return Err(format!("fill in {} first", open.join(", ")));
        }
        if let Some(problem) = self.problems().first() {
            return Err(problem.to_string());
        }
        let Some(checked) = self.checked() else {
            return Err("the plan is not checked yet".into());
        };
        if checked.preview.refusals.is_empty()
            && !checked.preview.acknowledgements.is_empty()
            && !self.is_acknowledged()
        {
            return Err("tick the box above first".into());
        }
        checked.preview.verdict(self.is_acknowledged())
    }

    /// The request to run what stands in the form; `None` while it may not start.
    pub fn request(&self, bench: &RunSetup) -> Option<RunRequest> {
        self.verdict().ok()?;
        let checked = self.checked()?;
        Some(RunRequest {
            plan: checked.plan.clone(),
            calibration: bench.calibration.clone(),
            limits: bench.limits,
            out: self.session_folder(),
            labels: self.labels.clone(),
            is_acknowledged: self.is_acknowledged(),
            to_acknowledge: bench.to_acknowledge.clone(),
            after_stop: AfterStop::Wait,
            answers: Answers::Operator,
            leader: None,
        })
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
