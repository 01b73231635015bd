//! OBJ, STL and glTF.

use super::mesh_support::{apart, mesh};
use palpate_haptics::triangles::TriangleSoup;
use palpate_haptics::triangles::files::{
    MeshFileError, MeshFormat, MeshUnit, read_gltf, read_mesh, read_obj, read_stl, write_glb,
    write_obj, write_stl,
};
use palpate_haptics::triangles::shapes::{ball, cuboid, phantom, stomach};
use palpate_model::random::SplitMix;
use palpate_test_support::assert_messages;

#[test]
fn obj_has_polygons_counts_from_one_or_back_and_goes_on_in_the_next_line() {
    let text = "# a square and a triangle\nmtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 \\\n3//1 4\nf -4 -3 -2 # again\n";
    let soup = read_obj(text.as_bytes(), MeshUnit::Centimetre).unwrap();
    assert_eq!(soup.points[2], [10.0, 10.0, 0.0]);
    assert_eq!(soup.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert!(soup.colours.is_empty());
    let coloured = read_obj(b"v 0 0 0 1 0 0.5\nv 1 0 0 0 1 0\n", MeshUnit::Metre).unwrap();
    assert_eq!((coloured.colours[0], coloured.points[1]), ([1.0, 0.0, 0.5], [1000.0, 0.0, 0.0]));
}

#[test]
fn obj_that_is_none_is_refused_with_its_line() {
    let refused = |text: &str| read_obj(text.as_bytes(), MeshUnit::Millimetre).unwrap_err();
    assert!(matches!(refused("v 0 0\n"), MeshFileError::ObjLine { line: 1, what: "vertex", .. }));
    assert!(matches!(refused("\nv 0 x 0\n"), MeshFileError::ObjLine { line: 2, .. }));
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    for (face, index) in [("f 1 2 4", 4), ("f 0 1 2", 0), ("f 1 2 -4", -4)] {
        let refusal = refused(&format!("{square}{face}\n"));
        assert_eq!(refusal, MeshFileError::ObjIndex { line: 4, index, vertices: 3 });
    }
    assert!(matches!(
        refused(&format!("{square}f 1 2\n")),
        MeshFileError::ObjLine { what: "face", .. }
    ));
    assert!(matches!(
        refused(&format!("{square}f 1 2 a\n")),
        MeshFileError::ObjLine { what: "face", .. }
    ));
    assert_eq!(refused("v 0 0 0 1 1 1\nv 0 0 0\n"), MeshFileError::ObjColours);
}

#[test]
fn stl_in_text_and_binary_are_the_same_mesh() {
    let whole = cuboid([3.0, 2.0, 1.0]);
    let binary = write_stl(&whole);
    let mut text = String::from("solid box\n");
    for face in &whole.faces {
        text += "facet normal 0 0 0\n outer loop\n";
        for [x, y, z] in face.map(|vertex| whole.points[vertex as usize]) {
            text += &format!("  vertex {x:e} {y} {z}\n");
        }
        text += " endloop\nendfacet\n";
    }
    text += "endsolid\n";
    let [one, other] =
        [&binary[..], text.as_bytes()].map(|bytes| read_stl(bytes, MeshUnit::Millimetre).unwrap());
    assert_eq!(one, other);
    assert_eq!(mesh(one.clone()).points().len(), 8);
    // Some programs begin binary files with the word of ASCII files.
    let mut named = binary.clone();
    named[..5].copy_from_slice(b"solid");
    assert_eq!(read_stl(&named, MeshUnit::Millimetre).unwrap(), one);
    let short = read_stl(&binary[..300], MeshUnit::Millimetre).unwrap_err();
    assert_eq!(short, MeshFileError::StlShort { bytes: 300, faces: 12, needed: 684 });
    let refused = |text: &str| read_stl(text.as_bytes(), MeshUnit::Millimetre).unwrap_err();
    assert!(matches!(refused("solid\nvertex 1 2\n"), MeshFileError::StlLine { line: 2, .. }));
    assert_eq!(refused("solid\nvertex 1 2 3\n"), MeshFileError::StlCorners(1));
    let mut endless = vec![0; 84];
    endless[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(matches!(
        read_stl(&endless, MeshUnit::Millimetre),
        Err(MeshFileError::TooManyFaces { .. })
    ));
}

/// Single precision of metres is at most 2^-24 of 0.3 m: 2e-5 mm.
#[test]
fn what_is_written_is_read_again() {
    for soup in [phantom(), stomach(), ball(20.0, 2)] {
        assert_eq!(read_obj(write_obj(&soup).as_bytes(), MeshUnit::Millimetre).unwrap(), soup);
        let read = read_gltf(&write_glb(&soup)).unwrap();
        assert_eq!(read.faces, soup.faces);
        assert!(
            read.points.iter().zip(&soup.points).all(|(one, other)| apart(*one, *other) < 2e-5)
        );
        assert!(
            read.colours.iter().zip(&soup.colours).all(|(one, other)| apart(*one, *other) < 2e-7)
        );
        assert_eq!(read.colours.len(), soup.colours.len());
    }
}

/// A node within a node, a mirror, a strip, a fan and 16-bit numbers that are shares.
#[test]
fn gltf_nodes_strips_and_short_numbers_are_read() {
    let json = |primitive: &str, nodes: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"primitives":[{primitive}]}}],
            "accessors":[{{"bufferView":0,"componentType":5122,"normalized":true,"count":4,"type":"VEC3"}}],
            "bufferViews":[{{"buffer":0,"byteLength":32,"byteStride":8}}],
            "buffers":[{{"byteLength":32,"uri":"data:application/octet-stream;base64,AAAAAAAAAAD/fwAAAAAAAAAA/38AAAAA/3//fwAAAAA="}}]}}"#
        )
    };
    let nodes = r#"{"children":[1],"translation":[1,0,0]},{"mesh":0,"scale":[2,1,1],"rotation":[0,0,0.7071067811865476,0.7071067811865476]}"#;
    let strip = json(r#"{"attributes":{"POSITION":0},"mode":5}"#, nodes);
    let soup = read_gltf(strip.as_bytes()).unwrap();
    assert_eq!(soup.faces, [[0, 1, 2], [1, 3, 2]]);
    // Twice as long along x, a quarter turn to y, a metre to the right.
    for (point, expected) in
        soup.points.iter().zip([[1000.0, 0.0], [1000.0, 2000.0], [0.0, 0.0], [0.0, 2000.0]])
    {
        assert!(apart(*point, [expected[0], expected[1], 0.0]) < 1e-9, "{point:?}");
    }
    let mirror = json(
        r#"{"attributes":{"POSITION":0},"mode":6}"#,
        r#"{"mesh":0,"matrix":[-1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}"#,
    );
    let soup = read_gltf(mirror.as_bytes()).unwrap();
    assert_eq!(soup.faces, [[1, 0, 2], [2, 0, 3]]);
    assert_eq!(soup.points[1], [-1000.0, 0.0, 0.0]);
    let circle = json(r#"{"attributes":{"POSITION":0}}"#, r#"{"children":[1]},{"children":[0]}"#);
    assert!(
        read_gltf(
            circle.replace(r#""nodes":["#, r#""scenes":[{"nodes":[0]}],"nodes":["#).as_bytes()
        )
        .is_err()
    );
}

#[test]
fn gltf_that_cannot_be_read_is_refused() {
    let refused = |text: &str| read_gltf(text.as_bytes()).unwrap_err();
    assert!(matches!(refused("x"), MeshFileError::Gltf(_)));
    let needs = refused(r#"{"extensionsRequired":["KHR_draco_mesh_compression"]}"#);
    assert_eq!(needs, MeshFileError::GltfExtension("KHR_draco_mesh_compression".to_owned()));
    assert_eq!(
        refused(r#"{"buffers":[{"uri":"a.bin"}]}"#),
        MeshFileError::GltfExternal("a.bin".to_owned())
    );
    let index = refused(r#"{"nodes":[{"mesh":3}]}"#);
    assert_eq!(index, MeshFileError::GltfPart { what: "mesh" });
    // Numbers that promise more than any computer has.
    let endless = r#"{"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":18446744073709551615,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":0}],"buffers":[{}]}"#;
    assert_eq!(refused(endless), MeshFileError::GltfPart { what: "positions" });
}

/// Cut off anywhere, or with a wrong byte anywhere: an answer, never a panic.
#[test]
fn damaged_files_give_an_answer() {
    let soup = TriangleSoup { colours: vec![[0.5; 3]; 12], ..ball(10.0, 0) };
    let files = [
        (MeshFormat::Glb, write_glb(&soup)),
        (MeshFormat::Stl, write_stl(&soup)),
        (MeshFormat::Obj, write_obj(&soup).into_bytes()),
    ];
    let mut random = SplitMix::seeded(3);
    for (format, bytes) in files {
        for end in 0..bytes.len() {
            let _ = read_mesh(format, &bytes[..end], MeshUnit::Millimetre);
        }
        for _ in 0..5000 {
            let mut damaged = bytes.clone();
            let at = random.below(damaged.len());
            damaged[at] = random.below(256) as u8;
            if let Ok(soup) = read_mesh(format, &damaged, MeshUnit::Millimetre) {
                let _ = palpate_haptics::triangles::TriangleMesh::new(soup);
            }
        }
    }
    assert_eq!(MeshFormat::of_name("a.b/Stomach.GLB"), Some(MeshFormat::Glb));
    assert_eq!(MeshFormat::of_name("stomach"), None);
}

#[test]
fn what_a_mesh_file_refuses_is_worded() {
    let text = || "v 0".to_owned();
    assert_messages! {
        MeshFileError::ObjLine { line: 3, what: "vertex", text: text() } => ["line 3", "vertex", "v 0"],
        MeshFileError::ObjIndex { line: 3, index: 9, vertices: 4 } => ["line 3", "vertex 9", "4 are before"],
        MeshFileError::ObjColours => ["colour"],
        MeshFileError::StlShort { bytes: 90, faces: 12, needed: 684 } => ["90 bytes", "12 triangles", "684"],
        MeshFileError::StlLine { line: 3, text: text() } => ["line 3", "v 0"],
        MeshFileError::StlCorners(4) => ["4 corners"],
        MeshFileError::Gltf("it ends".to_owned()) => ["it ends", "GLB"],
        MeshFileError::GltfExtension("X".to_owned()) => ["extension X"],
        MeshFileError::GltfExternal("a.bin".to_owned()) => ["a.bin", "GLB"],
        MeshFileError::GltfPart { what: "positions" } => ["positions"],
        MeshFileError::TooManyFaces { most: 7 } => ["more than 7"],
    }
}
