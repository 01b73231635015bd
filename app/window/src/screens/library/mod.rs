//! The library's screen: search, edit, export and import of sessions.
//!
//! A search uses the catalog as it is; an update of the catalog runs at the same time and is followed by another search.

mod edits;
mod files;
mod form;
mod import;
mod list;
mod session;

use super::screen::{Commands, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::widgets::{progress_ui, quiet_ui, reason_button, require, section_ui, small_alarm_ui};
use crate::workers::{BackgroundTask, LatestAnswer};
use edits::EditPanel;
use eframe::egui::{Context, Key, Label, RichText, TextStyle, Ui, vec2};
use files::FilesPanel;
use form::SearchForm;
use import::ImportPanel;
use list::{ListRequest, SessionList};
use palpate_analysis::catalog_search::{
    CatalogSearch, CatalogSearchResult, SessionHistory, entries, read_session_history, search,
    update,
};
use palpate_sessions::catalog::{CatalogChanges, CatalogChoices, CatalogEntry, CatalogQuery};
use std::path::PathBuf;
use std::rc::Rc;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Library",
    icon: lucide_icons::Icon::Library,
    purpose: "find sessions",
    key: Some(Key::Num4),
    open: |workbench| Box::new(LibraryScreen::new(workbench.library.clone())),
};

/// Entries that come with a search.
const PAGE: usize = 120;

/// Work of fewer seconds has no progress bar.
const SHORT_S: f64 = 1.0;

/// Sessions on the review screen.
const REVIEW_MAX: usize = 50;

/// Notes and history of the session chosen.
struct SessionDetails {
    folder: String,
    /// Of its catalog entry.
    generation: u64,
    history: Option<Result<SessionHistory, String>>,
}

pub struct LibraryScreen {
    library: Result<PathBuf, String>,
    form: SearchForm,
    /// The query of the search shown or in progress.
    query: Option<CatalogQuery>,
    search: LatestAnswer<CatalogSearch, CatalogSearchResult>,
    pages: LatestAnswer<(PathBuf, Vec<String>), Vec<CatalogEntry>>,
    last_page: (u64, Vec<String>),
    searches: u64,
    histories: LatestAnswer<(PathBuf, CatalogEntry), SessionHistory>,
    details: Option<SessionDetails>,
    update: BackgroundTask<CatalogChanges>,
    is_update_wanted: bool,
    choices: CatalogChoices,
    found: Option<Result<CatalogSearchResult, String>>,
    list: SessionList,
    /// Folders of the sessions chosen, and the number of the choice: thousands are not joined in every frame.
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
            query: None,
            search: LatestAnswer::new("search", search),
            pages: LatestAnswer::new("entries", entries),
            last_page: (0, Vec::new()),
            searches: 0,
            histories: LatestAnswer::new("history", read_session_history),
            details: None,
            update: BackgroundTask::default(),
            is_update_wanted: false,
            choices: CatalogChoices::default(),
            found: None,
            list: SessionList::default(),
            chosen: (0, Rc::default()),
            edits: EditPanel::default(),
            files: FilesPanel::default(),
            import: ImportPanel::default(),
            was_shown: false,
            is_back: true,
        }
    }

    fn is_busy(&self) -> bool {
        self.search.is_busy() || self.is_update_wanted || self.update.is_busy()
    }

    fn poll_update(&mut self, ctx: &Context) {
        if self.update.poll() {
            self.start_search(ctx);
        }
        if self.is_update_wanted
            && !self.update.is_busy()
            && let Ok(library) = self.library.clone()
        {
            self.is_update_wanted = false;
            self.update.start("catalog", ctx, move |progress| update(&library, progress));
        }
    }

    /// Reads missing entries, and notes and history of a single session chosen.
    fn read_details(&mut self, ctx: &Context) {
        let Ok(library) = &self.library else { return };
        let page = (self.searches, self.list.unknown());
        if !page.1.is_empty() && page != self.last_page {
            self.last_page = page.clone();
            self.pages.ask((library.clone(), page.1), ctx);
        }
        let Some((entry, generation)) = self.list.only() else {
            self.details = None;
            return;
        };
        let old = self.details.take().filter(|old| old.folder == entry.folder);
        if old.as_ref().is_none_or(|old| old.generation != generation) {
            self.histories.ask((library.clone(), entry.clone()), ctx);
        }
        // The old history stays until the new one is read.
        let history = old.and_then(|old| old.history);
        self.details = Some(SessionDetails { folder: entry.folder.clone(), generation, history });
    }

    /// Searches, and updates the catalog.
    fn refresh(&mut self, ctx: &Context) {
        self.start_search(ctx);
        self.is_update_wanted = true;
    }

    /// Searches, unless the form has an error.
    fn start_search(&mut self, ctx: &Context) {
        let (Ok(library), Ok(query)) = (&self.library, self.form.query()) else { return };
        self.query = Some(query.clone());
        let library = library.clone();
        self.search.ask(CatalogSearch { library, query, page: PAGE }, ctx);
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

    /// Whether the sessions chosen can be reviewed, or why not.
    fn review_verdict(&self) -> Result<(), String> {
        let count = self.list.chosen_count();
        require(count > 0, "choose sessions first")?;
        let words = format!("{count} sessions are chosen; choose at most {REVIEW_MAX}");
        require(count <= REVIEW_MAX, words)
    }

    fn review(&mut self, commands: &mut Commands) {
        if self.review_verdict().is_ok() {
            commands.push(UiCommand::Review(self.chosen().to_vec()));
        }
    }

    fn heading_ui(&self, ui: &mut Ui) {
        match &self.found {
            None => quiet_ui(ui, "searching"),
            Some(Err(err)) => small_alarm_ui(ui, err),
            Some(Ok(found)) => {
                let sessions = match self.list.count() {
                    1 => "1 session".to_owned(),
                    count => format!("{count} sessions"),
                };
                let chosen = match self.list.chosen_count() {
                    0 => String::new(),
                    count => format!(", {count} chosen"),
                };
                let text = format!(
                    "{sessions}{chosen}, found in {:.0} ms",
                    (found.seconds * 1e3).max(1.0)
                );
                ui.label(RichText::new(text).text_style(TextStyle::Heading).strong());
                let remarks = found.doubts.iter().chain(&found.remarks);
                remarks.for_each(|remark| small_alarm_ui(ui, remark));
                if self.list.count() == 0 && !self.is_busy() {
                    quiet_ui(ui, "No session matches the search.");
                }
            }
        }
        if let Some(Ok(changes)) = self.update.answer() {
            changes.remarks.iter().for_each(|remark| small_alarm_ui(ui, remark));
        }
    }
}

