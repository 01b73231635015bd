//! Sessions in groups: those of one specimen or of one protocol.

use super::ReviewScreen;
use super::session_list::CommonParts;
use super::subject::ReviewSubject;
use crate::widgets::NamedControl;
use eframe::egui::Ui;

palpate_model::named! {
    /// What the sessions of a group have in common.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Grouping {
        #[default]
        Specimen = "specimen",
        Protocol = "protocol",
        /// All sessions are one group.
        None = "none",
    }
}

/// Sessions of one group, by their places among those shown, in the order in which they were added.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct SessionGroup {
    /// Empty where all are one group.
    pub name: String,
    pub members: Vec<usize>,
}

impl SessionGroup {
    /// The short name of each member: what the others of the group have not.
    pub fn short_names(&self, subjects: &[ReviewSubject]) -> Vec<String> {
        let own = || self.members.iter().map(|index| &subjects[*index]);
        let common = match self.members.len() {
            1 => CommonParts::of(subjects.iter()),
            _ => CommonParts::of(own()),
        };
        own().map(|one| common.short_name(one)).collect()
    }
}

/// The groups in the order of their names.
pub(super) fn groups(subjects: &[ReviewSubject], by: Grouping) -> Vec<SessionGroup> {
    let mut found: Vec<SessionGroup> = Vec::new();
    let mut order: Vec<usize> = (0..subjects.len()).collect();
    order.sort_by_key(|index| subjects[*index].id);
    for index in order {
        let parts = subjects[index].parts.as_ref();
        let name = match by {
            Grouping::Specimen => parts.map(|parts| parts.specimen.clone()),
            Grouping::Protocol => parts.map(|parts| parts.protocol.clone()),
            Grouping::None => None,
        };
        let name = name.unwrap_or_default();
        match found.iter_mut().find(|group| group.name == name) {
            Some(group) => group.members.push(index),
            None => found.push(SessionGroup { name, members: vec![index] }),
        }
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found
}

impl ReviewScreen {
    /// Draws the choice of groups in a line.
    pub(super) fn grouping_ui(&mut self, ui: &mut Ui) {
        ui.label("groups:");
        for by in Grouping::ALL {
            let name = format!("group by {by}");
            let choice = ui.selectable_value(&mut self.grouping, by, by.name());
            choice.accessible_name(&name).named(&name);
        }
    }
}
