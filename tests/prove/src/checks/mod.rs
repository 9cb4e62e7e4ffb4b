//! One file, one check, with the promises that it shows. A new row is a new file, and a line here.

mod anytime;
pub mod bits;
mod board_faults;
mod corruption;
pub mod cost;
mod demo;
mod demo_faults;
mod fuzz;
mod hand;
mod host_faults;
pub mod instructions;
mod interleavings;
mod link;
mod miri;
mod modes;
mod path;
mod receive;
mod rot;
mod sanitizers;
mod sides;
mod signed;
mod stack;
mod ticks;
mod torn;
mod tracked;

use crate::harness::Check;

/// All checks, in the order of the document.
pub const CHECKS: &[Check] = &[
    anytime::CHECK,
    sides::CHECK,
    hand::CHECK,
    cost::BOARD,
    cost::HOST,
    path::CHECK,
    tracked::CHECK,
    ticks::CHECK,
    signed::CHECK,
    bits::CHECK,
    link::CHECK,
    stack::CHECK,
    demo::CHECK,
    demo_faults::CHECK,
    rot::CHECK,
    host_faults::CHECK,
    board_faults::CHECK,
    interleavings::CHECK,
    torn::CHECK,
    receive::CHECK,
    modes::CHECK,
    sanitizers::ADDRESS,
    sanitizers::THREAD,
    miri::CHECK,
    corruption::CHECK,
    fuzz::CHECK,
    instructions::CHECK,
];

/// Names of the checks that build and run programs of their own, and take the other core.
pub const BESIDE: [&str; 5] = [
    sanitizers::ADDRESS.name,
    sanitizers::THREAD.name,
    interleavings::CHECK.name,
    miri::CHECK.name,
    fuzz::CHECK.name,
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;

    use xtask::workspace;

    use super::*;

    /// A row without a check of that name, a check or a test without a row, or a link to nowhere.
    #[test]
    fn the_page_of_proofs_names_every_check_and_files_that_exist() {
        let docs = workspace::root().join("docs");
        let page = fs::read_to_string(docs.join("proofs.md")).expect("a page");
        let table = page.split("## Checks").nth(1).and_then(|rest| rest.split("## Tests").next());
        let rows = table.expect("a table").lines().filter_map(|line| line.split('|').nth(1));
        let named: BTreeSet<&str> = rows.map(str::trim).skip(2).collect();
        let checks: BTreeSet<&str> = CHECKS.iter().map(|check| check.name).collect();
        assert_eq!(named, checks);
        let links = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let links: BTreeSet<&str> = links.collect();
        for link in &links {
            assert!(docs.join(link).exists(), "{link} is not there");
        }
        for folder in ["tests/tests", "dibs-build/tests", "firmware-example/tests"] {
            let files = fs::read_dir(workspace::root().join(folder)).expect("a folder");
            let names = files.map(|file| file.expect("an entry").file_name());
            for name in names.filter_map(|name| name.into_string().ok()) {
                let link = format!("../{folder}/{name}");
                assert!(!name.ends_with(".rs") || links.contains(&link[..]), "{link}: no row");
            }
        }
    }

    #[test]
    fn no_two_promises_are_of_one_figure() {
        let ids = || CHECKS.iter().flat_map(|check| check.promises).map(|promise| promise.id);
        assert_eq!(ids().collect::<BTreeSet<_>>().len(), ids().count());
    }
}
