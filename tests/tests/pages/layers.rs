//! Dependencies between the folders of a crate have one direction.
//!
//! `docs/evidence/dependencies.md` lists them, and `DIBS_WRITE=1` writes that list again. `DIBS_CHECKOUT=FOLDER cargo
//! test -p dibs-tests --test pages layers -- --nocapture` prints the list of another checkout.

// Requirement: E-04

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::{env, fs};

use crate::page::evidence;

/// The folders that each folder imports from.
type Imports = BTreeMap<String, BTreeSet<String>>;

#[test]
fn the_core_has_no_mutual_imports() {
    let imports = imports("dibs-nostd");
    assert!(imports["query"].contains("tree"), "nothing was read: {imports:?}");
    assert_eq!(cycle(&imports), None);
}

/// At any depth.
#[test]
fn no_folder_of_the_core_has_mutual_imports_inside() {
    let source = source("dibs-nostd");
    let (mut edges, mut nested) = (0, 0);
    for folder in folders(&source, Path::new("")) {
        let (inside, folders) = inner_imports(&source, &folder);
        nested += usize::from(folder.contains('/'));
        edges += inside.values().map(BTreeSet::len).sum::<usize>();
        let mutual = mutual(&inside, &folders);
        assert!(mutual.is_empty(), "{folder}: {mutual:?} of {inside:?}");
    }
    assert!(edges >= 150 && nested >= 5, "{edges} imports were read, {nested} nested folders");
}

#[test]
fn the_builder_has_no_mutual_imports() {
    let imports = imports("dibs-build");
    assert!(imports["builder"].contains("array"), "nothing was read: {imports:?}");
    assert_eq!(cycle(&imports), None);
}

#[test]
fn the_sender_has_no_mutual_imports() {
    let imports = imports("dibs-stream");
    assert!(imports["sender"].contains("transport"), "nothing was read: {imports:?}");
    assert_eq!(cycle(&imports), None);
}

#[test]
fn the_page_lists_the_imports_of_today() {
    let packages = ["dibs-build", "dibs-nostd", "dibs-stream"];
    let tables = packages.map(|package| table(package, &imports(package)));
    let now = tables.concat().trim_end().to_owned() + "\n";
    println!("{now}");
    if env::var_os("DIBS_CHECKOUT").is_some() {
        return;
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/evidence/dependencies.md");
    let page = fs::read_to_string(&path).expect("the page");
    let (head, listed) = page.split_once("\n\n|").expect("a table");
    if env::var_os("DIBS_WRITE").is_some() {
        // The head is of `docs/evidence`, wherever the page goes.
        fs::write(evidence("dependencies.md"), format!("{head}\n\n{now}")).expect("writable");
    } else {
        assert_eq!(format!("|{listed}"), now, "write it anew with DIBS_WRITE=1");
    }
}

#[test]
fn a_cycle_is_found() {
    let imports = |rows: &[(&str, &[&str])]| -> Imports {
        let set = |to: &[&str]| to.iter().map(|&to| to.to_owned()).collect();
        rows.iter().map(|&(from, to)| (from.to_owned(), set(to))).collect()
    };
    assert_eq!(cycle(&imports(&[("a", &["b", "c"]), ("b", &["c"]), ("c", &[])])), None);
    let circle = imports(&[("a", &["b"]), ("b", &["c"]), ("c", &["a"]), ("d", &["a"])]);
    assert!(cycle(&circle).is_some());
    // By way of the file `b`.
    let folders = ["a", "c", "d"].map(str::to_owned).into();
    assert_eq!(mutual(&circle, &folders), [("a", "c")]);
}

/// Folders on cycles of imports, or that import from them; `None` without a cycle.
fn cycle(imports: &Imports) -> Option<BTreeSet<&str>> {
    let mut left: BTreeSet<&str> = imports.keys().map(String::as_str).collect();
    // Remove folders that import from none of the remaining ones, until there is no such folder.
    loop {
        let is_free = |from: &&str| !imports[*from].iter().any(|to| left.contains(to.as_str()));
        let free: Vec<&str> = left.iter().copied().filter(is_free).collect();
        if free.is_empty() {
            break;
        }
        left.retain(|from| !free.contains(from));
    }
    (!left.is_empty()).then_some(left)
}

fn source(package: &str) -> PathBuf {
    let checkout = env::var("DIBS_CHECKOUT").unwrap_or_else(|_| "..".to_owned());
    Path::new(env!("CARGO_MANIFEST_DIR")).join(checkout).join(package).join("src")
}

/// The folders of modules below a folder, at any depth, by their paths from the sources.
fn folders(source: &Path, below: &Path) -> Vec<String> {
    let entries = fs::read_dir(source.join(below)).expect("a folder");
    let names = entries.map(|entry| below.join(entry.expect("readable").file_name()));
    let inner = names.filter(|name| source.join(name).is_dir());
    let inner: Vec<PathBuf> = inner.filter(|name| !files(&source.join(name)).is_empty()).collect();
    let path = |name: PathBuf| name.to_string_lossy().into_owned();
    inner.into_iter().flat_map(|name| [folders(source, &name), vec![path(name)]].concat()).collect()
}

/// The imports between the modules inside a folder, files and folders, and which of them are folders.
fn inner_imports(source: &Path, folder: &str) -> (Imports, BTreeSet<String>) {
    let root = source.join(folder);
    let front = [root.join("mod.rs"), root.with_extension("rs")];
    let front = front.iter().find_map(|file| fs::read_to_string(file).ok()).expect("its file");
    let home = homes(&front.replace("#[cfg(test)]", ""));
    let mut imports = Imports::new();
    for file in files(&root) {
        let inner = file.strip_prefix(&root).expect("inside").with_extension("");
        let mut module: Vec<String> =
            inner.iter().map(|name| name.to_string_lossy().into_owned()).collect();
        if module.last().is_some_and(|name| name == "mod") {
            module.pop();
        }
        let Some(from) = module.first().cloned() else { continue };
        let to = imports.entry(from.clone()).or_default();
        let code = code(&file);
        let above = "super::".repeat(module.len());
        for prefix in [format!("crate::{}::", folder.replace('/', "::")), above] {
            // Other numbers of `super` lead to other folders.
            let code = code.replace(&format!("super::{prefix}"), "");
            to.extend(names(&code, &prefix).filter_map(|name| home.get(&name).cloned()));
        }
        to.remove(&from);
    }
    // A folder with files other than tests.
    let is_folder =
        |name: &&String| root.join(name).is_dir() && !files(&root.join(name)).is_empty();
    let folders = imports.keys().filter(is_folder).cloned().collect();
    (imports, folders)
}

/// Pairs of folders that import from each other, be it by way of files or of other folders.
fn mutual<'a>(imports: &'a Imports, folders: &'a BTreeSet<String>) -> Vec<(&'a str, &'a str)> {
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        imports.keys().map(|from| (from.as_str(), reached(imports, from))).collect();
    let pairs = folders.iter().flat_map(|one| folders.iter().map(move |other| (one, other)));
    let is_mutual = |&(one, other): &(&'a String, &'a String)| {
        one < other && reached[&**one].contains(&**other) && reached[&**other].contains(&**one)
    };
    pairs.filter(is_mutual).map(|(one, other)| (one.as_str(), other.as_str())).collect()
}

