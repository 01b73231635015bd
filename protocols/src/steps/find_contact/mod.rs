//! Finding the tissue: a first pass to know roughly where it is and, if the plan presses, how it answers;
//! a slow second pass; a rest for the tissue to recover; and the way to depth zero.

mod noise;
mod search;
mod touch_log;

pub(super) use noise::{above_noise, second_touch_error};

use super::prelude::*;
use crate::preview::CONTACT_EXPECTED_SHARE;
use search::ContactSearch;

/// Find the tissue surface in two passes and rest before the measurement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FindContact {
    pub approach_speed: MmPerS,
    /// Filtered force above tare that ends the first pass.
    pub criterion: Newtons,
    /// Distance to withdraw before the second pass, in mm.
    pub retreat_mm: f64,
    /// Speed of the second pass.
    pub pass_speed: MmPerS,
    /// Filtered force that ends the second pass: enough of the onset to fit its start.
    pub pass_force: Newtons,
    /// Rest after each pass, about ten relaxation times of soft tissue.
    pub recovery: Seconds,
    /// Widest accepted standard error of the contact position, in mm.
    pub std_error_mm_max: f64,
    /// What the first pass does after its trigger; without it the first pass ends there and contact
    /// is estimated from the second alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub press: Option<ContactPress>,
}

/// The end of a first pass that goes on into the tissue to learn how it answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactPress {
    /// Filtered force above tare that ends it.
    pub force: Newtons,
    /// Time at that depth, and at the end of the second pass, while the force relaxes.
    pub dwell: Seconds,
}

impl Default for FindContact {
    /// 1.5 mm/s stays under the 2-3 mm/s above which published testers trigger late;
    /// 0.03 N (3 g) is in the range of their 0.01-5 g criteria; the second pass is eight times slower.
    ///
    /// The press to 0.42 N leaves a sixth of the 0.5 N that contact finding may ever exert to filter and
    /// brake; the 6 s after it are six relaxation times of pig stomach. Together with the pass to 0.14 N they
    /// give the contact position to 0.02 mm at 0.05 N of noise, with nothing known of the body beforehand; a
    /// pass of its own would give 0.06 mm.
    fn default() -> Self {
        Self {
            approach_speed: MmPerS(1.5),
            criterion: Newtons(0.03),
            retreat_mm: 2.0,
            pass_speed: MmPerS(0.18),
            pass_force: Newtons(0.14),
            recovery: Seconds(10.0),
            std_error_mm_max: 0.1,
            press: Some(ContactPress::default()),
        }
    }
}

impl Default for ContactPress {
    /// Reasons as for [`FindContact`].
    fn default() -> Self {
        Self { force: Newtons(0.42), dwell: Seconds(6.0) }
    }
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Find the surface of the tissue and stop there. Depths are measured from the surface.",
    keys: &[
        Key::optional("speed", QuantityKind::Speed, "speed of the first pass"),
        Key::optional("criterion", QuantityKind::Force, "force that counts as contact in the first pass"),
        Key::optional("retreat", QuantityKind::Length, "distance of the retract before the second pass"),
        Key::optional("pass_speed", QuantityKind::Speed, "speed of the second pass"),
        Key::optional("pass_force", QuantityKind::Force, "force that ends the second pass"),
        Key::optional("recovery", QuantityKind::Time, "rest after each pass").zero_allowed(),
        Key::optional(
            "std_error_max",
            QuantityKind::Length,
            "largest accepted standard error of the contact point",
        ),
        Key::optional(
            "press_force",
            QuantityKind::Force,
            "force to which the first pass presses after contact, to measure the response of the tissue; `0 N` ends the pass at the criterion",
        )
        .zero_allowed(),
        Key::optional(
            "press_dwell",
            QuantityKind::Time,
            "dwell at the end of each pass, during which the force relaxes",
        )
        .zero_allowed(),
    ],
    build: Some(read),
    note: Some(usual_search),
    needs: &[Need::Motor, Need::Home, Need::Tare, Need::Specimen, Need::Outside],
    gives: &[Need::Contact],
    label: "contact",
    ..StepFacts::of("find-contact", Phase::Contact, PauseBehaviour::RepeatFromStart)
};

