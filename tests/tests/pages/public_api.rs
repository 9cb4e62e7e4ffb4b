//! `docs/evidence/public-api.txt` lists the public items of the libraries. `DIBS_WRITE=1` writes it anew.
//!
//! An item has a path: a type, trait, function, constant or macro. Methods and fields are not listed. A type's name is a
//! noun, which no other type of these libraries has.

// Requirement: E-04

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::{Attribute, Item, UseTree, Visibility};

use crate::page::{REPOSITORY, keep};

/// The core crate must have fewer items than this.
const MOST: usize = 150;

#[test]
fn the_public_items_are_those_that_are_listed() {
    let [core, builder, sender] = ["dibs-nostd", "dibs-build", "dibs-stream"].map(|package| {
        let source = Path::new(REPOSITORY).join(package).join("src");
        let mut listing = Listing::default();
        let name = package.replace('-', "_");
        listing.module(&source.join("lib.rs"), &source, &name);
        listing.macros(&source, &name);
        assert!(listing.missing.is_empty(), "without a file: {:?}", listing.missing);
        listing.items
    });
    assert!(core.contains("dibs_nostd::Query") && core.contains("dibs_nostd::wire::Deframer"));
    assert!(core.contains("dibs_nostd::include_tree!") && builder.contains("dibs_build::Builder"));
    assert!(core.len() < MOST, "{} public items", core.len());
    let lines: Vec<&str> = core.iter().chain(&builder).chain(&sender).map(String::as_str).collect();
    let listing = lines.join("\n") + "\n";
    // What is new may also be hidden.
    keep("public-api.txt", &listing);
}

/// The list that is recorded.
fn recorded() -> String {
    let path = Path::new(REPOSITORY).join("docs/evidence/public-api.txt");
    fs::read_to_string(path).expect("the list")
}

/// Prepositions and adverbs of place: no thing has such a name.
const PREPOSITIONS: [&str; 22] = [
    "Above", "After", "Ahead", "Around", "Before", "Behind", "Below", "Beside", "Between",
    "Beyond", "From", "In", "Inside", "Into", "Near", "Of", "Outside", "Over", "Under", "With",
    "Within", "Without",
];

/// Participles that do not end in "ed" or "ing".
const PARTICIPLES: [&str; 18] = [
    "Built", "Drawn", "Found", "Given", "Held", "Kept", "Known", "Left", "Lost", "Made", "Met",
    "Seen", "Sent", "Shown", "Stuck", "Taken", "Told", "Written",
];

/// Types whose names end as a participle does: here the word is a noun.
const NOUNS: [&str; 2] = [
    // A code for positions, as in "character encoding".
    "dibs_nostd::wire::Encoding",
    // What a meter shows, as in "meter reading".
    "dibs_nostd::MotionReading",
];

/// A type's name without its path; `None` for functions, constants, macros and modules.
fn type_name(item: &str) -> Option<&str> {
    let name = item.rsplit(':').next()?;
    let is_type = name.starts_with(char::is_uppercase) && name.contains(char::is_lowercase);
    is_type.then_some(name)
}

/// Whether the last word of a type's name can be a noun.
fn is_noun(name: &str) -> bool {
    let word = &name[name.rfind(char::is_uppercase).unwrap_or_default()..];
    let is_participle =
        word.ends_with("ed") || word.ends_with("ing") || PARTICIPLES.contains(&word);
    !is_participle && !PREPOSITIONS.contains(&word)
}

#[test]
fn types_are_named_by_nouns_and_each_name_stands_once() {
    let listed = recorded();
    let types: Vec<(&str, &str)> =
        listed.lines().filter_map(|item| Some((item, type_name(item)?))).collect();
    let wrong = types.iter().filter(|(_, name)| !is_noun(name)).map(|&(item, _)| item);
    // An exception that is no longer needed goes, too.
    assert_eq!(wrong.collect::<BTreeSet<_>>(), BTreeSet::from(NOUNS));
    let mut paths: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for &(item, name) in &types {
        paths.entry(name).or_default().push(item);
    }
    paths.retain(|_, paths| paths.len() > 1);
    assert!(types.len() > 150 && paths.is_empty(), "of one name: {paths:?}");
    assert!(["Posed", "LastSent", "Beyond", "FactsOf"].iter().all(|name| !is_noun(name)));
}

/// Where an item of the core's root may be used: examples, products, and the code in documents.
const USES: [&str; 11] = [
    "examples",
    "dibs-nostd/examples",
    "dibs-build/examples",
    "dibs-build/src",
    "dibs-stream",
    "dibs-cli/src",
    "firmware-example/src",
    "bindings/c/src",
    "bindings/python/src",
    "viewer/src",
    "docs/guide.md",
];

#[test]
fn every_item_of_the_root_is_in_an_example_or_a_product() {
    let listed = recorded();
    let items = listed.lines().filter_map(|line| line.strip_prefix("dibs_nostd::"));
    let items: BTreeSet<&str> = items.filter(|item| !item.contains(':')).collect();
    let mut words = BTreeSet::new();
    for place in USES {
        read_words(&Path::new(REPOSITORY).join(place), str::to_owned, &mut words);
    }
    // In the core only the examples in its documentation count.
    read_words(&Path::new(REPOSITORY).join("dibs-nostd/src"), documented_code, &mut words);
    let unused: Vec<_> =
        items.iter().filter(|item| !words.contains(item.trim_end_matches('!'))).collect();
    assert!(items.len() > 50 && unused.is_empty(), "in no example: {unused:?}");
}

