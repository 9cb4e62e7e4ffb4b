//! docs/boards.md shows the records.

// Requirement: E-02

use std::{env, fs};

use dibs_prove::checks::boards::table;
use xtask::workspace;

const BEGIN: &str = "--test own boards` -->\n";
const END: &str = "<!-- end of figures -->";

#[test]
fn the_page_shows_the_records() {
    let file = workspace::root().join("docs/boards.md");
    let page = fs::read_to_string(&file).expect("the page");
    let (before, rest) = page.split_once(BEGIN).expect("a place for the table");
    let (_, after) = rest.split_once(END).expect("its end");
    let table = table().expect("records");
    let fresh = format!("{before}{BEGIN}\n{table}{END}{after}");
    if env::var_os("DIBS_WRITE").is_some() {
        fs::write(&file, &fresh).expect("writable");
    } else {
        assert!(page == fresh, "DIBS_WRITE=1 writes the table anew");
    }
}
