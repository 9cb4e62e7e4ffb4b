//! The failures of every public call of `guard`: `docs/evidence/failures.md`, which `DIBS_WRITE=1` writes again.
//!
//! These fail: a call without a row, a row without a call, an error of a signature that is missing in its row, and a
//! variant that no row gives and no reason excludes.

// Requirement: E-03

mod rows;
pub mod sources;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use self::rows::{CALLS, Call, NEVER, Variants};
use self::sources::{Enums, Functions, STRUCTS};
use crate::page;

const HEAD: &str = "\
# Failures of a guard's calls

Written by `DIBS_WRITE=1 cargo test -p dibs-tests --test pages`: do not edit. The rows are in
[rows.rs](../../tests/tests/pages/failures/rows.rs). That test fails on a public call of `guard` without a row, and on a variant
of an error that no call gives and no reason excludes.

No call panics, allocates, waits or recurses ([P-01, F-01](requirements.md)). A call that returns an error has no other effect
than the column *stays* says. The hazards that a wrong or missing answer leads to are those of the device.

**Nothing here is certified, and no certification is claimed.**

| call | what can go wrong | the caller gets | stays |
|---|---|---|---|
";

#[test]
fn every_call_and_every_variant_has_a_row() {
    let (enums, functions) = (sources::enums(), sources::functions());
    assert!(functions.len() > 20 && enums["Error"].len() > 15, "nothing was read");
    let faults = faults(CALLS, NEVER, &enums, &functions);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    page::keep("failures.md", &text(&enums));
}

/// The variants of a row, by their enum.
fn given(variants: &Variants, of: &BTreeSet<&str>) -> BTreeSet<String> {
    let is_given = |name: &&str| match variants {
        Variants::All => true,
        Variants::Only(only) => only.contains(name),
        Variants::But(but) => !but.contains(name),
    };
    of.iter().copied().filter(is_given).map(str::to_owned).collect()
}

/// Missing, unknown and duplicate entries.
fn faults(
    calls: &[Call],
    never: &[(&str, &[&str], &str)],
    enums: &Enums,
    functions: &Functions,
) -> Vec<String> {
    let mut faults = Vec::new();
    let mut open: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (name, variants) in enums {
        open.insert(name, variants.keys().map(String::as_str).collect());
    }
    let all = open.clone();
    let mut is_known = |name: &str, variants: &[&str]| {
        let known = all.get(name);
        for variant in variants {
            if !known.is_some_and(|known| known.contains(variant)) {
                faults.push(format!("{name}::{variant} does not exist"));
            }
        }
    };
    for (name, variants, _) in never {
        is_known(name, variants);
    }
    for (name, variants) in calls.iter().flat_map(|call| call.gives) {
        if let Variants::Only(variants) | Variants::But(variants) = variants {
            is_known(name, variants);
        }
    }
    for Call { name, gives, .. } in calls {
        for (error, variants) in *gives {
            let Some(known) = all.get(error) else {
                if !STRUCTS.contains(error) {
                    faults.push(format!("{name}: {error} is no error that is read"));
                }
                continue;
            };
            let given = given(variants, known);
            open.get_mut(error).expect("the same enums").retain(|left| !given.contains(*left));
        }
        match functions.get(*name) {
            None => faults.push(format!("{name} is no public call")),
            Some(errors) => {
                for error in errors.iter().filter(|error| !gives.iter().any(|(of, _)| of == error))
                {
                    faults.push(format!("{name}: its row lacks {error}"));
                }
            }
        }
    }
    for name in functions.keys().filter(|name| !calls.iter().any(|call| call.name == **name)) {
        faults.push(format!("{name}: no row"));
    }
    for (error, variants, _) in never {
        for variant in *variants {
            if !open.get_mut(error).is_some_and(|open| open.remove(variant)) {
                faults.push(format!("{error}::{variant} is given, or excluded twice"));
            }
        }
    }
    for (error, left) in open {
        faults.extend(left.iter().map(|variant| format!("{error}::{variant}: no call gives it")));
    }
    // An error inside of another one is read, too.
    for (error, variants) in enums {
        for (name, variant) in variants {
            let is_excluded =
                never.iter().any(|(of, names, _)| of == error && names.contains(&name.as_str()));
            let inner = variant.inner.as_deref().filter(|_| !is_excluded);
            if let Some(inner) = inner
                && !enums.contains_key(inner)
                && !STRUCTS.contains(&inner)
            {
                faults.push(format!("{error}::{name}: {inner} is not read"));
            }
        }
    }
    faults
}

fn text(enums: &Enums) -> String {
    let mut text = HEAD.to_owned();
    for Call { name, goes_wrong, gives, stays } in CALLS {
        let cell = |(error, variants): &rows::Gives| match variants {
            Variants::All if STRUCTS.contains(error) => format!("`{error}`"),
            Variants::All => format!("any `{error}`"),
            Variants::Only(names) => format!("`{error}` {}", names.join(", ")),
            Variants::But(names) => format!("`{error}` other than {}", names.join(", ")),
        };
        let gives = gives.iter().map(cell).collect::<Vec<_>>().join("; ");
        let gives = if gives.is_empty() { "–".to_owned() } else { gives };
        let _ = writeln!(text, "| `{name}` | {goes_wrong} | {gives} | {stays} |");
    }
    text += "\n## Variants\n\nTheir meanings are those of the sources' documentation.\n\n| error | meaning | from |\n|---|---|---|\n";
    for (error, variants) in enums {
        let all: BTreeSet<&str> = variants.keys().map(String::as_str).collect();
        for (name, variant) in variants {
            let gives = |call: &&Call| {
                call.gives
                    .iter()
                    .any(|(of, given_here)| of == error && given(given_here, &all).contains(name))
            };
            let from: Vec<_> =
                CALLS.iter().filter(gives).map(|call| format!("`{}`", call.name)).collect();
            let reason =
                NEVER.iter().find(|(of, names, _)| of == error && names.contains(&name.as_str()));
            let from =
                reason.map_or_else(|| from.join(", "), |(.., reason)| format!("none: {reason}"));
            let _ = writeln!(text, "| `{error}::{name}` | {} | {from} |", variant.says);
        }
    }
    text
}

#[test]
fn what_is_not_listed_is_found() {
    let variant = |inner: Option<&str>| sources::Variant {
        says: String::new(),
        inner: inner.map(str::to_owned),
    };
    let variants = [("A".to_owned(), variant(None)), ("B".to_owned(), variant(Some("InnerError")))];
    let enums: Enums = [("OneError".to_owned(), variants.into())].into();
    let errors = ["OneError".to_owned()].into();
    let functions: Functions = [("Bus::one".to_owned(), errors)].into();
    let row = |name, gives| Call { name, goes_wrong: "", gives, stays: "" };
    let found = |calls: &[Call], never: &[_]| faults(calls, never, &enums, &functions);
    let none = found(&[], &[("OneError", &["A", "B"], "")]);
    assert_eq!(none, ["Bus::one: no row"]);
    let less = found(&[row("Bus::one", &[("OneError", Variants::Only(&["A"]))])], &[]);
    assert_eq!(less, ["OneError::B: no call gives it", "OneError::B: InnerError is not read"]);
    let other =
        found(&[row("Bus::one", &[]), row("Bus::two", &[])], &[("OneError", &["A", "B", "C"], "")]);
    assert_eq!(
        other,
        [
            "OneError::C does not exist",
            "Bus::one: its row lacks OneError",
            "Bus::two is no public call",
            "OneError::C is given, or excluded twice",
        ]
    );
}
