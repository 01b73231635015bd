//! The words of what a mesh and a force law refuse.

use palpate_haptics::LawError;
use palpate_haptics::surface::MeshError;
use palpate_test_support::assert_messages;

#[test]
fn what_a_mesh_refuses_is_worded() {
    assert_messages! {
        MeshError::Size { columns: 1, rows: 9 } => ["1 x 9", "65535"],
        MeshError::Spacing(-0.5) => ["-0.5 mm"],
        MeshError::Count { what: "rest heights", given: 5, nodes: 6 } => ["5 rest heights", "6 nodes"],
        MeshError::Height { column: 1, row: 2, height: 2e6 } => ["column 1", "row 2", "2000000 mm"],
        MeshError::Shear(-1.0) => ["MaxShear of -1 mm"],
        MeshError::Steep { column: 1, row: 0, rise: 1.5, limit: 1.0 } => ["column 1", "row 0", "1.5 mm", "1 mm"],
    }
}

#[test]
fn what_a_force_law_refuses_is_worded() {
    assert_messages! {
        LawError::Bound { name: "largest force", value: -1.0, unit: "N" } => ["largest force", "-1 N"],
        LawError::Start(f64::NAN) => ["NaN mm"],
    }
}
