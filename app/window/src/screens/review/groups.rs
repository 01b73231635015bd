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

palpate_model::named! {
    /// What a colour stands for.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Coloring {
        Session = "session",
        Group = "group",
    }
}

/// So many sessions have colours of their own; of more, groups have one each where nothing was chosen.
const OWN_COLORS: usize = 4;

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
    /// What a colour stands for now.
    pub(super) fn coloring(&self) -> Coloring {
        self.chosen_coloring.unwrap_or_else(|| {
            let count = groups(&self.subjects, self.grouping).len();
            match self.subjects.len() > OWN_COLORS && count > 1 {
                true => Coloring::Group,
                false => Coloring::Session,
            }
        })
    }

    /// Gives every session its colour.
    pub(super) fn set_colors(&mut self) {
        match self.coloring() {
            Coloring::Session => {
                for subject in &mut self.subjects {
                    subject.color = usize::try_from(subject.id).unwrap_or_default();
                }
            }
            Coloring::Group => {
                for (color, group) in groups(&self.subjects, self.grouping).iter().enumerate() {
                    group.members.iter().for_each(|member| self.subjects[*member].color = color);
                }
            }
        }
    }

    /// Draws the choices of groups and of colours, a line each.
    pub(super) fn grouping_ui(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.label("groups");
            for by in Grouping::ALL {
                let name = format!("group by {by}");
                let choice = ui.selectable_value(&mut self.grouping, by, by.name());
                choice.accessible_name(&name).named(&name);
            }
        });
        ui.horizontal(|ui| {
            ui.label("colours");
            let now = self.coloring();
            for of in Coloring::ALL {
                let name = format!("a colour for each {of}");
                let choice = ui.selectable_label(of == now, of.name());
                if choice.accessible_name(&name).named(&name).clicked() {
                    self.chosen_coloring = Some(of);
                }
            }
        });
    }
}
