//! The demo's words are those of `dibs`.

// Requirement: P-08

#[path = "../../../../dibs-cli/src/words/table.rs"]
mod table;

use clap::{Args, Command, FromArgMatches};
use dibs_prove::demo::Options;

#[test]
fn the_demo_has_the_words_of_the_table() {
    let command = Options::augment_args(Command::new("demo"));
    assert_eq!(table::of_clap(&command), table::of_table("demo"));
    let earlier = command.try_get_matches_from(["demo", "--path"]).expect("an earlier word");
    assert!(Options::from_arg_matches(&earlier).expect("options").script);
}
