//! The mesh of a scene: its files found, hashed and read, and its force models fitted.

use super::haptics::fit_haptic_body;
use super::population::is_member;
use palpate_haptics::scene::{MeshScene, MeshSceneSettings};
use palpate_haptics::surface::SurfaceRecovery;
use palpate_haptics::triangles::files::{MeshFormat, read_mesh};
use palpate_haptics::triangles::{DentSettings, MaterialMap, TriangleMesh, TriangleSoup};
use palpate_model::units::Seconds;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_runner::haptics::scene_file::{SceneFile, THESIS};
use palpate_runner::haptics::scene_mesh::SceneMesh;
use palpate_sessions::text::sha256;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Longest mesh file: glTF with a million triangles and all that a program may add to them.
const BYTES_MAX: u64 = 1_000_000_000;

/// The mesh of a scene that ran.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MeshReport {
    pub file: String,
    /// SHA-256 of the file's bytes.
    pub sha256: String,
    pub triangles: usize,
    /// Vertices, each place once.
    pub vertices: usize,
    pub materials: usize,
}

/// Where a scene stands that names its files and its bodies.
pub(super) fn source_path(folder: &Path, name: &str) -> PathBuf {
    if is_member(name) || name == THESIS { name.into() } else { folder.join(name) }
}

/// Names the files from anywhere, with their hashes, and finds the numbers of all bodies; returns what is to be known of their fits.
pub(super) fn resolve_mesh(mesh: &mut SceneMesh, folder: &Path) -> Result<Vec<String>, String> {
    let (file, _) = open(&mut mesh.file, mesh.sha256.as_deref(), folder, None)?;
    mesh.sha256 = Some(file);
    if let Some(materials) = &mut mesh.materials {
        let (hash, _) = open(materials, mesh.materials_sha256.as_deref(), folder, None)?;
        mesh.materials_sha256 = Some(hash);
    }
    let mut notes = Vec::new();
    for one in mesh.bodies.iter_mut().filter(|one| one.body.is_none()) {
        let found = fit_haptic_body(&source_path(folder, &one.name))?;
        one.body = Some(found.body);
        notes.extend(found.notes.into_iter().map(|note| format!("{}: {note}", one.name)));
    }
    Ok(notes)
}

/// The mesh and its materials read, with all that a scene needs. Files that are gone are looked for in `beside`, the folder of a
/// recording.
pub(super) fn read_mesh_scene(
    file: &SceneFile,
    mesh: &SceneMesh,
    beside: Option<&Path>,
) -> Result<(MeshScene, MeshReport), String> {
    let read = ReadMesh::read(file, mesh, beside)?;
    let report = MeshReport {
        file: mesh.file.clone(),
        sha256: mesh.sha256.clone().unwrap_or_default(),
        triangles: read.mesh.faces().len(),
        vertices: read.mesh.points().len(),
        materials: read.materials.materials(),
    };
    Ok((read.scene(file)?, report))
}

/// A mesh with its materials and their force models, from the files that a scene names.
#[derive(Clone, Debug)]
pub struct ReadMesh {
    pub mesh: Arc<TriangleMesh>,
    pub materials: MaterialMap,
    /// Of each material.
    pub bodies: Vec<ModifiedKelvin>,
}

impl ReadMesh {
    /// The mesh of a scene; `None` where its tissue is a square.
    pub fn of(file: &SceneFile) -> Result<Option<Self>, String> {
        file.mesh.as_ref().map(|mesh| Self::read(file, mesh, None)).transpose()
    }

    fn read(file: &SceneFile, mesh: &SceneMesh, beside: Option<&Path>) -> Result<Self, String> {
        let here = Path::new("");
        let mut name = mesh.file.clone();
        let (_, bytes) = open(&mut name, mesh.sha256.as_deref(), here, beside)?;
        let format = MeshFormat::of_name(&name)
            .ok_or_else(|| format!("{name} is no mesh file; give OBJ, STL, GLB or glTF"))?;
        let refused = |err: &dyn std::fmt::Display| format!("{name}: {err}");
        let soup = read_mesh(format, &bytes, mesh.unit).map_err(|err| refused(&err))?;
        let colours = soup.colours.clone();
        let triangles = TriangleMesh::new(TriangleSoup { colours: Vec::new(), ..soup })
            .map_err(|err| refused(&err))?;
        let bodies: Vec<_> = match mesh.bodies.len() {
            0 => vec![file.body],
            _ => mesh.bodies.iter().filter_map(|one| one.body).collect(),
        };
        let materials = read_materials(mesh, &triangles, (&colours, bodies.len()), beside)?;
        Ok(Self { mesh: Arc::new(triangles), materials, bodies })
    }

