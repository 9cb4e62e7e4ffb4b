//! The software bills of materials, `CycloneDX` 1.5: `docs/evidence/sbom/`, which `DIBS_WRITE=1` writes anew.
//!
//! Components and their dependencies are cargo's own for the target; hashes are those of `Cargo.lock`, and a missing
//! component fails. They contain neither a time nor a random number, so that the same commit gives the same bytes.
//! (`cargo cyclonedx` 0.5.9 unites the features of the workspace, so that its list for the core contains a cipher that
//! is not linked, and every reference contains the checkout's folder.)

// Requirement: E-03

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::page::{self, REPOSITORY};

/// Output files, each with the package and its features, and the target.
const BILLS: [(&str, &[&str], &str); 3] = [
    ("core", &["-p", "dibs-nostd"], "thumbv7em-none-eabihf"),
    ("firmware", &["-p", "firmware-example", "--features", "board"], "thumbv7em-none-eabihf"),
    ("program", &["-p", "dibs-cli"], "x86_64-unknown-linux-gnu"),
];

/// Edges of linked packages; and of those that also run at compile time.
const LINKED: &str = "normal,no-proc-macro";
const ALL: &str = "normal,build";

#[test]
fn the_bills_are_cargos_for_each_target() {
    let lock = fs::read_to_string(Path::new(REPOSITORY).join("Cargo.lock")).expect("the lock");
    let locked = locked(&lock);
    for (name, package, target) in BILLS {
        let [linked, all] =
            [LINKED, ALL].map(|edges| Tree::read(&cargo_tree(package, target, edges)));
        let kind = if name == "core" { "library" } else { "application" };
        let bill = bill(&linked, &all, &locked, [kind, target])
            .unwrap_or_else(|missing| panic!("{name}: {missing}"));
        let text = serde_json::to_string_pretty(&bill).expect("JSON") + "\n";
        page::keep(&format!("sbom/{name}.cdx.json"), &text);
    }
}

/// Packages with their depths, one a line.
fn cargo_tree(package: &[&str], target: &str, edges: &str) -> String {
    let mut cargo = Command::new("cargo");
    cargo.args(["tree", "--locked", "--quiet", "--no-dedupe", "--prefix", "depth"]).args(package);
    cargo.args(["--target", target, "--edges", edges, "--format", "|{p}|{l}"]);
    let output = cargo.current_dir(REPOSITORY).output().expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// Name and version.
type Package = (String, String);

/// Packages with their licences and dependencies.
#[derive(Default)]
struct Tree {
    root: Option<Package>,
    licences: BTreeMap<Package, String>,
    needs: BTreeMap<Package, BTreeSet<Package>>,
}

impl Tree {
    fn read(text: &str) -> Self {
        let (mut tree, mut above) = (Self::default(), Vec::new());
        for line in text.lines() {
            let mut cells = line.split('|');
            let mut next = || cells.next().expect("three cells");
            let (depth, name, licence) = (next(), next(), next());
            let depth: usize = depth.parse().expect("a depth");
            let mut words = name.split(' ');
            let (Some(name), Some(version)) = (words.next(), words.next()) else {
                panic!("{line}")
            };
            let package = (name.to_owned(), version.trim_start_matches('v').to_owned());
            above.truncate(depth);
            if let Some(parent) = above.last() {
                tree.needs.entry(Package::clone(parent)).or_default().insert(package.clone());
            }
            tree.root.get_or_insert_with(|| package.clone());
            tree.licences.insert(package.clone(), licence.replace('/', " OR "));
            above.push(package);
        }
        tree
    }
}

/// The packages of a lock file with their checksums; those of the workspace have none.
fn locked(lock: &str) -> BTreeMap<Package, Option<String>> {
    let value = |block: &str, key: &str| {
        let line = block.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = \""));
        line.map(|line| line.trim_end_matches('"').to_owned())
    };
    let blocks = lock.split("[[package]]").skip(1);
    let package = |block: &str| {
        Some(((value(block, "name")?, value(block, "version")?), value(block, "checksum")))
    };
    blocks.filter_map(package).collect()
}

/// The bill of materials, or the package that the lock file lacks.
fn bill(
    linked: &Tree,
    all: &Tree,
    locked: &BTreeMap<Package, Option<String>>,
    [kind, target]: [&str; 2],
) -> Result<Value, String> {
    let root = linked.root.as_ref().ok_or("nothing is linked")?;
    let reference = |(name, version): &Package| format!("pkg:cargo/{name}@{version}");
    let component = |package: &Package, licence: &String| {
        let checksum = locked
            .get(package)
            .ok_or_else(|| format!("{} is not in the lock", reference(package)))?;
        let scope = if linked.licences.contains_key(package) { "required" } else { "excluded" };
        let mut component = json!({
            "type": if package == root { kind } else { "library" },
            "bom-ref": reference(package),
            "name": package.0,
            "version": package.1,
            "scope": scope,
            "licenses": [{ "expression": licence }],
            "purl": reference(package),
        });
        if let Some(checksum) = checksum {
            component["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
        }
        Ok::<_, String>(component)
    };
    let mut components = Vec::new();
    for (package, licence) in all.licences.iter().filter(|(package, _)| *package != root) {
        components.push(component(package, licence)?);
    }
    let needs = all.licences.keys().map(|package| {
        let on: Vec<_> = all.needs.get(package).into_iter().flatten().map(reference).collect();
        json!({ "ref": reference(package), "dependsOn": on })
    });
    Ok(json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": component(root, &all.licences[root])?,
            "properties": [{ "name": "cdx:rustc:sbom:target:triple", "value": target }],
        },
        "components": components,
        "dependencies": needs.collect::<Vec<_>>(),
    }))
}

#[test]
fn a_component_that_is_not_locked_is_found() {
    let lock = "[[package]]\nname = \"a\"\nversion = \"1.0.0\"\n\n[[package]]\nname = \"b\"\nversion = \"2.0.0\"\nchecksum = \"00\"\n";
    let linked = Tree::read("0|a v1.0.0 (/folder)|MIT\n1|b v2.0.0|MIT/Zlib\n");
    let all = Tree::read(
        "0|a v1.0.0 (/folder)|MIT\n1|b v2.0.0|MIT/Zlib\n2|c v3.0.0|MIT\n1|c v3.0.0|MIT\n",
    );
    let found = bill(&linked, &linked, &locked(lock), ["library", "here"]).expect("all are locked");
    assert_eq!(found["components"][0]["licenses"][0]["expression"], "MIT OR Zlib");
    assert_eq!(found["components"][0]["hashes"][0]["content"], "00");
    assert_eq!(found["dependencies"][0]["dependsOn"], json!(["pkg:cargo/b@2.0.0"]));
    let missing = bill(&linked, &all, &locked(lock), ["library", "here"]);
    assert_eq!(missing.expect_err("c is not locked"), "pkg:cargo/c@3.0.0 is not in the lock");
}
