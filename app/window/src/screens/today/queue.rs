//! The queue of specimens: what comes next in large letters, the list behind it, and how it is filled and ordered.

use crate::command::{Commands, UiCommand};
use crate::widgets::{ChoiceTable, ScrollPosition, TableAction};
use crate::widgets::{
    Column, Emphasis, NamedControl, TableCell, TableLine, alarm_ui, form_label, placeholder_ui,
    quiet_ui, reason_button, require, section_ui, sentence_ui, steady, text_row, tick_box,
    tokens_of, width_of,
};
use crate::workbench::Workbench;
use crate::workers::PathPurpose;
use crate::workers::queue_desk::QueueWork;
use eframe::egui::{Button, Key, Label, RichText, ScrollArea, TextEdit, Ui, Vec2, vec2};
use palpate_analysis::report::queue::counts_text;
use palpate_analysis::specimen_queue::{drawn_seed, visible_items};
use palpate_sessions::specimen_queue::{
    QueueChange, QueueItem, QueueVerdict, SpecimenState, start,
};

/// Large enough for a gloved finger, in points.
const BUTTON: Vec2 = vec2(130.0, 48.0);
const NEXT_BUTTON: Vec2 = vec2(260.0, 56.0);
/// Beside the button a name has so much room in points, or it stands above.
const NAME_WIDTH_MIN: f32 = 240.0;
/// Five specimens and the names of the columns, in points.
const LIST_HEIGHT_MIN: f32 = 180.0;
const REMARK_WIDTH_MIN: f32 = 120.0;

/// What is typed on the page.
#[derive(Default)]
pub(super) struct QueueForm {
    /// A name that is typed or scanned.
    scanned: String,
    /// What came of it.
    answer: Option<Result<String, String>>,
    /// The name that was scanned and is not in the queue.
    unknown: Option<String>,
    added: String,
    reason: String,
    seed: String,
    name: String,
    is_blinded: bool,
    /// Number of the chosen specimen.
    chosen: Option<u32>,
    scrolled: ScrollPosition,
    /// The field of the scanner gets the keys.
    is_to_focus: bool,
}

impl QueueForm {
    /// The page is shown again: what a scanner types goes into its field.
    pub fn has_come(&mut self) {
        self.is_to_focus = true;
        self.answer = None;
    }

    pub fn poll(&mut self, workbench: &Workbench) {
        let numbers = workbench.queue.queue().items.iter().map(|item| item.number);
        if self.chosen.is_some_and(|chosen| !numbers.into_iter().any(|one| one == chosen)) {
            self.chosen = None;
        }
    }

    /// Draws how the queue is filled and ordered.
    pub fn ui(&mut self, ui: &mut Ui, workbench: &Workbench, commands: &mut Commands) {
        let queue = workbench.queue.queue();
        let is_free = require(!workbench.queue.is_busy(), "the queue is being written");
        section_ui(ui, "Add specimens");
        let protocol = workbench.form.specimen_protocol();
        quiet_ui(ui, format!("Protocol: {protocol}; the screen Run offers others"));
        let is_taken = text_row(ui, "names", "pig 7, pig 8", &mut self.added);
        let names: Vec<String> = self
            .added
            .split([',', ';'])
            .map(|name| name.trim().to_owned())
            .filter(|name| !name.is_empty())
            .collect();
        let can_add = is_free
            .clone()
            .and(require(!names.is_empty(), "type one name, or several between commas"));
        if reason_button(ui, "Add", BUTTON, &can_add) || is_taken && can_add.is_ok() {
            commands.push(UiCommand::Queue(QueueWork::AddNamed(names, protocol), String::new()));
            self.added.clear();
        }
        if reason_button(ui, "Add a table...", BUTTON, &is_free) {
            commands.push(UiCommand::Choose(PathPurpose::Specimens));
        }
        quiet_ui(
            ui,
            "A table has a column 'specimen', and where wanted 'protocol' and labels such as specimen.thickness_mm.",
        );
        section_ui(ui, "Random order");
        text_row(ui, "seed", "drawn if empty", &mut self.seed);
        let seed = match self.seed.trim() {
            "" => Ok(drawn_seed()),
            text => text
                .parse::<u64>()
                .map_err(|_| format!("'{text}' is not a whole number; type one, or none")),
        };
        let waiting = queue.counts().waiting;
        let can_shuffle = is_free
            .clone()
            .and(require(waiting > 1, "fewer than two specimens wait"))
            .and(seed.clone().map(|_| ()));
        if reason_button(ui, "Shuffle", BUTTON, &can_shuffle)
            && let Ok(seed) = seed
        {
            commands.push(UiCommand::Queue(QueueWork::Shuffle(seed), String::new()));
        }
        section_ui(ui, "New queue");
        text_row(ui, "name", "pilot-3", &mut self.name);
        tick_box(ui, &mut self.is_blinded, "blinded: hide labels and order");
        let is_done = require(
            waiting == 0 && queue.open_run().is_none(),
            "specimens still wait; measure or skip them first",
        );
        let is_named = require(!self.name.trim().is_empty(), "give the new queue a name");
        let can_start = is_free.and(is_done).and(is_named);
        if reason_button(ui, "Begin a new queue", BUTTON, &can_start) {
            let change = start(self.name.trim(), self.is_blinded);
            commands.push(UiCommand::Queue(QueueWork::Change(change), String::new()));
            self.name.clear();
        }
    }