    /// A scene on it, at rest.
    pub fn scene(&self, file: &SceneFile) -> Result<MeshScene, String> {
        let mesh = file.mesh.as_ref().ok_or_else(|| {
            format!("the scene '{}' has no mesh; report this bug in palpate", file.name)
        })?;
        let scene = file.settings(palpate_haptics::scene::SceneSettings::default().nodes)?;
        let recovery = SurfaceRecovery::new(Seconds(scene.recovery_s), scene.period.seconds())
            .map_err(|err| format!("the scene '{}': {err}", file.name))?;
        let settings = MeshSceneSettings {
            mesh: Arc::clone(&self.mesh),
            materials: self.materials.clone(),
            bodies: self.bodies.clone(),
            shading: mesh.shading,
            dent: DentSettings { slope: file.slope, reach_mm: mesh.reach_mm, recovery },
            start: mesh.start,
            scene,
        };
        MeshScene::new(&settings).map_err(|err| format!("the scene '{}': {err}", file.name))
    }
}

/// By the table of materials, else by the colours, else all of one material.
fn read_materials(
    mesh: &SceneMesh,
    triangles: &TriangleMesh,
    (colours, bodies): (&[[f64; 3]], usize),
    beside: Option<&Path>,
) -> Result<MaterialMap, String> {
    if let Some(table) = &mesh.materials {
        let mut name = table.clone();
        let hash = mesh.materials_sha256.as_deref();
        let (_, bytes) = open(&mut name, hash, Path::new(""), beside)?;
        let text = String::from_utf8(bytes)
            .map_err(|_| format!("{name} is not UTF-8 text; save the map of materials as CSV"))?;
        let map = MaterialMap::from_csv(triangles, &text, bodies);
        return map.map_err(|err| format!("{name}: {err}"));
    }
    match (bodies, colours) {
        (1, _) => Ok(MaterialMap::one(triangles)),
        (_, []) => Err(format!(
            "{} has no colours, so which of its {bodies} materials is where is unknown; colour its vertices, or add the key mesh.materials",
            mesh.file
        )),
        _ => MaterialMap::from_colours(triangles, colours, bodies)
            .map_err(|err| format!("{}: {err}", mesh.file)),
    }
}

/// Bytes of a file and their SHA-256, which is the one `expected` if there is one; `name` becomes its path from anywhere.
fn open(
    name: &mut String,
    expected: Option<&str>,
    folder: &Path,
    beside: Option<&Path>,
) -> Result<(String, Vec<u8>), String> {
    let unreadable = |err: std::io::Error| format!("cannot read {name} ({err}); correct the path");
    let mut path = std::path::absolute(folder.join(&*name)).map_err(unreadable)?;
    if let Some(found) = beside.and_then(|beside| in_folder(beside, &path)) {
        path = found;
    }
    let size = std::fs::metadata(&path).map_err(unreadable)?.len();
    if size > BYTES_MAX {
        return Err(format!("{name} is larger than 1 GB; decimate the mesh"));
    }
    let bytes = std::fs::read(&path).map_err(unreadable)?;
    let hash = sha256(&bytes);
    if let Some(expected) = expected.filter(|expected| *expected != hash) {
        return Err(format!(
            "{} is another file than the scene was made with (SHA-256 {hash} instead of {expected}); restore that file",
            path.display()
        ));
    }
    let text = path.to_str().map(str::to_owned);
    *name = text.ok_or_else(|| {
        format!("the path {} is not UTF-8 text; rename the folder", path.display())
    })?;
    Ok((hash, bytes))
}

/// The file of the same name in a folder, where the path itself has none.
fn in_folder(folder: &Path, path: &Path) -> Option<PathBuf> {
    // A recording of another system may have the other separator.
    let name = path.to_str()?.rsplit(['/', '\\']).next()?;
    let there = folder.join(name);
    (!path.exists() && there.is_file()).then_some(there)
}

#[cfg(test)]
mod tests {
    use crate::scene::{SceneHand, check_scene, play_scene, read_scene, replay};
    use palpate_haptics::scene::ScenePath;
    use palpate_haptics::triangles::files::{write_glb, write_stl};
    use palpate_haptics::triangles::shapes::{ball, phantom};
    use palpate_model::viscoelastic::ModifiedKelvin;
    use std::path::Path;

    const PAINTED: &str = "name = \"painted\"\n[mesh]\nfile = \"organs/phantom.glb\"\n\
        bodies = [\"thesis\", \"nodule\"]\nreach_mm = 12.0\n\
        [bodies.nodule]\ntau_eps = 0.5\nmu1 = 0.4\nmu2 = 0.0\nmu3 = 0.0\ntau_sig = 0.1\n";

