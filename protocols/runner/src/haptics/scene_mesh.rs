//! The table `[mesh]` of a scene file whose tissue is a mesh of triangles from another file.

use super::scene_file::{format_body, plain, read_body};
use palpate_drivers::rig_file::fields::Fields;
use palpate_haptics::scene::StartPlace;
use palpate_haptics::triangles::files::{MeshFormat, MeshUnit};
use palpate_haptics::triangles::{DentSettings, LARGEST_MM, MOST_FACES, MOST_MATERIALS, Shading};
use palpate_model::viscoelastic::ModifiedKelvin;

/// Which mesh a scene has in place of a square of tissue, and of what it is.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneMesh {
    /// OBJ, STL, GLB or glTF; a relative path counts from the folder of the scene file.
    pub file: String,
    /// SHA-256 of its bytes; where it is given, no other file is taken.
    pub sha256: Option<String>,
    /// Of the numbers of OBJ and STL.
    pub unit: MeshUnit,
    /// The materials of its vertices as CSV; the colours of the mesh without it.
    pub materials: Option<String>,
    /// SHA-256 of the bytes of `materials`.
    pub materials_sha256: Option<String>,
    /// A force model for each material; the one of the scene without any.
    pub bodies: Vec<MaterialBody>,
    pub shading: Shading,
    /// Nothing sinks further than this from a contact, in mm along the surface.
    pub reach_mm: f64,
    pub start: StartPlace,
}

/// The force model of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialBody {
    /// A session, a table, a specimen of a population or [`THESIS`](super::scene_file::THESIS); or what `[bodies.NAME]` has numbers for.
    pub name: String,
    /// Its numbers; they are to be found by the name without them.
    pub body: Option<ModifiedKelvin>,
}

/// Keys that mean something only with a file.
const KEYS: [&str; 9] = [
    "mesh.sha256",
    "mesh.unit",
    "mesh.materials",
    "mesh.materials_sha256",
    "mesh.bodies",
    "mesh.shading",
    "mesh.reach_mm",
    "mesh.start_mm",
    "mesh.start_vertex",
];

/// Keys of a square of tissue.
const SQUARE: [&str; 5] =
    ["tissue.side_mm", "mesh.nodes", "mesh.auto", "mesh.cut_nodes", "mesh.cut_mm"];

/// Keys of the one force model of a scene.
const ONE_BODY: [&str; 2] = ["tissue.source", "tissue.tau_eps"];

/// Reads the mesh of a scene file, if it has one.
pub(super) fn read(fields: &mut Fields) -> Option<SceneMesh> {
    let is_given = fields.is_given("mesh.file");
    for key in KEYS.iter().filter(|_| !is_given) {
        if fields.is_given(key) {
            fields.mistake(key, "this key is of a mesh from a file; add the key mesh.file");
        }
    }
    let file = fields.text("mesh.file");
    let words = MeshUnit::ALL.map(|unit| (unit.name(), unit));
    let unit = fields.choice("mesh.unit", &words, Some(MeshUnit::default()));
    let words = Shading::ALL.map(|shading| (shading.name(), shading));
    let shading = fields.choice("mesh.shading", &words, Some(Shading::default()));
    let usual = DentSettings::default().reach_mm;
    let mesh = SceneMesh {
        sha256: read_hash(fields, "mesh.sha256"),
        unit: unit.unwrap_or_default(),
        materials: fields.text("mesh.materials"),
        materials_sha256: read_hash(fields, "mesh.materials_sha256"),
        bodies: read_bodies(fields),
        shading: shading.unwrap_or_default(),
        reach_mm: fields.number("mesh.reach_mm", 0.0, LARGEST_MM).unwrap_or(usual),
        start: read_start(fields),
        file: file?,
    };
    if MeshFormat::of_name(&mesh.file).is_none() {
        let formats = MeshFormat::ALL.map(|format| format!(".{format}")).join(", ");
        fields.mistake("mesh.file", &format!("give a file whose name ends with one of {formats}"));
    }
    refuse_others(fields, &mesh);
    Some(mesh)
}

