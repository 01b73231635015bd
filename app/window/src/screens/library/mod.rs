//! The library's screen: sessions found by what is known of them, looked at, spoken of and written out.
//!
//! A search asks what the catalog knows already; reading what is new goes on beside it, and what it finds is searched again.

mod edits;
mod files;
mod form;
mod import;
mod list;
mod session;

use super::screen::{Screen, ScreenEntry, ScreenReply};
use crate::command::{CommandQueue, UserCommand};
use crate::widgets::fact_row::section_ui;
use crate::widgets::reason_button::reason_button;
use crate::widgets::task_bar::progress_ui;
use crate::workbench::Workbench;
use crate::workers::latest::LatestAnswer;
use crate::workers::task::BackgroundTask;
use edits::{EditPanel, sentence};
use eframe::egui::{Context, Key, Label, RichText, TextStyle, Ui, vec2};
use files::FilesPanel;
use form::SearchForm;
use import::ImportPanel;
use list::{ListRequest, SessionList};
use palpate_analysis::find::{Found, Search, Told, entries, search, told, update};
use palpate_sessions::catalog::{Changes, Choices, Entry, Query};
use std::path::PathBuf;
use std::rc::Rc;

/// The screen's line in the table.
pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Library",
    purpose: "find sessions",
    key: Key::Num4,
    open: |workbench| Box::new(LibraryScreen::new(workbench.library.clone())),
};

/// Sessions of which all that is known comes with the search.
const PAGE: usize = 120;

/// Seconds of work that nobody needs a bar for.
const SHORT_S: f64 = 1.0;

/// Sessions that the review screen takes at a time.
const REVIEW_MAX: usize = 50;

/// What stands above the list.
#[derive(Debug, Default)]
struct Heading {
    count: usize,
    seconds: f64,
    doubts: Vec<String>,
    remarks: Vec<String>,
}

/// What was said of the session chosen.
struct SessionDetails {
    folder: String,
    /// Of which reading of the catalog it is.
    generation: u64,
    told: Option<Result<Told, String>>,
}

/// The search and what it found.
pub struct LibraryScreen {
    library: Result<PathBuf, String>,
    form: SearchForm,
    asked: Option<Query>,
    search: LatestAnswer<Search, Found>,
    pages: LatestAnswer<(PathBuf, Vec<String>), Vec<Entry>>,
    last_page: (u64, Vec<String>),
    searches: u64,
    told: LatestAnswer<(PathBuf, Entry), Told>,
    known: Option<SessionDetails>,
    update: BackgroundTask<Changes>,
    is_update_wanted: bool,
    choices: Choices,
    heading: Option<Result<Heading, String>>,
    list: SessionList,
    /// Folders of those chosen, and of which choice they are: a list of thousands is not made in every frame.
    chosen: (u64, Rc<Vec<PathBuf>>),
    edits: EditPanel,
    files: FilesPanel,
    import: ImportPanel,
    was_shown: bool,
    is_back: bool,
}

impl LibraryScreen {
    fn new(library: Result<PathBuf, String>) -> Self {
        Self {
            library,
            form: SearchForm::default(),
            asked: None,
            search: LatestAnswer::new("search", search),
            pages: LatestAnswer::new("entries", entries),
            last_page: (0, Vec::new()),
            searches: 0,
            told: LatestAnswer::new("told", told),
            known: None,
            update: BackgroundTask::default(),
            is_update_wanted: false,
            choices: Choices::default(),
            heading: None,
            list: SessionList::default(),
            chosen: (0, Rc::default()),
            edits: EditPanel::default(),
            files: FilesPanel::default(),
            import: ImportPanel::default(),
            was_shown: false,
            is_back: true,
        }
    }

    /// Whether sessions are being read or searched.
    fn is_busy(&self) -> bool {
        self.search.is_busy() || self.is_update_wanted || self.update.state().is_some()
    }

    fn poll_update(&mut self, ctx: &Context) {
        let was_busy = self.update.state().is_some();
        self.update.poll();
        if was_busy && self.update.state().is_none() {
            self.ask(ctx);
        }
        if self.is_update_wanted
            && self.update.state().is_none()
            && let Ok(library) = self.library.clone()
        {
            self.is_update_wanted = false;
            self.update.start("catalog", ctx, move |progress| update(&library, progress));
        }
    }

