//! What the technician types, checked on every change and previewed before anything moves.

use crate::widgets::quantity_input::QuantityField;
use palpate_model::calibration::{Calibration, Curve};
use palpate_model::rig::{Limits, RigDescription};
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::plans::{BodyParameter, HoldUntil, RampHold};
use palpate_protocols::preview::{Preview, preview};
use palpate_protocols::runner::{AfterStop, Answers, Labels, RunRequest};
use palpate_sessions::About;
use std::path::{Path, PathBuf};

/// Longest hold the preview accepts: a day, in seconds.
const HOLD_MAX_S: f64 = 86_400.0;

/// Numbered session folders in a chosen folder. More in one folder are hard to find again.
const SESSIONS_MAX: u32 = 9_999;

/// What is known about the load cell and its limits.
#[derive(Clone, Debug)]
pub struct Bench {
    /// Volts to newtons, as recorded in each session.
    pub calibration: Calibration,
    /// The same as a curve.
    pub curve: Curve,
    /// Interlock thresholds.
    pub limits: Limits,
    /// What must be acknowledged before any run, such as a daily check that failed.
    pub to_acknowledge: Vec<String>,
}

/// The form of a ramp and hold.
#[derive(Clone, Debug)]
pub struct ProtocolForm {
    /// Who runs it, on what, with what.
    pub labels: Labels,
    /// Indentation speed in mm/s.
    pub speed: QuantityField,
    /// Depth from contact in mm.
    pub depth: QuantityField,
    /// Time at depth in s.
    pub hold: QuantityField,
    /// End the hold when tau is known to so many percent; empty for the whole hold.
    pub until: QuantityField,
    /// Speed in mm/s of a recorded way back; empty for none.
    pub unload: QuantityField,
    /// Folder for new sessions; empty for the library.
    pub folder: String,
    acknowledged: Vec<String>,
    checked: Option<(CheckKey, Option<Checked>)>,
}

/// What a preview depends on: the texts and whether the axis is homed.
type CheckKey = ([String; 5], bool);

/// A plan whose fields are all valid numbers, with its preview.
#[derive(Clone, Debug)]
pub struct Checked {
    /// The parameters.
    pub params: RampHold,
    /// What they will do.
    pub preview: Preview,
}

impl Default for ProtocolForm {
    fn default() -> Self {
        let params = RampHold::default();
        Self {
            labels: Labels {
                operator: String::new(),
                specimen: String::new(),
                indenter: "blunt 12 mm probe".into(),
                about: About::default(),
            },
            speed: QuantityField::new(params.speed.0),
            depth: QuantityField::new(params.depth.0),
            hold: QuantityField::new(params.hold.0),
            until: empty(),
            unload: empty(),
            folder: String::new(),
            acknowledged: Vec::new(),
            checked: None,
        }
    }
}

impl ProtocolForm {
    /// Checks the fields and previews the plan again, if anything it depends on changed.
    pub fn refresh(&mut self, rig: &RigDescription, bench: &Bench, is_homed: bool) {
        let fields = [
            &self.speed,
            &self.depth,
            &self.hold,
            &self.until,
            &self.unload,
        ];
        let texts = fields.map(|field| field.text.clone());
        let key = (texts, is_homed);
        if self.checked.as_ref().is_some_and(|(old, _)| *old == key) {
            return;
        }
        self.speed.check(|speed| rig.check_speed(MmPerS(speed)));
        self.depth
            .check(|depth| check_depth(depth, rig, &bench.limits));
        self.hold.check(check_hold);
        check_optional(&mut self.until, |percent| rule(percent).check());
        check_optional(&mut self.unload, |speed| rig.check_speed(MmPerS(speed)));
        let checked = self.params().map(|params| {
            let plan = params.plan();
            let mut preview = preview(&plan, rig, &bench.limits, &bench.curve, is_homed);
            let beside = bench.to_acknowledge.iter().cloned();
            preview.acknowledgements.extend(beside);
            Checked { params, preview }
        });
        self.checked = Some((key, checked));
    }