/// Keys without effect beside those of a mesh.
fn refuse_others(fields: &mut Fields, mesh: &SceneMesh) {
    for key in SQUARE {
        if fields.is_given(key) {
            fields.mistake(key, "this key is of a square of tissue; remove it or mesh.file");
        }
    }
    for key in ONE_BODY {
        if !mesh.bodies.is_empty() && fields.is_given(key) {
            fields.mistake(key, "the force models are those of mesh.bodies; remove one of the two");
        }
    }
    if mesh.materials_sha256.is_some() && mesh.materials.is_none() {
        fields.mistake("mesh.materials_sha256", "add the key mesh.materials, or remove this one");
    }
}

fn read_hash(fields: &mut Fields, key: &str) -> Option<String> {
    let hash = fields.text(key)?;
    let is_hash = hash.len() == 64 && hash.bytes().all(|digit| digit.is_ascii_hexdigit());
    if !is_hash {
        fields.mistake(key, "give the 64 hexadecimal digits of a SHA-256");
    }
    Some(hash.to_ascii_lowercase())
}

fn read_start(fields: &mut Fields) -> StartPlace {
    // The frame of a file may have its origin far from the mesh.
    let near = fields.numbers("mesh.start_mm", -1e6, 1e6).map(StartPlace::Near);
    // Three vertices of each triangle at most.
    let most = 3 * MOST_FACES as u64 - 1;
    let vertex = fields.whole_number("mesh.start_vertex", 0, most);
    if near.is_some() && vertex.is_some() {
        fields.mistake("mesh.start_vertex", "give either start_mm or start_vertex, not both");
    }
    let vertex = vertex.map(|vertex| StartPlace::Vertex(vertex as usize));
    near.or(vertex).unwrap_or_default()
}

fn read_bodies(fields: &mut Fields) -> Vec<MaterialBody> {
    let names = fields.texts("mesh.bodies").unwrap_or_default();
    if names.len() > MOST_MATERIALS {
        fields.mistake("mesh.bodies", &format!("give {MOST_MATERIALS} force models at most"));
    }
    let read =
        |name: String| MaterialBody { body: read_body(fields, &format!("bodies.{name}")), name };
    names.into_iter().map(read).collect()
}

impl SceneMesh {
    /// The lines of the table, and the tables of bodies that have numbers.
    pub(super) fn lines(&self) -> Vec<String> {
        let text = |key: &str, value: &str| format!("{key} = \"{}\"", plain(value));
        let mut lines = vec!["\n[mesh]".to_owned(), text("file", &self.file)];
        lines.extend(self.sha256.iter().map(|hash| text("sha256", hash)));
        lines.push(text("unit", self.unit.name()));
        lines.extend(self.materials.iter().map(|file| text("materials", file)));
        lines.extend(self.materials_sha256.iter().map(|hash| text("materials_sha256", hash)));
        if !self.bodies.is_empty() {
            let names = self.bodies.iter().map(|one| format!("\"{}\"", plain(&one.name)));
            lines.push(format!("bodies = [{}]", names.collect::<Vec<_>>().join(", ")));
        }
        lines.push(text("shading", self.shading.name()));
        lines.push(format!("reach_mm = {:?}", self.reach_mm));
        match self.start {
            StartPlace::Middle => {}
            StartPlace::Near(place) => lines.push(format!("start_mm = {place:?}")),
            StartPlace::Vertex(vertex) => lines.push(format!("start_vertex = {vertex}")),
        }
        for (index, one) in self.bodies.iter().enumerate() {
            let is_first = self.bodies.iter().position(|other| other.name == one.name);
            if let Some(body) = one.body.filter(|_| is_first == Some(index)) {
                lines.push(format!("\n[bodies.\"{}\"]", plain(&one.name)));
                lines.push(format_body(&body));
            }
        }
        lines
    }
}