/// Adds the words of all sources at a place.
fn read_words(place: &Path, part: fn(&str) -> String, words: &mut BTreeSet<String>) {
    if place.is_dir() {
        for entry in fs::read_dir(place).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.file_name().is_none_or(|name| name != "target" && name != "tests") {
                read_words(&path, part, words);
            }
        }
    } else if place.extension().is_some_and(|extension| extension == "rs" || extension == "md") {
        let text = part(&fs::read_to_string(place).expect("text"));
        words.extend(text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned));
    }
}

/// The code between the fences of a source's documentation.
fn documented_code(source: &str) -> String {
    let mut is_code = false;
    let lines = source.lines().filter_map(|line| {
        let line = line.trim_start();
        let text = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"))?;
        if text.trim_start().starts_with("```") {
            is_code = !is_code;
            return None;
        }
        is_code.then_some(text)
    });
    lines.collect::<Vec<_>>().join("\n")
}

#[derive(Default)]
struct Listing {
    items: BTreeSet<String>,
    /// Public modules whose file was not found.
    missing: Vec<String>,
}

impl Listing {
    /// Lists a module: its file, and the folder of its submodules.
    fn module(&mut self, file: &Path, folder: &Path, path: &str) {
        let Ok(text) = fs::read_to_string(file) else {
            self.missing.push(path.to_owned());
            return;
        };
        let code = syn::parse_file(&text).expect("it compiles");
        self.items(&code.items, folder, path);
    }

    fn items(&mut self, items: &[Item], folder: &Path, path: &str) {
        for item in items {
            let (visibility, attributes, name) = match item {
                Item::Use(item) if is_public(&item.vis) && !is_hidden(&item.attrs) => {
                    self.uses(&item.tree, folder, path);
                    continue;
                }
                Item::Mod(item) => {
                    if is_public(&item.vis) && !is_hidden(&item.attrs) {
                        let path = format!("{path}::{}", item.ident);
                        match &item.content {
                            Some((_, items)) => self.items(items, folder, &path),
                            None => self.submodule(folder, &item.ident.to_string(), &path),
                        }
                    }
                    continue;
                }
                Item::Struct(item) => (&item.vis, &item.attrs, &item.ident),
                Item::Enum(item) => (&item.vis, &item.attrs, &item.ident),
                Item::Trait(item) => (&item.vis, &item.attrs, &item.ident),
                Item::Type(item) => (&item.vis, &item.attrs, &item.ident),
                Item::Const(item) => (&item.vis, &item.attrs, &item.ident),
                Item::Static(item) => (&item.vis, &item.attrs, &item.ident),
                Item::Fn(item) => (&item.vis, &item.attrs, &item.sig.ident),
                Item::Union(item) => (&item.vis, &item.attrs, &item.ident),
                _ => continue,
            };
            if is_public(visibility) && !is_hidden(attributes) {
                self.items.insert(format!("{path}::{name}"));
            }
        }
    }

    /// Lists the exported macros, wherever they are: their paths are in the crate's root.
    fn macros(&mut self, source: &Path, name: &str) {
        for file in fs::read_dir(source).expect("a folder") {
            let path = file.expect("a file").path();
            if path.is_dir() {
                self.macros(&path, name);
            }
            if path.extension().is_none_or(|extension| extension != "rs") {
                continue;
            }
            let code = syn::parse_file(&fs::read_to_string(path).expect("text")).expect("compiles");
            for item in code.items {
                if let Item::Macro(item) = item
                    && let Some(ident) = &item.ident
                    && item.attrs.iter().any(|a| a.path().is_ident("macro_export"))
                    && !is_hidden(&item.attrs)
                {
                    self.items.insert(format!("{name}::{ident}!"));
                }
            }
        }
    }

    /// Lists the items of a `pub use`; for a module, its items.
    fn uses(&mut self, tree: &UseTree, folder: &Path, path: &str) {
        match tree {
            UseTree::Path(item) => {
                let name = item.ident.to_string();
                let inner = if name == "self" { folder.to_owned() } else { folder.join(name) };
                self.uses(&item.tree, &inner, path);
            }
            UseTree::Name(item) => {
                let (name, path) = (item.ident.to_string(), format!("{path}::{}", item.ident));
                match module_file(folder, &name) {
                    Some((file, folder)) => self.module(&file, &folder, &path),
                    None => {
                        self.items.insert(path);
                    }
                }
            }
            UseTree::Rename(item) => {
                self.items.insert(format!("{path}::{}", item.rename));
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.uses(tree, folder, path);
                }
            }
            UseTree::Glob(_) => self.missing.push(format!("{path}::*")),
        }
    }

    fn submodule(&mut self, folder: &Path, name: &str, path: &str) {
        match module_file(folder, name) {
            Some((file, folder)) => self.module(&file, &folder, path),
            None => self.missing.push(path.to_owned()),
        }
    }
}

fn module_file(folder: &Path, name: &str) -> Option<(PathBuf, PathBuf)> {
    let inner = folder.join(name);
    let files = [folder.join(format!("{name}.rs")), inner.join("mod.rs")];
    Some((files.into_iter().find(|file| file.exists())?, inner))
}

pub fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

pub fn is_hidden(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let list = attribute.meta.require_list();
        attribute.path().is_ident("doc") && list.is_ok_and(|l| l.tokens.to_string() == "hidden")
    })
}
