//! Pages whose tables show the records.

// Requirement: E-02

use std::{env, fs};

use anyhow::Result;
use dibs_prove::checks::{boards, other_processors};
use xtask::workspace;

const END: &str = "<!-- end of figures -->";

#[test]
fn boards() {
    shows_the_records("boards", boards::table);
}

#[test]
fn processors() {
    shows_the_records("processors", other_processors::table);
}

/// The page of this name has the table of its records, or gets it.
fn shows_the_records(name: &str, table: impl Fn() -> Result<String>) {
    let begin = format!("--test own {name}` -->\n");
    let file = workspace::root().join(format!("docs/{name}.md"));
    let page = fs::read_to_string(&file).expect("the page");
    let (before, rest) = page.split_once(&begin).expect("a place for the table");
    let (_, after) = rest.split_once(END).expect("its end");
    let table = table().expect("records");
    let fresh = format!("{before}{begin}\n{table}{END}{after}");
    if env::var_os("DIBS_WRITE").is_some() {
        fs::write(&file, &fresh).expect("writable");
    } else {
        assert!(page == fresh, "DIBS_WRITE=1 writes the table anew");
    }
}
