//! The repository's top folder.

// Requirement: E-02

use std::fs;

use xtask::workspace::root_above;

#[test]
fn a_copy_is_a_root_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy");
    for package in ["xtask", "dibs-nostd", "tests/prove"] {
        fs::create_dir_all(copy.join(package)).unwrap();
        fs::write(copy.join(package).join("Cargo.toml"), "").unwrap();
    }
    for start in ["xtask", "tests/prove", "target/release/xtask", ""] {
        assert_eq!(root_above(&copy.join(start)), Some(copy.as_path()), "{start}");
    }
    assert_eq!(root_above(folder.path()), None);
}