/// What a module imports from, and what these import from.
fn reached<'a>(imports: &'a Imports, from: &str) -> BTreeSet<&'a str> {
    let mut found = BTreeSet::new();
    let mut waiting: Vec<&'a str> = imports[from].iter().map(String::as_str).collect();
    while let Some(module) = waiting.pop() {
        if found.insert(module) {
            waiting.extend(imports.get(module).into_iter().flatten().map(String::as_str));
        }
    }
    found
}

/// The imports between the top folders of a crate.
fn imports(package: &str) -> Imports {
    let source = source(package);
    let lib = code(&source.join("lib.rs"));
    let home = homes(&lib);
    let mut imports = Imports::new();
    for file in files(&source) {
        let inner = file.strip_prefix(&source).expect("inside").with_extension("");
        let from = inner.iter().next().expect("a name").to_string_lossy().into_owned();
        if ["bin", "lib"].contains(&from.as_str()) {
            continue;
        }
        let to = imports.entry(from.clone()).or_default();
        to.extend(names(&code(&file), "crate::").filter_map(|name| home.get(&name).cloned()));
        to.remove(&from);
    }
    // A module without its own folder, such as `wire`, has no row.
    let rows: BTreeSet<String> = imports.keys().cloned().collect();
    imports.values_mut().for_each(|to| to.retain(|to| rows.contains(to)));
    imports
}

/// The rows of the page.
fn table(package: &str, imports: &Imports) -> String {
    let mut rows = format!("| {package} | imports from |\n|---|---|\n");
    for (from, to) in imports {
        let to = to.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
        rows.push_str(&format!("| {from} | {to} |\n"));
    }
    rows + "\n"
}

/// The folder of each name in `lib.rs`, modules among them.
fn homes(lib: &str) -> BTreeMap<String, String> {
    let mut home = BTreeMap::new();
    for statement in lib.split(';').map(str::trim) {
        if let Some((_, name)) = statement.rsplit_once("mod ") {
            home.insert(name.to_owned(), name.to_owned());
        } else if let Some((_, path)) = statement.rsplit_once("use ") {
            let path = path.trim_start_matches("crate::");
            let folder = words(path).next().unwrap_or_default();
            home.extend(words(path).skip(1).map(|name| (name, folder.clone())));
        }
    }
    home
}

/// The first name of every path after a prefix.
fn names(code: &str, prefix: &str) -> impl Iterator<Item = String> {
    code.split(prefix).skip(1).flat_map(|path| {
        let Some(group) = path.strip_prefix('{') else {
            return words(path).take(1).collect::<Vec<_>>();
        };
        let (mut depth, mut found, mut is_first) = (0, Vec::new(), true);
        for (at, character) in group.char_indices() {
            match character {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => is_first = true,
                c if is_first && c.is_alphabetic() => {
                    found.extend(words(&group[at..]).next());
                    is_first = false;
                }
                _ => (),
            }
        }
        found
    })
}

fn words(text: &str) -> impl Iterator<Item = String> {
    let is_other = |c: char| !c.is_alphanumeric() && c != '_';
    text.split(is_other).filter(|word| !word.is_empty()).map(str::to_owned)
}

/// A file without comments and unit tests.
fn code(file: &Path) -> String {
    let text = fs::read_to_string(file).expect("a source file");
    let ends = |(at, _): &(usize, &str)| {
        let line = text[*at..].lines().nth(1);
        line.is_some_and(|line| line.ends_with('{'))
    };
    let end = text.match_indices("#[cfg(test)]\nmod ").find(ends).map_or(text.len(), |(at, _)| at);
    let code = &text[..end];
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let inner = entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] });
    let is_source = |path: &PathBuf| {
        path.extension().is_some_and(|e| e == "rs")
            && path.file_stem().is_some_and(|s| s != "tests")
    };
    inner.filter(is_source).collect()
}
