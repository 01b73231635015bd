//! Writes the meshes to try: `cargo run -p palpate-haptics --example mesh_files -- [FOLDER]`
//!
//! `stomach`: closed and smooth, a curved tube with a fundus. `phantom`: an organ with a stiffer nodule, painted: red is
//! the first material, green the second. Each as OBJ in mm and as GLB. The same bytes every time.

#![expect(clippy::print_stdout, reason = "an example that says what it wrote")]

use palpate_haptics::triangles::TriangleMesh;
use palpate_haptics::triangles::files::{write_glb, write_obj};
use palpate_haptics::triangles::shapes::{phantom, stomach};
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    for (name, soup) in [("stomach", stomach()), ("phantom", phantom())] {
        std::fs::write(folder.join(format!("{name}.obj")), write_obj(&soup))?;
        std::fs::write(folder.join(format!("{name}.glb")), write_glb(&soup))?;
        let mesh = TriangleMesh::new(soup)?;
        let [low, high] = mesh.bounds();
        let size = [0, 1, 2].map(|axis| format!("{:.0}", high[axis] - low[axis])).join(" x ");
        println!(
            "{name}: {} triangles, {} open edges, {size} mm",
            mesh.faces().len(),
            mesh.open_edges()
        );
    }
    Ok(())
}
