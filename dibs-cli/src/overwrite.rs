//! No output may replace an input or another output.

// Requirement: P-08

use anyhow::{Result, bail};
use dibs_build::files_of;
use std::fs::Metadata;
use std::path::{Path, PathBuf};

/// The file that a path refers to, whatever the path's spelling, links and hard links.
#[derive(PartialEq, Eq)]
enum Identity {
    #[cfg(unix)]
    File { device: u64, inode: u64 },
    #[cfg(not(unix))]
    File(PathBuf),
    /// A file that does not exist yet: its folder, and its name.
    New(PathBuf, std::ffi::OsString),
}

impl Identity {
    /// `None` if nothing can be lost: for a device, or a path that cannot be written.
    fn of(path: &Path) -> Option<Self> {
        match path.metadata() {
            Ok(metadata) => metadata.is_file().then(|| Self::of_file(path, &metadata)).flatten(),
            Err(_) => {
                let folder = match path.parent() {
                    Some(folder) if folder != Path::new("") => folder,
                    _ => Path::new("."),
                };
                Some(Self::New(folder.canonicalize().ok()?, path.file_name()?.to_owned()))
            }
        }
    }

    #[cfg(unix)]
    fn of_file(_path: &Path, metadata: &Metadata) -> Option<Self> {
        use std::os::unix::fs::MetadataExt;
        Some(Self::File { device: metadata.dev(), inode: metadata.ino() })
    }

    #[cfg(not(unix))]
    fn of_file(path: &Path, _metadata: &Metadata) -> Option<Self> {
        path.canonicalize().ok().map(Self::File)
    }
}

/// Fails if an output is an input, or a file that an input consists of, or another output. `-` is standard input or
/// output; results may be redirected to a file as well.
pub fn check<'a>(
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    outputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<()> {
    let is_stream = |path: &Path| path == Path::new("-");
    let inputs: Vec<PathBuf> =
        inputs
            .into_iter()
            .flat_map(|path| {
                if is_stream(path) { vec![PathBuf::from("/dev/stdin")] } else { files_of(path) }
            })
            .collect();
    // A missing input is reported by its reader.
    let inputs = inputs.iter().filter(|path| path.exists());
    let inputs: Vec<_> = inputs.map(|path| (path, Identity::of(path))).collect();
    let printed = PathBuf::from("/dev/stdout");
    let outputs = outputs.into_iter().filter(|path| !is_stream(path));
    let outputs: Vec<&Path> = outputs.map(AsRef::as_ref).collect();
    let mut before: Vec<(&Path, Identity)> = Vec::new();
    for output in [printed.as_path()].into_iter().chain(outputs) {
        let Some(identity) = Identity::of(output) else { continue };
        let name = output.display();
        if let Some((input, _)) = inputs.iter().find(|(_, other)| other.as_ref() == Some(&identity))
        {
            bail!(
                "{name}: this output is the same file as the input {}; give the output another name",
                input.display()
            );
        }
        if let Some((other, _)) = before.iter().find(|(_, other)| *other == identity) {
            bail!(
                "{name}: this output is the same file as the output {}; give each its own name",
                other.display()
            );
        }
        // Results that are printed to the same file lose nothing: the output replaces the file.
        if output != printed {
            before.push((output, identity));
        }
    }
    Ok(())
}