    /// Draws the next specimen and the list.
    pub fn queue_ui(
        &mut self,
        ui: &mut Ui,
        workbench: &Workbench,
        next: &Result<u32, String>,
        commands: &mut Commands,
    ) {
        let room = ui.available_height();
        // In a low window all of it scrolls, so that the list keeps its rows.
        let whole = ScrollArea::vertical().id_salt("queue page").auto_shrink(false);
        whole.show(ui, |ui| self.page_ui(ui, room, workbench, next, commands));
    }

    fn page_ui(
        &mut self,
        ui: &mut Ui,
        room: f32,
        workbench: &Workbench,
        next: &Result<u32, String>,
        commands: &mut Commands,
    ) {
        // The bar of the scrolling stands beside what it scrolls.
        ui.set_max_width(ui.available_width() - ui.spacing().scroll.bar_width);
        let top = ui.cursor().top();
        let queue = workbench.queue.queue();
        if let Some(reason) = &workbench.queue.refusal {
            alarm_ui(ui, reason);
        }
        match queue.open_run() {
            Some(open) => self.open_ui(ui, open, workbench, commands),
            None => next_ui(ui, workbench, next, commands),
        }
        self.scan_ui(ui, workbench, commands);
        if queue.items.is_empty() {
            return;
        }
        section_ui(ui, &format!("Queue {}", queue.name));
        sentence_ui(ui, counts_text(queue));
        let items = visible_items(queue);
        self.chosen_ui(ui, &items, workbench, commands);
        let left = room - (ui.cursor().top() - top);
        let size = vec2(ui.available_width(), left.max(LIST_HEIGHT_MIN));
        ui.allocate_ui(size, |ui| {
            ui.set_max_height(size.y);
            self.table_ui(ui, &items);
        });
    }

    /// A run without a verdict, such as one that a crash ended.
    fn open_ui(
        &mut self,
        ui: &mut Ui,
        open: &QueueItem,
        workbench: &Workbench,
        commands: &mut Commands,
    ) {
        section_ui(ui, "Measured, without a verdict");
        headline_ui(ui, &open.wanted.specimen);
        text_row(ui, "reason", "for a rejection", &mut self.reason);
        let session = open.sessions.last().cloned().unwrap_or_default();
        let session =
            workbench.library.as_ref().map_or(session.clone(), |library| library.join(&session));
        let is_free = workbench
            .free_verdict()
            .and(require(!workbench.queue.is_busy(), "the queue is being written"));
        let has_reason =
            require(!self.reason.trim().is_empty(), "to reject a run, give the reason");
        let can_reject = is_free.clone().and(has_reason);
        ui.horizontal_wrapped(|ui| {
            for (words, verdict, can) in [
                ("Accept", QueueVerdict::Accept, &is_free),
                ("Reject", QueueVerdict::Reject, &can_reject),
                ("Repeat", QueueVerdict::Repeat, &can_reject),
            ] {
                let button = Button::new(words).min_size(BUTTON);
                if ui.add_enabled(can.is_ok(), button).named(words).clicked() {
                    let work = QueueWork::Judge(session.clone(), verdict);
                    commands.push(UiCommand::Queue(work, std::mem::take(&mut self.reason)));
                }
            }
            let show = "Show it in Review";
            if ui.add(Button::new(show).min_size(BUTTON)).named(show).clicked() {
                commands.push(UiCommand::Review(vec![session.clone()]));
            }
        });
        if let Err(reason) = can_reject {
            quiet_ui(ui, reason);
        }
    }

