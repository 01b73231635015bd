//! Scene files: which tissue, mesh, device, loop and tolerances a scene has, as TOML.

use super::scene_mesh::{self, SceneMesh};
use palpate_drivers::rig_file::fields::{Fields, Mistake, format_mistakes};
use palpate_haptics::Period;
use palpate_haptics::scene::{DeviceSettings, Scene, SceneSettings};
use palpate_haptics::surface::{Cut, SurfaceMethod};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::integrators::Scheme;
use std::fmt::Write;

/// Longest text of a scene file.
const BYTES_MAX: usize = 65_536;

/// The source of a body that needs no session.
pub const THESIS: &str = "thesis";

/// Nodes along a side that a scene may have: 1601 stand for the truth in comparisons.
const NODES: [u64; 2] = [3, 1601];

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Error of force in percent of the smallest change that a hand notices.
    pub force_percent: f64,
    /// Error of shape in mm.
    pub shape_mm: f64,
    /// Time of a tick's own work in microseconds.
    pub tick_us: f64,
}

impl Default for Tolerances {
    /// A fifth of what a hand notices, half a millimetre, half of a millisecond.
    fn default() -> Self {
        Self { force_percent: 20.0, shape_mm: 0.5, tick_us: 500.0 }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    pub name: String,
    /// The session or table whose fit is the body; without it, [`Self::body`] is.
    pub source: Option<String>,
    pub body: ModifiedKelvin,
    /// A mesh of triangles as the tissue; without it a square, which has the next number and those of nodes and cuts.
    pub mesh: Option<SceneMesh>,
    /// Length of a side in mm.
    pub side_mm: f64,
    /// MaxShear over the distance of nodes: the steepest slope of the tissue, the same on every mesh.
    pub slope: f64,
    /// Time constant of recovery in s; that of the body without it.
    pub recovery_s: Option<f64>,
    pub friction: f64,
    /// Nodes along a side; planned from the tolerances without it.
    pub nodes: Option<usize>,
    /// Most nodes from a contact to one that it moves; no end without it.
    pub cut_nodes: Option<u32>,
    /// Least movement in mm.
    pub cut_mm: f64,
    /// Ticks a second.
    pub rate_hz: f64,
    pub scheme: Scheme,
    /// Whether guards and passivity controller are at work.
    pub is_guarded: bool,
    pub device: DeviceSettings,
    pub tolerances: Tolerances,
}

impl Default for SceneFile {
    /// The scene that is there without a file.
    fn default() -> Self {
        let usual = SceneSettings::default();
        Self {
            name: "thesis body".to_owned(),
            source: None,
            body: usual.body,
            mesh: None,
            side_mm: usual.side_mm,
            slope: 1.0,
            recovery_s: None,
            friction: usual.friction,
            nodes: Some(usual.nodes),
            cut_nodes: None,
            cut_mm: 0.0,
            rate_hz: usual.period.hz(),
            scheme: usual.scheme,
            is_guarded: true,
            device: usual.device,
            tolerances: Tolerances::default(),
        }
    }
}

impl SceneFile {
    /// Reads the text of a scene file, which `file` is called.
    pub fn parse(file: &str, text: &str) -> Result<Self, String> {
        let one = |mistake: Mistake| format_mistakes(file, &[mistake]);
        if text.len() > BYTES_MAX {
            let message =
                format!("the file is too large for a scene file; keep it below {BYTES_MAX} bytes");
            return Err(one(Mistake { line: 0, message }));
        }
        let mut fields = Fields::read(text).map_err(one)?;
        let read = read(&mut fields);
        let mistakes = fields.finish();
        if mistakes.is_empty() { Ok(read) } else { Err(format_mistakes(file, &mistakes)) }
    }

