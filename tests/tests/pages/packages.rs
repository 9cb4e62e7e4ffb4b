//! The sources of the published crates refer to no page that is not in their package.

// Requirement: E-04

use std::path::{Path, PathBuf};
use std::{env, fs};

#[test]
fn the_packages_are_whole() {
    let mut references = 0;
    for package in ["dibs-nostd", "dibs-build", "dibs-stream", "dibs-cli"] {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(package);
        for file in ["README.md", "LICENSE-MIT", "LICENSE-APACHE"] {
            assert!(root.join(file).is_file(), "{package} has no {file}");
        }
        for source in files(&root.join("src")) {
            let text = fs::read_to_string(&source).expect("a source file");
            for (at, _) in text.match_indices("docs/") {
                let is_elsewhere = text[..at].ends_with("the repository's `")
                    || text[..at].ends_with("`dibs-nostd`'s `");
                let path: String = text[at..].chars().take_while(|c| is_of_path(*c)).collect();
                let path = path.trim_end_matches('.');
                references += 1;
                assert!(
                    is_elsewhere || root.join(path).is_file(),
                    "{}: {path} is not in the package",
                    source.display()
                );
            }
        }
    }
    assert!(references > 0, "no reference to docs was found");
}

fn is_of_path(c: char) -> bool {
    c.is_ascii_alphanumeric() || ['/', '-', '.'].contains(&c)
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let paths =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}