    /// The field that a barcode scanner types into.
    fn scan_ui(&mut self, ui: &mut Ui, workbench: &Workbench, commands: &mut Commands) {
        ui.add_space(6.0);
        // What stands above changes with a verdict; the field keeps the keys.
        let row = |ui: &mut Ui| {
            let label = form_label(ui, "scan here");
            let input = TextEdit::singleline(&mut self.scanned).char_limit(200);
            let input = input.desired_width(320.0).hint_text("scan or type a name, then Enter");
            let input = ui.add(input).labelled_by(label.id).named("scan here");
            if std::mem::take(&mut self.is_to_focus) {
                input.request_focus();
            }
            let is_entered = ui.input(|input| input.key_pressed(Key::Enter));
            input.lost_focus() && is_entered
        };
        let is_taken = steady(ui, "scan here", |ui| ui.horizontal(row).inner);
        if is_taken {
            self.scan(workbench, commands);
        }
        match &self.answer {
            Some(Ok(words)) => placeholder_ui(ui, words),
            Some(Err(reason)) => alarm_ui(ui, reason),
            None => {}
        }
        if let Some(name) = &self.unknown {
            let words = format!("Add {name} to the queue");
            if ui.add(Button::new(&words).min_size(BUTTON)).named(&words).clicked() {
                let work =
                    QueueWork::AddNamed(vec![name.clone()], workbench.form.specimen_protocol());
                commands.push(UiCommand::Queue(work, String::new()));
                (self.unknown, self.answer) = (None, None);
            }
        }
    }

    fn scan(&mut self, workbench: &Workbench, commands: &mut Commands) {
        let name = std::mem::take(&mut self.scanned);
        let name = name.trim();
        self.is_to_focus = true;
        (self.unknown, self.answer) = (None, None);
        if name.is_empty() {
            return;
        }
        self.answer = match workbench.queue.queue().find(name) {
            None => {
                self.unknown = Some(name.to_owned());
                Some(Err(format!("'{name}' is not in the queue")))
            }
            Some(item) if item.state == SpecimenState::Waiting => {
                commands.push(UiCommand::TakeSpecimen(item.number));
                None
            }
            Some(item) => {
                self.chosen = Some(item.number);
                Some(Err(format!(
                    "{name} is {}; to measure it again, give a reason and press 'Let it wait again'",
                    item.state
                )))
            }
        };
    }

    /// What can be done with the chosen specimen.
    fn chosen_ui(
        &mut self,
        ui: &mut Ui,
        items: &[QueueItem],
        workbench: &Workbench,
        commands: &mut Commands,
    ) {
        let Some(chosen) = items.iter().find(|item| Some(item.number) == self.chosen) else {
            quiet_ui(
                ui,
                "Choose a specimen in the list to move it, to skip it or to let it wait again.",
            );
            return;
        };
        let words = format!("{}: {}", chosen.wanted.specimen, chosen.state);
        ui.add(Label::new(RichText::new(words).strong()).truncate());
        text_row(ui, "why", "to skip, to move, to let it wait again", &mut self.reason);
        let is_free = require(!workbench.queue.is_busy(), "the queue is being written");
        let has_reason = require(!self.reason.trim().is_empty(), "give the reason; it is kept");
        let (state, number) = (chosen.state, chosen.number);
        let waits = |wanted: bool| {
            let is_so =
                (state == SpecimenState::Waiting) == wanted && state != SpecimenState::Begun;
            require(
                is_so,
                if wanted { "it does not wait" } else { "it waits, or has no verdict" },
            )?;
            is_free.clone()?;
            has_reason.clone()
        };
        let mut refusals = Vec::new();
        ui.horizontal_wrapped(|ui| {
            for (words, can, change) in [
                ("Make it the next", waits(true), QueueChange::Moved { number, place: 1 }),
                ("Skip", waits(true), QueueChange::Skipped { number }),
                ("Let it wait again", waits(false), QueueChange::Restored { number }),
            ] {
                let button = Button::new(words).min_size(BUTTON);
                if ui.add_enabled(can.is_ok(), button).named(words).clicked() {
                    let reason = std::mem::take(&mut self.reason);
                    commands.push(UiCommand::Queue(QueueWork::Change(change), reason));
                }
                refusals.push(can.err());
            }
        });
        // Of what could be done with one in this state.
        let own = if state == SpecimenState::Waiting { 0 } else { 2 };
        if let Some(reason) = &refusals[own] {
            quiet_ui(ui, reason);
        }
    }

