//! The scene as typed.

use crate::widgets::{
    NamedControl, QuantityField, check_rate, quantity_ui, quiet_ui, require, section_ui, text_row,
    tick_box,
};
use eframe::egui::Ui;
use palpate_analysis::scene_device::{DeviceChoice, DeviceName};
use palpate_haptics::scene::{ScenePath, SceneSettings};
use palpate_haptics::surface::INERT;
use palpate_runner::haptics::scene_file::SceneFile;

/// The path that is chosen first.
pub(super) const FIRST_PATH: ScenePath = ScenePath::Poke;

/// Nodes along a side that a scene may have.
const NODES: [f64; 2] = [3.0, 1601.0];

/// A button of the scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileAction {
    Dialog,
    Read,
}

/// What moves the stylus, as chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HandChoice {
    Path(ScenePath),
    Pointer,
    Device,
}

/// A scene file's numbers and what moves the stylus.
pub(super) struct SceneForm {
    /// Path of the file; none for the scene built in.
    pub file: String,
    /// What was read of it.
    read: SceneFile,
    notes: Vec<String>,
    side: QuantityField,
    nodes: QuantityField,
    slope: QuantityField,
    friction: QuantityField,
    rate: QuantityField,
    is_guarded: bool,
    pub hand: HandChoice,
    /// A real device, and where the service of an Inverse listens.
    device: String,
    service: String,
}

impl Default for SceneForm {
    fn default() -> Self {
        Self::of(SceneFile::default())
    }
}

impl SceneForm {
    fn of(read: SceneFile) -> Self {
        let nodes = read.nodes.unwrap_or(SceneSettings::default().nodes);
        Self {
            file: String::new(),
            notes: Vec::new(),
            side: QuantityField::new(read.side_mm),
            nodes: QuantityField::new(nodes as f64),
            slope: QuantityField::new(read.slope),
            friction: QuantityField::new(read.friction),
            rate: QuantityField::new(read.rate_hz),
            is_guarded: read.is_guarded,
            hand: HandChoice::Path(FIRST_PATH),
            device: "inverse".into(),
            service: "127.0.0.1:10001".into(),
            read,
        }
    }

    /// Takes what was read of a file.
    pub fn fill(&mut self, read: SceneFile, mut notes: Vec<String>) {
        if read.nodes.is_none() && read.mesh.is_none() {
            notes.push("The file has no mesh size; plan the mesh on the Trade screen.".into());
        }
        self.notes = notes;
        self.take(read);
    }

    /// Takes other numbers of the same scene.
    pub fn take(&mut self, file: SceneFile) {
        *self = Self {
            file: std::mem::take(&mut self.file),
            hand: self.hand,
            device: std::mem::take(&mut self.device),
            service: std::mem::take(&mut self.service),
            notes: std::mem::take(&mut self.notes),
            ..Self::of(file)
        };
    }

    /// Checks every field.
    pub fn check(&mut self) {
        let within = |value: f64, [low, high]: [f64; 2]| {
            require((low..=high).contains(&value), format!("must be from {low} to {high}"))
        };
        self.side.check(|side| within(side, [1.0, 1000.0]));
        self.nodes.check(|nodes| {
            require(nodes.fract() == 0.0, "must be a whole number").and(within(nodes, NODES))
        });
        self.slope.check(|slope| within(slope, [0.0, 1000.0]));
        self.friction.check(|friction| within(friction, [0.0, 10.0]));
        self.rate.check(check_rate);
    }

    /// The path that is chosen, or the one to begin with.
    pub fn path(&self) -> ScenePath {
        match self.hand {
            HandChoice::Path(path) => path,
            HandChoice::Pointer | HandChoice::Device => FIRST_PATH,
        }
    }

    /// The device to open.
    pub fn device(&self) -> Result<DeviceChoice, String> {
        let name: DeviceName =
            self.device.trim().parse().map_err(|words| format!("device: {words}"))?;
        let service = self.service.trim().parse();
        Ok(name.at(service.map_err(|_| "service: give ADDRESS:PORT, such as 127.0.0.1:10001")?))
    }

    /// What the scene is made of, or the first thing that is wrong.
    pub fn settings(&self) -> Result<SceneSettings, String> {
        let file = self.scene_file()?;
        file.settings(SceneSettings::default().nodes)
    }

    /// The same as a scene file.
    pub fn scene_file(&self) -> Result<SceneFile, String> {
        // A mesh has no side and no nodes along it.
        let (nodes, side_mm) = match self.read.mesh {
            None => {
                (Some(self.nodes.named_value("nodes")? as usize), self.side.named_value("side")?)
            }
            Some(_) => (None, self.read.side_mm),
        };
        Ok(SceneFile {
            nodes,
            side_mm,
            slope: self.slope.named_value("slope")?,
            friction: self.friction.named_value("friction")?,
            rate_hz: self.rate.named_value("rate")?,
            is_guarded: self.is_guarded,
            ..self.read.clone()
        })
    }

