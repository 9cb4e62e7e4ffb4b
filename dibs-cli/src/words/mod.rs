//! The options of the command line have one name for one value.

// Requirement: P-08

mod table;

use clap::builder::ValueParser;
use clap::{Arg, Command};
use std::collections::{BTreeMap, BTreeSet};
use table::{WORDS, of_clap, of_table, word};

/// Value names that several options may have: units, and numbers without a unit.
const UNITS: [&str; 9] =
    ["HZ", "MM", "MM/S", "MS", "SECONDS", "NUMBER", "TOLERANCE", "COUNT", "BYTES"];

/// A command line with the options of earlier versions, and the same with today's.
const EARLIER: [(&str, &str); 6] = [
    ("stretch h.ply h.pc2 --margin 0.2", "stretch h.ply --motion h.pc2 --margin 0.2"),
    ("view h.dibs h.pc2 -o h.html", "view h.dibs --motion h.pc2 -o h.html"),
    ("view h.dibs h.pc2 --motion-rate 9 -o h", "view h.dibs --motion h.pc2 --motion-rate 9 -o h"),
    ("stream h.dibs h.pc2 --to unix:a", "stream h.dibs --motion h.pc2 --to unix:a"),
    (
        "stream h.dibs h.pc2 --to unix:a --rate 9",
        "stream h.dibs --motion h.pc2 --to unix:a --motion-rate 9",
    ),
    (
        "stream h.dibs h.pc2 --to unix:a --modes",
        "stream h.dibs --motion h.pc2 --to unix:a --weights",
    ),
];

/// The commands of the program and their subcommands, each with the name of its top-level command.
fn commands() -> Vec<(String, Command)> {
    let top = crate::command();
    let mut found = Vec::new();
    for command in top.get_subcommands() {
        let name = command.get_name().to_owned();
        found.extend(command.get_subcommands().map(|below| (name.clone(), below.clone())));
        found.push((name, command.clone()));
    }
    found
}

/// The commands' arguments, hidden ones included.
fn arguments() -> Vec<(String, Arg)> {
    let of = |(name, command): (String, Command)| {
        command.get_arguments().map(|arg| (name.clone(), arg.clone())).collect::<Vec<_>>()
    };
    commands().into_iter().flat_map(of).collect()
}

/// The name of a command by which the table has it: two are one.
fn listed(name: &str) -> &str {
    if name == "bridge" { "stream" } else { name }
}

#[test]
fn every_command_has_the_words_of_the_table() {
    let top = crate::command();
    for command in top.get_subcommands() {
        let name = command.get_name();
        assert_eq!(of_clap(command), of_table(listed(name)), "{name}");
    }
    let known = top.get_subcommands().map(|command| listed(command.get_name()));
    let known: BTreeSet<&str> = known.collect();
    let named = WORDS.iter().flat_map(|row| row.3.split(' ')).filter(|name| *name != "demo");
    assert_eq!(named.collect::<BTreeSet<_>>(), known);
}

#[test]
fn a_value_has_one_word_and_a_word_one_value() {
    let (mut words, mut values, mut kinds) = (BTreeSet::new(), BTreeSet::new(), BTreeMap::new());
    for &(word, kind, value, _) in WORDS {
        assert!(words.insert(word), "{word} has two rows");
        assert!(values.insert(value), "'{value}' has two words");
        if !kind.is_empty() && !UNITS.contains(&kind) {
            assert_eq!(kinds.insert(kind, word), None, "{kind} has two words, one of them {word}");
        }
    }
    // An option must have the same type in all commands.
    let mut types = BTreeMap::new();
    for (command, arg) in arguments() {
        let (own, word) = (arg.get_value_parser().type_id(), word(&arg));
        let first = types.entry(word).or_insert((own, command.clone()));
        assert_eq!(first.0, own, "{} of {command}, and of {}", arg.get_id(), first.1);
    }
}

/// A negative number is a value that is refused, and not an unknown option.
#[test]
fn numbers_may_be_negative_where_they_are_fractions() {
    let types = [
        ValueParser::from(clap::value_parser!(f32)).type_id(),
        ValueParser::from(clap::value_parser!(f64)).type_id(),
    ];
    for (command, arg) in arguments() {
        if types.contains(&arg.get_value_parser().type_id()) {
            assert!(arg.is_allow_negative_numbers_set(), "{} of {command}", arg.get_id());
        }
    }
}

/// The arguments that a command line sets, and their values.
fn given(line: &str) -> BTreeMap<String, Vec<String>> {
    let matches = crate::command()
        .try_get_matches_from(["dibs"].into_iter().chain(line.split(' ')))
        .unwrap_or_else(|error| panic!("{line}: {error}"));
    let (name, matches) = matches.subcommand().expect("a command");
    let mut command = crate::command();
    let command = command.find_subcommand_mut(name).expect("a command");
    let ids = command.get_arguments().map(|arg| arg.get_id().as_str());
    let ids = ids.filter(|id| matches.value_source(id).is_some());
    let values = |id: &str| {
        let raw = matches.get_raw(id).expect("a value");
        raw.map(|value| value.to_string_lossy().into_owned()).collect()
    };
    let today = |id: &str| id.trim_start_matches("unnamed_").to_owned();
    ids.map(|id| (today(id), values(id))).collect()
}

#[test]
fn earlier_words_mean_the_same() {
    for (earlier, today) in EARLIER {
        assert_eq!(given(earlier), given(today), "{earlier}");
    }
    let both = "dibs stretch h.ply h.pc2 --motion h.pc2".split(' ');
    assert!(crate::command().try_get_matches_from(both).is_err());
}

#[test]
fn earlier_words_are_hidden() {
    let mut hidden = BTreeSet::new();
    for (command, arg) in arguments() {
        assert_eq!(arg.get_visible_aliases().unwrap_or_default(), [""; 0], "{}", arg.get_id());
        let aliases = arg.get_all_aliases().unwrap_or_default().into_iter().map(str::to_owned);
        let own = arg.is_hide_set().then(|| word(&arg));
        hidden.extend(aliases.chain(own).map(|word| (listed(&command).to_owned(), word)));
    }
    let expected = [
        ("filter", "motion"),
        ("stream", "modes"),
        ("stream", "motion"),
        ("stream", "rate"),
        ("stretch", "edges"),
        ("stretch", "motion"),
        ("track", "motion"),
        ("view", "motion"),
    ];
    let expected = expected.map(|(command, word)| (command.to_owned(), word.to_owned()));
    assert_eq!(hidden, BTreeSet::from(expected));
    for (name, mut command) in commands() {
        let help = command.render_long_help().to_string();
        let is_shown = ["--edges", "[MOTION]", "unnamed"].iter().any(|word| help.contains(word));
        assert!(!is_shown, "{name}: {help}");
    }
}