    /// Asks for what is in sight or chosen and not known yet, and for what was said of the one chosen.
    fn ask_for_more(&mut self, ctx: &Context) {
        let Ok(library) = &self.library else { return };
        let page = (self.searches, self.list.unknown());
        if !page.1.is_empty() && page != self.last_page {
            self.last_page = page.clone();
            self.pages.ask((library.clone(), page.1), ctx);
        }
        let only = self.list.only();
        let Some((entry, generation)) = only else {
            self.known = None;
            return;
        };
        let is_known = self
            .known
            .as_ref()
            .is_some_and(|known| known.folder == entry.folder && known.generation == generation);
        if !is_known {
            // What was read before stays until the new is there.
            let before = self.known.take();
            let before = before.filter(|known| known.folder == entry.folder);
            self.known = Some(SessionDetails {
                folder: entry.folder.clone(),
                generation,
                told: before.and_then(|known| known.told),
            });
            self.told.ask((library.clone(), entry.clone()), ctx);
        }
    }

    /// Searches, and reads what has changed.
    fn look_again(&mut self, ctx: &Context) {
        self.ask(ctx);
        self.is_update_wanted = true;
    }

    /// Searches for what stands in the form, if that can be.
    fn ask(&mut self, ctx: &Context) {
        let (Ok(library), Ok(query)) = (&self.library, self.form.query()) else {
            return;
        };
        self.asked = Some(query.clone());
        let library = library.clone();
        self.search.ask(Search { library, query, page: PAGE }, ctx);
    }

    /// Folders of the sessions chosen.
    fn chosen(&mut self) -> Rc<Vec<PathBuf>> {
        if self.chosen.0 != self.list.choice()
            && let Ok(library) = &self.library
        {
            let folders = self.list.chosen().into_iter();
            let folders = folders.map(|folder| library.join(folder)).collect();
            self.chosen = (self.list.choice(), Rc::new(folders));
        }
        Rc::clone(&self.chosen.1)
    }

    /// Whether the sessions chosen can be looked at, or why not.
    fn may_review(&self) -> Result<(), String> {
        match self.list.chosen_count() {
            0 => Err("choose sessions first".into()),
            count if count > REVIEW_MAX => Err(format!(
                "{count} sessions are more than the {REVIEW_MAX} that can be looked at together"
            )),
            _ => Ok(()),
        }
    }

    fn review(&mut self, commands: &mut CommandQueue) {
        if self.may_review().is_ok() {
            commands.push(UserCommand::Review(self.chosen().to_vec()));
        }
    }

    fn heading_ui(&self, ui: &mut Ui) {
        match &self.heading {
            None => sentence(ui, "searching", false),
            Some(Err(err)) => sentence(ui, err, true),
            Some(Ok(heading)) => {
                let sessions = match heading.count {
                    1 => "1 session".to_owned(),
                    count => format!("{count} sessions"),
                };
                let chosen = match self.list.chosen_count() {
                    0 => String::new(),
                    count => format!(", {count} chosen"),
                };
                let text = format!(
                    "{sessions}{chosen}, found in {:.0} ms",
                    (heading.seconds * 1e3).max(1.0)
                );
                ui.label(RichText::new(text).text_style(TextStyle::Heading).strong());
                let remarks = heading.doubts.iter().chain(&heading.remarks);
                remarks.for_each(|remark| sentence(ui, remark, true));
                if heading.count == 0 && !self.is_busy() {
                    sentence(ui, "No session is like that.", false);
                }
            }
        }
        if let Some(Ok(changes)) = self.update.answer() {
            let remarks = changes.remarks.iter();
            remarks.for_each(|remark| sentence(ui, remark, true));
        }
    }
}

