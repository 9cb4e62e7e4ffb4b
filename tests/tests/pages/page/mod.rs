//! Pages that these tests write.

use std::path::{Path, PathBuf};
use std::{env, fs};

use serde_json::Value;

pub const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// A file of `docs/evidence`, or of the folder that a run of `cargo xtask evidence` names.
pub fn evidence(name: &str) -> PathBuf {
    let folder = env::var_os("DIBS_EVIDENCE").map(PathBuf::from);
    folder.unwrap_or_else(|| Path::new(REPOSITORY).join("docs/evidence")).join(name)
}

/// Compares a page of `docs/evidence` with its text, or writes it with `DIBS_WRITE=1`.
pub fn keep(name: &str, text: &str) {
    let path = evidence(name);
    if env::var_os("DIBS_WRITE").is_some() {
        fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        fs::write(path, text).expect("writable");
    } else {
        let kept = fs::read_to_string(path).unwrap_or_default();
        assert!(kept == text, "{name}: write it anew with DIBS_WRITE=1");
    }
}

/// The rows of a record in `docs/evidence`.
pub fn records(name: &str) -> Vec<Value> {
    let path = evidence(name);
    serde_json::from_str(&fs::read_to_string(path).expect("a record")).expect("rows")
}

/// A number with commas.
pub fn thousands(value: u32) -> String {
    let digits = value.to_string();
    let mut out = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}