    fn params(&self) -> Option<RampHold> {
        let value = |field: &QuantityField| field.value.as_ref().ok().copied();
        Some(RampHold {
            speed: MmPerS(value(&self.speed)?),
            depth: Depth(value(&self.depth)?),
            hold: Seconds(value(&self.hold)?),
            until: optional(&self.until)?.map(rule),
            unload: optional(&self.unload)?.map(MmPerS),
        })
    }

    /// The plan and its preview; `None` while a field is wrong.
    #[must_use]
    pub fn checked(&self) -> Option<&Checked> {
        self.checked
            .as_ref()
            .and_then(|(_, checked)| checked.as_ref())
    }

    /// Whether everything the preview asks to acknowledge is acknowledged, in its present words.
    #[must_use]
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
        for (name, field) in [
            ("speed", &self.speed),
            ("depth", &self.depth),
            ("hold", &self.hold),
            ("end of the hold", &self.until),
            ("unload speed", &self.unload),
        ] {
            if field.value.is_err() {
                return Err(format!("correct the {name} first"));
            }
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
    #[must_use]
    pub fn request(&self, bench: &Bench) -> Option<RunRequest> {
        self.verdict().ok()?;
        let checked = self.checked()?;
        Some(RunRequest {
            plan: checked.params.plan(),
            calibration: bench.calibration.clone(),
            limits: bench.limits,
            out: self.session_folder(),
            labels: self.labels.clone(),
            is_acknowledged: self.is_acknowledged(),
            to_acknowledge: bench.to_acknowledge.clone(),
            after_stop: AfterStop::Wait,
            answers: Answers::Operator,
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
        (1..SESSIONS_MAX)
            .map(numbered)
            .find(|path| !path.exists())
            .or(Some(numbered(SESSIONS_MAX)))
    }
}

/// A field that asks for nothing.
fn empty() -> QuantityField {
    QuantityField {
        text: String::new(),
        value: Ok(0.0),
    }
}

/// Checks a field that may be empty.
fn check_optional(field: &mut QuantityField, check: impl FnOnce(f64) -> Result<(), String>) {
    if field.text.trim().is_empty() {
        *field = empty();
    } else {
        field.check(check);
    }
}

/// The value of a field that may be empty; the outer `None` where it is wrong.
fn optional(field: &QuantityField) -> Option<Option<f64>> {
    let value = field.value.as_ref().ok().copied()?;
    Some((!field.text.is_empty()).then_some(value))
}

fn rule(percent: f64) -> HoldUntil {
    HoldUntil::new(BodyParameter::TauEps, 0.01 * percent)
}

fn check_depth(depth: f64, rig: &RigDescription, limits: &Limits) -> Result<(), String> {
    let travel = limits.travel_max;
    if depth > 0.0 && depth <= travel.0 {
        Ok(())
    } else {
        Err(format!(
            "a depth of {} is not possible on rig {}; choose above 0 and up to {travel}",
            Depth(depth),
            rig.name
        ))
    }
}

fn check_hold(hold: f64) -> Result<(), String> {
    if (0.0..=HOLD_MAX_S).contains(&hold) {
        Ok(())
    } else {
        Err(format!(
            "a hold of {hold} s is not possible; choose 0 to {HOLD_MAX_S} s"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_drivers::sim::SimSettings;

    fn bench() -> (RigDescription, Bench) {
        let settings = SimSettings::default();
        let rig = palpate_drivers::open("sim", &settings).unwrap();
        let calibration = palpate_drivers::sim::calibration(settings.profile);
        let bench = Bench {
            curve: calibration.curve().unwrap(),
            calibration,
            limits: Limits::for_travel(rig.description().travel),
            to_acknowledge: Vec::new(),
        };
        (rig.description().clone(), bench)
    }

    fn form_with(speed: &str, depth: &str, hold: &str) -> (ProtocolForm, Bench) {
        let (rig, bench) = bench();
        let mut form = ProtocolForm::default();
        form.speed.text = speed.into();
        form.depth.text = depth.into();
        form.hold.text = hold.into();
        form.refresh(&rig, &bench, false);
        (form, bench)
    }

    #[test]
    fn a_failed_daily_check_asks_for_the_box_to_be_ticked() {
        let (rig, mut bench) = bench();
        bench.to_acknowledge = vec!["the daily check failed".into()];
        let mut form = ProtocolForm::default();
        form.refresh(&rig, &bench, false);
        assert!(form.request(&bench).is_none());
        form.acknowledge(true);
        let request = form.request(&bench).unwrap();
        assert!(request.is_acknowledged);
        assert_eq!(request.to_acknowledge, bench.to_acknowledge);
    }

    #[test]
    fn the_default_plan_may_start() {
        let (form, bench) = form_with("0.75", "30", "50");
        assert_eq!(form.verdict(), Ok(()));
        let request = form.request(&bench).unwrap();
        assert_eq!(request.plan, RampHold::default().plan());
        assert_eq!(request.out, None);
        assert!(!request.is_acknowledged);
    }

    #[test]
    fn wrong_fields_refuse_by_name() {
        for (speed, depth, hold, word) in [
            ("fast", "30", "50", "speed"),
            ("0.7501", "30", "50", "speed"),
            ("0.75", "-1", "50", "depth"),
            ("0.75", "1e4", "50", "depth"),
            ("0.75", "30", "-0.1", "hold"),
            ("0.75", "30", "1e9", "hold"),
        ] {
            let (form, bench) = form_with(speed, depth, hold);
            let reason = form.verdict().unwrap_err();
            assert!(reason.contains(word), "{reason}");
            assert!(form.request(&bench).is_none());
            assert!(form.checked().is_none());
        }
    }

    #[test]
    fn an_empty_rule_holds_the_whole_time_and_a_wrong_one_refuses() {
        let (rig, bench) = bench();
        let mut form = ProtocolForm::default();
        for (text, wanted) in [
            ("", Ok(None)),
            ("  ", Ok(None)),
            ("1.5", Ok(Some(0.015))),
            ("0", Err("above 0")),
            ("100", Err("below 100")),
            ("soon", Err("not a finite number")),
        ] {
            form.until.text = text.into();
            form.refresh(&rig, &bench, false);
            match wanted {
                Ok(share) => {
                    let until = form.checked().unwrap().params.until;
                    assert_eq!(until.map(|rule| rule.relative), share, "{text}");
                    assert_eq!(form.verdict(), Ok(()));
                }
                Err(words) => {
                    let reason = form.until.value.clone().unwrap_err();
                    assert!(reason.contains(words), "{reason}");
                    assert!(form.verdict().unwrap_err().contains("end of the hold"));
                }
            }
        }
    }

    #[test]
    fn an_unload_speed_adds_a_recorded_way_back() {
        let (rig, bench) = bench();
        let mut form = ProtocolForm::default();
        form.unload.text = "0.6".into();
        form.refresh(&rig, &bench, false);
        let unload = form.checked().unwrap().params.unload;
        assert_eq!(unload, Some(MmPerS(0.6)));
        let plan = form.request(&bench).unwrap().plan;
        assert_eq!(plan.steps.len(), RampHold::default().plan().steps.len() + 1);
        form.unload.text = "0.601".into();
        form.refresh(&rig, &bench, false);
        assert!(form.verdict().unwrap_err().contains("unload speed"));
    }

    #[test]
    fn an_acknowledgement_holds_for_its_words_only() {
        let (mut form, bench) = form_with("0.75", "45", "50");
        assert!(form.verdict().unwrap_err().contains("tick the box"));
        form.acknowledge(true);
        assert_eq!(form.verdict(), Ok(()));
        assert!(form.request(&bench).unwrap().is_acknowledged);
        let (rig, bench) = self::bench();
        form.depth.text = "47".into();
        form.refresh(&rig, &bench, false);
        assert!(!form.is_acknowledged());
        assert!(form.verdict().is_err());
    }

    #[test]
    fn a_chosen_folder_gets_numbered_sessions() {
        let folder = std::env::temp_dir().join(format!("palpate-form-{}", std::process::id()));
        let (mut form, bench) = form_with("0.75", "30", "50");
        form.folder = folder.display().to_string();
        let first = form.request(&bench).unwrap().out.unwrap();
        assert_eq!(first, folder.join("session-0001"));
        std::fs::create_dir_all(&first).unwrap();
        let second = form.request(&bench).unwrap().out.unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(second, folder.join("session-0002"));
    }
}