impl Screen for LibraryScreen {
    fn left_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut CommandQueue) {
        let ctx = ui.ctx().clone();
        section_ui(ui, "Find sessions");
        if let Err(err) = &self.library {
            sentence(ui, err, true);
            return;
        }
        self.form.ui(ui, &self.choices);
        ui.horizontal(|ui| {
            if ui.button("Show all").clicked() {
                self.form.clear();
            }
            if ui.button("Look for new sessions").clicked() {
                self.look_again(&ctx);
            }
        });
        match self.update.state() {
            Some(state) if state.seconds > SHORT_S => {
                if progress_ui(ui, &state, "Stop reading") {
                    self.update.cancel();
                }
            }
            Some(_) => {}
            None => {
                if let Some(Err(err)) = self.update.answer() {
                    sentence(ui, err, true);
                }
            }
        }
        let chosen = self.chosen();
        self.files.ui(ui, &chosen);
        if let Ok(library) = &self.library {
            self.import.ui(ui, library);
        }
        let is_new = match self.form.query() {
            Ok(query) => self.asked.as_ref() != Some(&query),
            // What is wrong is told beside its field; the list stays as it was.
            Err(_) => false,
        };
        if is_new {
            self.ask(&ctx);
        }
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, commands: &mut CommandQueue) {
        self.heading_ui(ui);
        let help = "Arrows choose, Shift extends, Space and Ctrl with a click add, Ctrl+A takes all, Enter reviews.";
        ui.add(Label::new(RichText::new(help).small().weak()).truncate());
        let sorted = (self.form.order, self.form.is_reversed);
        for wanted in self.list.ui(ui, sorted) {
            match wanted {
                ListRequest::Open => self.review(commands),
                ListRequest::Sort(order) => {
                    self.form.sort(order);
                    self.ask(&ui.ctx().clone());
                }
            }
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, commands: &mut CommandQueue) {
        let chosen = self.chosen();
        if chosen.is_empty() {
            section_ui(ui, "Session");
            sentence(ui, "Choose one in the list, or several.", false);
        } else {
            let may = self.may_review();
            let key = Key::Enter.name();
            if reason_button(ui, &format!("Review  {key}"), vec2(170.0, 30.0), &may) {
                self.review(commands);
            }
        }
        match (self.list.only(), chosen.as_slice()) {
            (Some((entry, _)), [folder]) => {
                let told = self.known.as_ref().and_then(|known| known.told.as_ref());
                session::session_ui(ui, entry, told);
                self.edits.ui(ui, &chosen);
                session::replay_ui(ui, folder);
            }
            (_, []) => self.edits.ui(ui, &chosen),
            _ => {
                session::several_ui(ui, chosen.len(), self.list.chosen_entries());
                self.edits.ui(ui, &chosen);
            }
        }
    }

    fn poll(&mut self, ctx: &Context, workbench: &mut Workbench) {
        self.is_back |= !std::mem::take(&mut self.was_shown);
        if let Some(found) = self.search.poll(ctx) {
            self.searches += 1;
            self.heading = Some(found.map(|mut found| {
                self.list.take(&mut found);
                self.choices = found.choices;
                // A file that was set aside has been replaced by an empty one.
                self.is_update_wanted |= !found.remarks.is_empty();
                Heading {
                    count: self.list.count(),
                    seconds: found.seconds,
                    doubts: found.doubts,
                    remarks: found.remarks,
                }
            }));
        }
        if let Some(Ok(entries)) = self.pages.poll(ctx) {
            self.list.learn(entries);
        }
        if let Some(told) = self.told.poll(ctx)
            && let Some(known) = &mut self.known
        {
            known.told = Some(told);
        }
        self.is_update_wanted |= self.edits.poll() | self.import.poll();
        self.files.poll();
        self.poll_update(ctx);
        self.ask_for_more(ctx);
        let chosen = self.chosen();
        if workbench.front.library.as_ref() != chosen.first() {
            workbench.front.library = chosen.first().cloned();
        }
    }

    fn shown(&mut self, ctx: &Context) {
        self.was_shown = true;
        if std::mem::take(&mut self.is_back) {
            self.look_again(ctx);
        }
        self.edits.keys(ctx);
    }

    fn act(
        &mut self,
        _ctx: &Context,
        command: &UserCommand,
        _workbench: &mut Workbench,
    ) -> ScreenReply {
        match command {
            UserCommand::Import(files) => self.import.add(files),
            _ => return ScreenReply::NotMine,
        }
        ScreenReply::Show
    }
}