impl Screen for LibraryScreen {
    fn left_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        let ctx = ui.ctx().clone();
        section_ui(ui, "Find sessions");
        if let Err(err) = &self.library {
            return small_alarm_ui(ui, err);
        }
        self.form.ui(ui, &self.choices);
        ui.horizontal(|ui| {
            if ui.button("Clear search").clicked() {
                self.form.clear();
            }
            if ui.button("Refresh").clicked() {
                self.refresh(&ctx);
            }
        });
        match (self.update.state(), self.update.answer()) {
            (Some(state), _)
                if state.seconds > SHORT_S && progress_ui(ui, &state, "Stop reading") =>
            {
                self.update.cancel();
            }
            (None, Some(Err(err))) => small_alarm_ui(ui, err),
            _ => {}
        }
        let chosen = self.chosen();
        self.files.ui(ui, &chosen);
        if let Ok(library) = &self.library {
            self.import.ui(ui, library);
        }
        // With an error in the form the list stays as it was.
        if self.form.query().is_ok_and(|query| self.query.as_ref() != Some(&query)) {
            self.start_search(&ctx);
        }
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, commands: &mut Commands) {
        self.heading_ui(ui);
        let help = "Arrow keys choose a session, Shift extends the choice, Space or Ctrl+click adds a session, Ctrl+A chooses all, Enter opens the chosen sessions in Review.";
        ui.add(Label::new(RichText::new(help).small().weak()).wrap());
        let sorted = (self.form.order, self.form.is_reversed);
        for request in self.list.ui(ui, sorted) {
            match request {
                ListRequest::Open => self.review(commands),
                ListRequest::Sort(order) => {
                    self.form.sort(order);
                    self.start_search(&ui.ctx().clone());
                }
            }
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        self.edits.offer_author(workbench.form.label_text("operator"));
        let chosen = self.chosen();
        if chosen.is_empty() {
            section_ui(ui, "Session");
            quiet_ui(ui, "Choose sessions in the list.");
        } else {
            let may = self.review_verdict();
            let key = Key::Enter.name();
            if reason_button(ui, &format!("Review  {key}"), vec2(170.0, 30.0), &may) {
                self.review(commands);
            }
        }
        match (self.list.only(), chosen.as_slice()) {
            (Some((entry, _)), [folder]) => {
                let history = self.details.as_ref().and_then(|one| one.history.as_ref());
                session::session_ui(ui, entry, history);
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
        if let Some(mut answer) = self.search.poll(ctx) {
            self.searches += 1;
            if let Ok(found) = &mut answer {
                self.list.take(found);
                self.choices = std::mem::take(&mut found.choices);
                // A damaged catalog was replaced by an empty one.
                self.is_update_wanted |= !found.remarks.is_empty();
            }
            self.found = Some(answer);
        }
        if let Some(Ok(entries)) = self.pages.poll(ctx) {
            self.list.learn(entries);
        }
        if let (Some(history), Some(details)) = (self.histories.poll(ctx), &mut self.details) {
            details.history = Some(history);
        }
        self.is_update_wanted |= self.edits.poll() | self.import.poll();
        self.files.poll();
        self.poll_update(ctx);
        self.read_details(ctx);
        let chosen = self.chosen();
        if workbench.front.library.as_ref() != chosen.first() {
            workbench.front.library = chosen.first().cloned();
        }
    }

    fn shown(&mut self, ctx: &Context) {
        self.was_shown = true;
        if std::mem::take(&mut self.is_back) {
            self.refresh(ctx);
        }
        self.edits.read_keys(ctx);
    }

    fn act(&mut self, _ctx: &Context, command: &UiCommand, _workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::Import(files) => self.import.add(files),
            _ => return Reaction::NotMine,
        }
        Reaction::Show
    }
}
