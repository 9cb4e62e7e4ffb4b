//! `include/dibs.h` is the header that cbindgen generates. `DIBS_WRITE=1` writes it anew.

// Requirement: P-06

use std::path::Path;
use std::{env, fs};

#[test]
fn the_header_is_that_of_the_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let settings = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("settings");
    let bindings = cbindgen::generate_with_config(root, settings).expect("a header");
    let mut header = Vec::new();
    bindings.write(&mut header);
    let header = String::from_utf8(header).expect("text");
    assert!(header.contains("dibs_query_closest("), "no functions:\n{header}");
    assert!(!header.contains("planted"), "a function of the tests alone");
    let path = root.join("include/dibs.h");
    if env::var_os("DIBS_WRITE").is_some() {
        fs::write(path, header).expect("writable");
    } else {
        let committed = fs::read_to_string(path).unwrap_or_default();
        assert!(committed == header, "write it anew with DIBS_WRITE=1");
    }
}