    /// As a text that reads back to the same bits.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let mut put = |line: String| {
            text.push_str(&line);
            text.push('\n');
        };
        put(format!("name = \"{}\"", plain(&self.name)));
        put("\n[tissue]".to_owned());
        let has_bodies = self.mesh.as_ref().is_some_and(|mesh| !mesh.bodies.is_empty());
        match &self.source {
            _ if has_bodies => {}
            Some(source) => put(format!("source = \"{}\"", plain(source))),
            None => put(format_body(&self.body)),
        }
        if self.mesh.is_none() {
            put(format!("side_mm = {:?}", self.side_mm));
        }
        put(format!("slope = {:?}", self.slope));
        if let Some(recovery) = self.recovery_s {
            put(format!("recovery_s = {recovery:?}"));
        }
        put(format!("friction = {:?}", self.friction));
        let mesh = self.mesh.as_ref().map_or_else(|| self.square_lines(), SceneMesh::lines);
        mesh.into_iter().for_each(&mut put);
        put("\n[loop]".to_owned());
        put(format!("rate_hz = {:?}", self.rate_hz));
        let scheme = SCHEMES.iter().find(|(_, scheme)| *scheme == self.scheme);
        put(format!("integrator = \"{}\"", scheme.map_or("exact", |(word, _)| word)));
        put(format!("guards = {}", self.is_guarded));
        put("\n[device]".to_owned());
        for (name, value) in device_numbers(&mut self.device.clone()) {
            put(format!("{name} = {value:?}"));
        }
        put("\n[tolerances]".to_owned());
        let Tolerances { force_percent, shape_mm, tick_us } = self.tolerances;
        put(format!("force_percent = {force_percent:?}"));
        put(format!("shape_mm = {shape_mm:?}"));
        put(format!("tick_us = {tick_us:?}"));
        text
    }

    /// The table `[mesh]` of a square of tissue.
    fn square_lines(&self) -> Vec<String> {
        let mut lines = vec!["\n[mesh]".to_owned()];
        lines.push(match self.nodes {
            Some(nodes) => format!("nodes = {nodes}"),
            None => "auto = true".to_owned(),
        });
        lines.extend(self.cut_nodes.map(|range| format!("cut_nodes = {range}")));
        lines.push(format!("cut_mm = {:?}", self.cut_mm));
        lines
    }

    /// The force model that stands for all: the first of a mesh that has several.
    pub fn first_body(&self) -> ModifiedKelvin {
        let first = self.mesh.as_ref().and_then(|mesh| mesh.bodies.first());
        first.and_then(|one| one.body).unwrap_or(self.body)
    }

    /// What a scene of it is made of, with so many nodes along a side where the file leaves them to be planned.
    pub fn settings(&self, planned_nodes: usize) -> Result<SceneSettings, String> {
        let nodes = self.nodes.unwrap_or(planned_nodes);
        let words = |err: &dyn std::error::Error| format!("the scene '{}': {err}", self.name);
        let spacing = self.side_mm / nodes.saturating_sub(1) as f64;
        let mut settings = SceneSettings {
            body: self.first_body(),
            side_mm: self.side_mm,
            nodes,
            max_shear_mm: self.slope * spacing,
            recovery_s: self.recovery_s.unwrap_or(self.first_body().tau_eps),
            friction: self.friction,
            period: Period::of_rate(self.rate_hz).map_err(|err| words(&err))?,
            scheme: self.scheme,
            method: SurfaceMethod::Envelope,
            cut: Cut::new(self.cut_nodes, self.cut_mm).map_err(|err| words(&err))?,
            ..SceneSettings::default()
        }
        .with_device(self.device);
        if !self.is_guarded {
            settings = settings.unguarded();
        }
        Ok(settings)
    }

    pub fn scene(&self, planned_nodes: usize) -> Result<Scene, String> {
        let settings = self.settings(planned_nodes)?;
        Scene::new(settings).map_err(|err| format!("the scene '{}': {err}", self.name))
    }
}

