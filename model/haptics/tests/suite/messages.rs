//! The words of what a mesh and a force law refuse.

use palpate_haptics::surface::MeshError;
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