    /// Draws which scene it is, and what leads the hand.
    pub fn ui(&mut self, ui: &mut Ui) -> Option<FileAction> {
        let mut action = None;
        section_ui(ui, "Scene");
        if text_row(ui, "file", "a scene file; leave empty for the built-in scene", &mut self.file)
        {
            action = Some(FileAction::Read);
        }
        ui.horizontal_wrapped(|ui| {
            if ui.button("Built in").clicked() {
                self.file.clear();
                action = Some(FileAction::Read);
            }
            if ui.button("Open").clicked() {
                action = Some(FileAction::Read);
            }
            if ui.button("Choose a scene...").clicked() {
                action = Some(FileAction::Dialog);
            }
        });
        quiet_ui(ui, &self.read.name);
        for note in &self.notes {
            quiet_ui(ui, note);
        }
        section_ui(ui, "Hand");
        ui.horizontal_wrapped(|ui| {
            for path in ScenePath::ALL {
                let choice = HandChoice::Path(path);
                ui.radio_value(&mut self.hand, choice, path.name()).named(path.name());
            }
            for (choice, name) in
                [(HandChoice::Pointer, "pointer and keys"), (HandChoice::Device, "haptic device")]
            {
                ui.radio_value(&mut self.hand, choice, name).named(name);
            }
        });
        if self.hand == HandChoice::Device {
            text_row(ui, "device", "inverse, inverse:NAME or hapi:PORT", &mut self.device);
            text_row(ui, "service", "ADDRESS:PORT of an Inverse's service", &mut self.service);
        }
        action
    }

    /// Draws what it is made of.
    pub fn parts_ui(&mut self, ui: &mut Ui) {
        section_ui(ui, "Tissue and mesh");
        match &self.read.mesh {
            None => {
                quantity_ui(ui, "side", "mm", &mut self.side);
                quantity_ui(ui, "nodes", "along a side", &mut self.nodes);
            }
            Some(mesh) => quiet_ui(ui, &mesh.file),
        }
        quantity_ui(ui, "slope", "steepest", &mut self.slope);
        quantity_ui(ui, "friction", "of the tissue", &mut self.friction);
        if self.read.mesh.is_none() {
            let [(least, _), (most, _)] = INERT;
            let words = format!("{least} and {most} have no effect: nodes move along z only");
            quiet_ui(ui, words);
        }
        let recovery = self.read.recovery_s.unwrap_or(self.read.body.tau_eps);
        let cut = match self.read.cut_mm > 0.0 {
            true => format!("; displacements of {} mm or less are ignored", self.read.cut_mm),
            false => String::new(),
        };
        quiet_ui(ui, format!("surface recovery with a time constant of {recovery:.3} s{cut}"));
        section_ui(ui, "Loop");
        quantity_ui(ui, "rate", "ticks a second", &mut self.rate);
        tick_box(ui, &mut self.is_guarded, "guards and controller");
        let device = &self.read.device;
        let words = format!(
            "simulated device: mass {:.0} g, workspace {:.0} x {:.0} x {:.0} mm, peak force {} N, continuous force {} N, stiffness {} N/mm, resolution {} mm, friction {} N",
            1e3 * device.mass_kg,
            device.workspace_mm[0],
            device.workspace_mm[1],
            device.workspace_mm[2],
            device.force_max_n,
            device.force_continuous_n,
            device.stiffness_max_n_per_mm,
            device.step_mm,
            device.friction_n
        );
        quiet_ui(ui, words);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unchanged_form_is_the_built_in_scene() {
        let mut form = SceneForm::default();
        form.check();
        let built_in = SceneFile::default().settings(1).unwrap();
        assert_eq!(form.settings().unwrap(), built_in);
    }

    #[test]
    fn every_field_reaches_the_scene_and_impossible_values_are_refused_by_name() {
        let mut form = SceneForm::default();
        for (field, text) in [
            (&mut form.side, "40"),
            (&mut form.nodes, "81"),
            (&mut form.slope, "0.5"),
            (&mut form.friction, "0"),
            (&mut form.rate, "2000"),
        ] {
            field.text = text.into();
        }
        form.is_guarded = false;
        form.check();
        let settings = form.settings().unwrap();
        let expected = SceneFile {
            side_mm: 40.0,
            nodes: Some(81),
            slope: 0.5,
            friction: 0.0,
            rate_hz: 2000.0,
            is_guarded: false,
            ..SceneFile::default()
        };
        assert_eq!(settings, expected.settings(1).unwrap());
        for (text, words) in [
            ("2", "nodes: must be from 3"),
            ("10.5", "nodes: must be a whole"),
            ("5000", "to 1601"),
        ] {
            form.nodes.text = text.into();
            form.check();
            let refused = form.settings().unwrap_err();
            assert!(refused.contains(words), "{refused}");
        }
    }
}