fn read(args: &Args) -> Result<Step, String> {
    let mut search = FindContact::default();
    for (name, field) in [
        ("speed", &mut search.approach_speed.0),
        ("criterion", &mut search.criterion.0),
        ("retreat", &mut search.retreat_mm),
        ("pass_speed", &mut search.pass_speed.0),
        ("pass_force", &mut search.pass_force.0),
        ("recovery", &mut search.recovery.0),
        ("std_error_max", &mut search.std_error_mm_max),
    ] {
        *field = args.maybe(name).unwrap_or(*field);
    }
    let usual = ContactPress::default();
    let force = args.maybe("press_force").unwrap_or(usual.force.0);
    let dwell = args.maybe("press_dwell").unwrap_or(usual.dwell.0);
    search.press =
        (force > 0.0).then_some(ContactPress { force: Newtons(force), dwell: Seconds(dwell) });
    Ok(search.into())
}

/// What a search for contact does without keys.
fn usual_search() -> String {
    let search = FindContact::default();
    let press = search.press.map_or("does not press".to_owned(), |press| {
        format!("presses to {} and dwells for {}", press.force, press.dwell)
    });
    format!(
        "Without keys, the first pass approaches at {}, detects contact at {}, {press}. The probe then retracts by {} mm. \
         The second pass approaches at {} and ends at a force of {}. The probe rests for {} after each pass. The \
         standard error of the contact point may be at most {} mm.\n\n",
        search.approach_speed,
        search.criterion,
        search.retreat_mm,
        search.pass_speed,
        search.pass_force,
        search.recovery,
        search.std_error_mm_max
    )
}

/// Contact finding never exerts more than 0.5 N; filter and brake need a sixth of it.
const PRESS_MAX: Newtons = Newtons(0.42);

impl ContactPress {
    fn check(&self, walk: &mut Walk<'_>) {
        walk.check_span(self.dwell);
        let most = walk.limits.force_max;
        if !(self.force.0 > 0.0 && self.force <= PRESS_MAX) {
            walk.refuse(format!(
                "find-contact cannot press to {}; give a force above 0 N and up to {PRESS_MAX}",
                self.force
            ));
        } else if self.force >= most {
            walk.refuse(format!(
                "find-contact presses to {}, but the force limit of {most} stops the run before; raise the limit or press less",
                self.force
            ));
        }
    }
}

impl StepKind for FindContact {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_sizes(&[
            self.retreat_mm,
            self.criterion.0,
            self.pass_force.0,
            self.std_error_mm_max,
        ]);
        walk.check_span(self.recovery);
        if let Some(press) = self.press {
            press.check(walk);
        }
        walk.check_speed(self.approach_speed);
        walk.check_speed(self.pass_speed);
        let travel = walk.limits.travel_max.0;
        let approach = |distance: f64| walk.move_secs(distance, self.approach_speed);
        let dwell = self.press.map_or(0.0, |press| press.dwell.0);
        let rest = 2.0 * (self.recovery.0 + dwell);
        let slow = walk.move_secs(self.retreat_mm + 1.0, self.pass_speed)
            + walk.move_secs(1.0, self.pass_speed);
        let moves = 2.0 * approach(self.retreat_mm) + slow + rest;
        let near = approach(CONTACT_EXPECTED_SHARE * travel) + moves;
        let far = approach(travel) + moves;
        walk.expected.place(0.0);
        walk.reach = Reach::at(0.0);
        walk.unknown(near, far)
    }
}

impl Executable for FindContact {
    type Run = Box<ContactSearch>;

    fn begin(&self, cx: &mut Context<'_>) -> Result<Box<ContactSearch>, String> {
        cx.set_contact(None);
        ContactSearch::begin(cx, *self).map(Box::new)
    }
}