    fn put(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> std::path::PathBuf {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        path
    }

    fn read_text(path: &Path) -> String {
        std::fs::read_to_string(path).unwrap()
    }

    #[test]
    fn a_scene_names_its_mesh_from_anywhere_with_its_hash_and_its_bodies_with_their_numbers() {
        let at = tempfile::tempdir().unwrap();
        let mesh = put(at.path(), "organs/phantom.glb", write_glb(&phantom()));
        let path = put(at.path(), "painted.toml", PAINTED);
        let (scene, notes) = read_scene(Some(&path)).unwrap();
        assert!(notes.is_empty(), "{notes:?}");
        let read = scene.mesh.as_ref().unwrap();
        assert_eq!(Path::new(&read.file), std::path::absolute(&mesh).unwrap());
        let hash = palpate_sessions::text::sha256_of_file(&mesh).unwrap();
        assert_eq!(read.sha256.as_ref(), Some(&hash));
        assert_eq!(read.bodies[0].body, Some(ModifiedKelvin::THESIS));
        assert_eq!(read.bodies[1].body.unwrap().mu[0], 0.4);
        assert_eq!(scene.first_body(), ModifiedKelvin::THESIS);
        check_scene(&scene).unwrap();
        // What is shown reads back to the same.
        let shown = put(at.path(), "elsewhere/shown.toml", scene.text());
        assert_eq!(read_scene(Some(&shown)).unwrap().0, scene);
    }

    #[test]
    fn a_recording_of_a_mesh_names_its_file_and_refuses_another() {
        let at = tempfile::tempdir().unwrap();
        let mesh = put(at.path(), "organs/phantom.glb", write_glb(&phantom()));
        let path = put(at.path(), "painted.toml", PAINTED);
        let (scene, _) = read_scene(Some(&path)).unwrap();
        let folder = at.path().join("poke");
        let hand = SceneHand::Simulated(ScenePath::Poke, 1);
        let played = play_scene(&scene, hand, Some(&folder), &mut |_| {}).unwrap();
        assert!(played.depth_max_mm > 4.0, "{played:?}");
        let report = played.mesh.unwrap();
        assert_eq!((report.triangles, report.materials), (20_480, 2));
        let again = || replay(&folder, &mut |_| true);
        let replayed = again().unwrap();
        assert!(replayed.is_identical && replayed.is_whole, "{replayed:?}");
        assert_eq!(replayed.end_hash, played.surface_hash);
        let settings = read_text(&folder.join("settings.toml"));
        assert!(settings.contains(&report.sha256), "{settings}");
        // Another file is refused; the right one is found beside the ticks where the folder of the mesh is gone.
        std::fs::write(&mesh, write_glb(&ball(30.0, 3))).unwrap();
        let refused = again().unwrap_err();
        assert!(refused.contains("phantom.glb is another file"), "{refused}");
        std::fs::remove_file(&mesh).unwrap();
        assert!(again().unwrap_err().contains("cannot read"));
        std::fs::write(folder.join("phantom.glb"), write_glb(&phantom())).unwrap();
        assert!(again().unwrap().is_identical);
    }

    #[test]
    fn meshes_that_are_none_are_refused_with_the_name_of_the_file() {
        let at = tempfile::tempdir().unwrap();
        let colourless = write_stl(&ball(30.0, 2));
        put(at.path(), "ball.stl", &colourless);
        put(at.path(), "cut.stl", &colourless[..colourless.len() / 2]);
        put(at.path(), "map.csv", "vertex,material\n3,1\n");
        put(at.path(), "wrong.csv", "3;one\n");
        let bodies = "bodies = [\"thesis\", \"thesis\"]";
        for (lines, expected) in [
            ("file = \"none.stl\"".to_owned(), "cannot read none.stl"),
            ("file = \"cut.stl\"".to_owned(), "cut.stl: "),
            (format!("file = \"ball.stl\"\n{bodies}"), "ball.stl has no colours"),
            (
                format!("file = \"ball.stl\"\n{bodies}\nmaterials = \"wrong.csv\""),
                "wrong.csv: line 1",
            ),
            ("file = \"ball.stl\"\nmaterials = \"map.csv\"".to_owned(), "map.csv: vertex 3"),
            ("file = \"ball.stl\"\nbodies = [\"gone\"]".to_owned(), "gone"),
            (format!("file = \"ball.stl\"\nsha256 = \"{}\"", "0".repeat(64)), "another file"),
        ] {
            let path = put(at.path(), "scene.toml", format!("[mesh]\n{lines}\n"));
            let read = read_scene(Some(&path));
            let refused = read.and_then(|(scene, _)| check_scene(&scene)).unwrap_err();
            assert!(refused.contains(expected), "{lines}: {refused}");
        }
        let path = put(
            at.path(),
            "scene.toml",
            format!("[mesh]\nfile = \"ball.stl\"\n{bodies}\nmaterials = \"map.csv\"\n"),
        );
        check_scene(&read_scene(Some(&path)).unwrap().0).unwrap();
    }
}
