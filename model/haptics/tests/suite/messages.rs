//! The words of what a mesh and a force law refuse.

use palpate_haptics::surface::MeshError;
use palpate_haptics::triangles::{MaterialError, TriangleMeshError};
use palpate_haptics::{LawError, SettingError, SettingRange};
use palpate_test_support::assert_messages;

#[test]
fn what_a_mesh_refuses_is_worded() {
    assert_messages! {
        MeshError::Size { columns: 1, rows: 9 } => ["1 x 9", "65535"],
        MeshError::Spacing(-0.5) => ["-0.5 mm"],
        MeshError::Count { what: "rest heights", given: 5, nodes: 6 } => ["5 rest heights", "6 nodes"],
        MeshError::Height { column: 1, row: 2, height: 2e6 } => ["column 1", "row 2", "2000000 mm"],
        MeshError::Shear(-1.0) => ["limit of -1 mm", "height difference"],
        MeshError::Steep { column: 1, row: 0, rise: 1.5, limit: 1.0 } => ["column 1", "row 0", "1.5 mm", "1 mm"],
    }
}

#[test]
fn what_a_force_law_refuses_is_worded() {
    assert_messages! {
        LawError::Start(f64::NAN) => ["NaN mm"],
    }
}

#[test]
fn settings_out_of_range_are_worded() {
    let refused =
        |name, value, unit, range| SettingError { subject: "a motor", name, value, unit, range };
    assert_messages! {
        refused("resistance", 0.0, " ohm", SettingRange::Positive) => ["a motor", "resistance = 0 ohm", "above zero"],
        refused("bits", 33.0, "", SettingRange::PositiveUpTo(32.0)) => ["bits = 33", "up to 32"],
        refused("share", 2.0, "", SettingRange::UpTo(1.0)) => ["share = 2", "from 0 to 1"],
        refused("friction", -1.0, " N", SettingRange::NotNegative) => ["friction = -1 N", "zero or more"],
        refused("hold", f64::NAN, " s", SettingRange::MayBeInfinite) => ["hold = NaN s", "infinite"],
    }
}

#[test]
fn what_triangles_refuse_is_worded() {
    use TriangleMeshError as Error;
    assert_messages! {
        Error::Empty => ["no triangle"],
        Error::TooManyFaces { faces: 9, most: 7 } => ["9 triangles", "the 7"],
        Error::NotANumber { vertex: 3 } => ["vertex 3"],
        Error::Index { face: 1, vertex: 9, vertices: 4 } => ["triangle 1", "vertex 9", "are 4"],
        Error::Colours { given: 2, vertices: 3 } => ["2 colours", "3 vertices"],
        Error::NoArea { face: 5, tolerance_mm: 0.25 } => ["triangle 5", "0.25 mm"],
        Error::ThirdFace { face: 5, at: [1.0, 2.0, 3.5] } => ["triangle 5", "[1.0, 2.0, 3.5] mm"],
        Error::NoSides { face: 5 } => ["triangle 5", "outer side"],
        Error::TooLarge { size_mm: 2e5, most_mm: 1e4 } => ["200000 mm", "10000 mm", "unit"],
        Error::TooSmall { size_mm: 0.5, least_mm: 1.0 } => ["0.5 mm", "1 mm", "unit"],
        MaterialError::Count(9) => ["9 materials", "1 to 8"],
        MaterialError::Material { vertex: 4, material: 3, materials: 2 } => ["vertex 4", "material 3", "are 2"],
        MaterialError::Vertex { vertex: 9, vertices: 4 } => ["vertex 9", "has 4"],
        MaterialError::Line { line: 2, text: "x".to_owned() } => ["line 2", "'x'"],
        MaterialError::Colours { given: 2, vertices: 3 } => ["2 values", "3 vertices"],
        MaterialError::Unpainted(6) => ["vertex 6"],
    }
}