/// Integrators in the file's words.
const SCHEMES: [(&str, Scheme); 7] = [
    ("explicit-euler", Scheme::ExplicitEuler),
    ("implicit-euler", Scheme::ImplicitEuler),
    ("trapezoid", Scheme::Trapezoid),
    ("exponential-left", Scheme::ExponentialLeft),
    ("exponential-first-order", Scheme::ExponentialFirstOrder),
    ("exact", Scheme::Exact),
    ("runge-kutta", Scheme::RungeKutta),
];

/// Parameters of a body in the file's words.
const BODY: [&str; 5] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"];

/// The parameters of a body as lines that read back to the same bits.
#[must_use]
pub fn format_body(body: &ModifiedKelvin) -> String {
    let line = |(name, value): (&str, f64)| format!("{name} = {value:?}");
    let lines: Vec<String> = body.named().into_iter().map(line).collect();
    lines.join("\n")
}

/// A body that stands in a table of a file, if any of its parameters does; all of them must.
pub fn read_body(fields: &mut Fields, table: &str) -> Option<ModifiedKelvin> {
    let values = BODY.map(|name| fields.number(&format!("{table}.{name}"), -1e6, 1e6));
    let given = values.iter().position(Option::is_some)?;
    let [Some(tau_eps), Some(mu1), Some(mu2), Some(mu3), Some(tau_sig)] = values else {
        let key = format!("{table}.{}", BODY[given]);
        fields.mistake(&key, "give all of tau_eps, mu1, mu2, mu3 and tau_sig");
        return None;
    };
    let body = ModifiedKelvin { tau_eps, mu: [mu1, mu2, mu3], tau_sig };
    if let Err(err) = body.checked() {
        fields.mistake(&format!("{table}.tau_eps"), &err.to_string());
    }
    Some(body)
}