    fn table_ui(&mut self, ui: &mut Ui, items: &[QueueItem]) {
        let mut columns = [
            Column::numbers("number", 46.0),
            Column::words("specimen", 96.0),
            Column::words("protocol", 84.0),
            Column::words("state", 70.0),
            Column::numbers("runs", 34.0),
            Column::words("remark", 0.0),
        ];
        // The last one takes what is left.
        columns[5].width = (ui.available_width() - width_of(&columns)).max(REMARK_WIDTH_MIN);
        let table = ChoiceTable {
            name: "queue",
            columns: &columns,
            can_sort: &|_| false,
            sorted: None,
            count: items.len(),
            at: items.iter().position(|item| Some(item.number) == self.chosen),
            line: &|index| line(&items[index]),
            is_chosen: &|index| Some(items[index].number) == self.chosen,
        };
        let (acts, _) = table.ui(ui, &mut self.scrolled);
        for act in acts {
            if let TableAction::Choose(index, _) = act
                && self.chosen.replace(items[index].number) != Some(items[index].number)
            {
                // A reason is about one specimen.
                self.reason.clear();
            }
        }
    }
}

/// The next specimen, and the one button that matters.
fn next_ui(
    ui: &mut Ui,
    workbench: &Workbench,
    next: &Result<u32, String>,
    commands: &mut Commands,
) {
    section_ui(ui, "Next specimen");
    let verdict = next.clone().map(|_| ());
    let mut button_ui = |ui: &mut Ui| {
        if reason_button(ui, "Measure the next specimen", NEXT_BUTTON, &verdict)
            && let Ok(number) = next
        {
            commands.push(UiCommand::TakeSpecimen(*number));
        }
    };
    let space = ui.available_width() - NEXT_BUTTON.x - ui.spacing().item_spacing.x;
    if space < NAME_WIDTH_MIN {
        waiting_ui(ui, workbench);
        button_ui(ui);
        return;
    }
    ui.horizontal_top(|ui| {
        ui.vertical(|ui| {
            ui.set_width(space);
            waiting_ui(ui, workbench);
        });
        ui.vertical(button_ui);
    });
}

/// Draws the specimen that comes next.
fn waiting_ui(ui: &mut Ui, workbench: &Workbench) {
    let queue = workbench.queue.queue();
    match queue.next() {
        Some(item) => {
            headline_ui(ui, &item.wanted.specimen);
            placeholder_ui(ui, format!("protocol {}", item.wanted.protocol));
        }
        None if !workbench.queue.is_read() => placeholder_ui(ui, "reading the queue"),
        None => placeholder_ui(
            ui,
            "No specimen waits. Add some on the left, or go to the screen Run for a single one.",
        ),
    }
}

fn headline_ui(ui: &mut Ui, words: &str) {
    let ink = tokens_of(ui).text;
    ui.add(Label::new(RichText::new(words).size(28.0).strong().color(ink)).truncate());
}

fn line(item: &QueueItem) -> TableLine {
    let emphasis = match item.state {
        SpecimenState::Waiting => Emphasis::Plain,
        SpecimenState::Begun => Emphasis::Marked,
        SpecimenState::Accepted | SpecimenState::Skipped => Emphasis::Quiet,
        SpecimenState::Rejected => Emphasis::Alarm,
    };
    let cell = |text: String| TableCell { glyph: None, text, emphasis };
    TableLine {
        name: format!("{}, {}", item.wanted.specimen, item.state),
        cells: vec![
            cell(item.number.to_string()),
            cell(item.wanted.specimen.clone()),
            cell(item.wanted.protocol.clone()),
            cell(item.state.to_string()),
            cell(item.sessions.len().to_string()),
            cell(item.reason.clone()),
        ],
    }
}