fn device_numbers(device: &mut DeviceSettings) -> [(&'static str, &mut f64); 15] {
    let [wide, deep, high] = &mut device.workspace_mm;
    [
        ("mass_kg", &mut device.mass_kg),
        ("damping_n_s_per_mm", &mut device.damping_n_s_per_mm),
        ("friction_n", &mut device.friction_n),
        ("step_mm", &mut device.step_mm),
        ("turn_step_rad", &mut device.turn_step_rad),
        ("force_max_n", &mut device.force_max_n),
        ("force_continuous_n", &mut device.force_continuous_n),
        ("stiffness_max_n_per_mm", &mut device.stiffness_max_n_per_mm),
        ("reach_x_mm", wide),
        ("reach_y_mm", deep),
        ("reach_z_mm", high),
        ("hand_mass_kg", &mut device.hand_mass_kg),
        ("hand_stiffness_n_per_mm", &mut device.hand_stiffness_n_per_mm),
        ("hand_damping_n_s_per_mm", &mut device.hand_damping_n_s_per_mm),
        ("hand_speed_max_mm_per_s", &mut device.hand_speed_max_mm_per_s),
    ]
}

fn read(fields: &mut Fields) -> SceneFile {
    let mut file = SceneFile::default();
    let most = 1e6;
    file.name = fields.text("name").unwrap_or(file.name);
    let source = fields.text("tissue.source");
    let body = read_body(fields, "tissue");
    if source.is_some() && body.is_some() {
        fields
            .mistake("tissue.source", "give either a source or the parameters of a body, not both");
    }
    file.body = body.unwrap_or(file.body);
    file.source = source.filter(|source| source != THESIS);
    file.mesh = scene_mesh::read(fields);
    // A spacing from a nanometre to a metre, so that every mesh is possible.
    set(&mut file.side_mm, fields.number("tissue.side_mm", 1.0, 1000.0));
    set(&mut file.slope, fields.number("tissue.slope", 0.0, 1000.0));
    file.recovery_s = fields.number("tissue.recovery_s", 0.0, most);
    set(&mut file.friction, fields.number("tissue.friction", 0.0, 10.0));
    let nodes = fields.whole_number("mesh.nodes", NODES[0], NODES[1]);
    match (fields.flag("mesh.auto"), nodes) {
        (Some(true), Some(_)) => {
            fields.mistake(
                "mesh.auto",
                "a mesh has either nodes or auto, not both; remove one of the two keys",
            );
        }
        (Some(true), None) => file.nodes = None,
        (_, Some(nodes)) => file.nodes = Some(nodes as usize),
        (_, None) => {}
    }
    file.cut_nodes =
        fields.whole_number("mesh.cut_nodes", 1, NODES[1] * 2).map(|range| range as u32);
    set(&mut file.cut_mm, fields.number("mesh.cut_mm", 0.0, 1000.0));
    let [slowest, fastest] = Period::RATES_HZ;
    set(&mut file.rate_hz, fields.number("loop.rate_hz", slowest, fastest));
    let scheme = fields.choice("loop.integrator", &SCHEMES, Some(file.scheme));
    file.scheme = scheme.unwrap_or(file.scheme);
    file.is_guarded = fields.flag("loop.guards").unwrap_or(file.is_guarded);
    for (name, value) in device_numbers(&mut file.device) {
        set(value, fields.number(&format!("device.{name}"), 0.0, most));
    }
    if let Err(err) = file.device.checked() {
        fields.mistake("device", &err.to_string());
    }
    let Tolerances { force_percent, shape_mm, tick_us } = &mut file.tolerances;
    let tolerances =
        [("force_percent", force_percent), ("shape_mm", shape_mm), ("tick_us", tick_us)];
    for (name, value) in tolerances {
        // A tolerance of zero could never be met.
        set(value, fields.number(&format!("tolerances.{name}"), 1e-6, most));
    }
    file
}

fn set(value: &mut f64, given: Option<f64>) {
    *value = given.unwrap_or(*value);
}

pub(super) fn plain(text: &str) -> String {
    let mut out = String::new();
    for letter in text.chars() {
        match letter {
            '"' | '\\' => {
                out.push('\\');
                out.push(letter);
            }
            letter if letter.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(letter));
            }
            letter => out.push(letter),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::scene_mesh::MaterialBody;
    use super::*;
    use palpate_haptics::scene::StartPlace;
    use palpate_haptics::triangles::Shading;
    use palpate_haptics::triangles::files::MeshUnit;

    #[test]
    fn scene_file_reads_back_to_the_same_bits() {
        let usual = SceneFile::default();
        let odd = SceneFile {
            name: "a \"quoted\"\\ name\tand ü".to_owned(),
            body: ModifiedKelvin { tau_eps: 1.0 / 3.0, mu: [1e-7, -0.1, 1e-300], tau_sig: 0.7 },
            side_mm: 59.999_999_999_999_99,
            recovery_s: Some(0.1 + 0.2),
            nodes: None,
            cut_nodes: Some(17),
            cut_mm: 1e-3,
            rate_hz: 3000.0,
            scheme: Scheme::Trapezoid,
            is_guarded: false,
            device: DeviceSettings { mass_kg: 1.0 / 7.0, ..DeviceSettings::default() },
            ..usual.clone()
        };
        let bodies = ["C:\\a.b \"c\"", "thesis", "thesis"].map(|name| MaterialBody {
            name: name.to_owned(),
            body: (name == "thesis").then_some(ModifiedKelvin::THESIS),
        });
        let mesh = SceneMesh {
            file: "C:\\organs\\stomach.GLB".to_owned(),
            sha256: Some("0f".repeat(32)),
            unit: MeshUnit::Centimetre,
            materials: Some("a.csv".to_owned()),
            materials_sha256: Some("a0".repeat(32)),
            bodies: bodies.to_vec(),
            shading: Shading::Flat,
            reach_mm: 1.0 / 3.0,
            start: StartPlace::Near([0.1 + 0.2, -1e-7, 3.0]),
        };
        let plainest = SceneMesh {
            start: StartPlace::Vertex(17),
            sha256: None,
            materials: None,
            materials_sha256: None,
            bodies: Vec::new(),
            ..mesh.clone()
        };
        let [organ, plain_organ] =
            [mesh, plainest].map(|one| SceneFile { mesh: Some(one), ..usual.clone() });
        let fitted = SceneFile { source: Some("C:\\data\\liver".to_owned()), ..usual.clone() };
        for file in [usual, odd, organ, plain_organ, fitted] {
            let again = SceneFile::parse("a.toml", &file.text());
            assert_eq!(again.as_ref(), Ok(&file), "{}", file.text());
        }
    }

    #[test]
    fn default_scene_file_gives_the_default_scene() {
        let settings = SceneFile::default().settings(51).unwrap();
        assert_eq!(settings, SceneSettings::default());
        assert_eq!(SceneFile::parse("empty.toml", ""), Ok(SceneFile::default()));
        let planned = SceneFile::parse("a.toml", "[mesh]\nauto = true").unwrap();
        assert_eq!(planned.settings(51).unwrap().nodes, 51);
        let source = SceneFile::parse("a.toml", "[tissue]\nsource = \"thesis\"").unwrap();
        assert_eq!(source, SceneFile::default());
    }

    #[test]
    fn mistakes_are_reported_with_their_lines() {
        for (text, expected) in [
            ("[tissue]\nside_mm = -3", "scene.toml, line 2: tissue.side_mm: "),
            ("[tissue]\n\nsid_mm = 3", "scene.toml, line 3: 'tissue.sid_mm'"),
            ("[tissue]\ntau_eps = 1.0", "line 2: tissue.tau_eps: "),
            (
                "[tissue]\nsource = \"thesis\"\ntau_eps = 1\nmu1 = 1\nmu2 = 1\nmu3 = 1\ntau_sig = 1",
                "line 2: tissue.source: ",
            ),
            ("[mesh]\nnodes = 10.5", "line 2: mesh.nodes: "),
            ("[mesh]\nnodes = 51\nauto = true", "line 3: mesh.auto"),
            ("[mesh]\nunit = \"mm\"", "line 2: mesh.unit: "),
            ("[mesh]\nfile = \"a.ply\"", "line 2: mesh.file: "),
            ("[mesh]\nfile = \"a.stl\"\nnodes = 5", "line 3: mesh.nodes: "),
            ("[mesh]\nfile = \"a.stl\"\nsha256 = \"12\"", "line 3: mesh.sha256: "),
            ("[mesh]\nfile = \"a.stl\"\nunit = \"inch\"", "line 3: mesh.unit: give \"mm\""),
            ("[mesh]\nstart_vertex = 1", "line 2: mesh.start_vertex: "),
            (
                "[mesh]\nfile = \"a.stl\"\nstart_mm = [1, 2]",
                "line 3: mesh.start_mm: give 3 numbers",
            ),
            (
                "[mesh]\nfile = \"a.stl\"\nstart_vertex = -1",
                "line 3: mesh.start_vertex: give a whole",
            ),
            (
                "[mesh]\nfile = \"a.stl\"\nstart_mm = [1, 2, 3.5]\nstart_vertex = 4",
                "line 4: mesh.start_vertex: give either",
            ),
            ("[mesh]\nfile = \"a.stl\"\n[bodies.pad]\nmu1 = 1", "line 4: 'bodies.pad.mu1'"),
            (
                "[tissue]\nsource = \"b\"\n[mesh]\nfile = \"a.stl\"\nbodies = [\"thesis\"]",
                "line 2: tissue.source: ",
            ),
            ("[loop]\nrate_hz = 20", "line 2: loop.rate_hz: "),
            ("[loop]\nintegrator = \"magic\"", "line 2: loop.integrator: give \""),
            ("[device]\nmass_kg = 0", "mass_kg = 0"),
            ("[tolerances]\nshape_mm = \"fine\"", "line 2: tolerances.shape_mm"),
            ("side = ", "scene.toml, line 1: "),
        ] {
            let message = SceneFile::parse("scene.toml", text).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
