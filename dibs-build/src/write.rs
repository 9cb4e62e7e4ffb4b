//! Output files appear complete or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file that could not be written. An older file there is untouched.
#[derive(Debug, Error)]
#[error("{}: {kind}", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// The reason.
    pub kind: WriteErrorKind,
}

/// Why a file cannot be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WriteErrorKind {
    /// The operating system's error.
    #[error("cannot be written ({0}); check that the folder exists and has room")]
    Io(#[from] io::Error),
    /// The frames of a motion differ in length.
    #[error("frame {frame} of the motion has {found} vertices, the first has {expected}")]
    UnevenFrames {
        /// The first frame that differs, counted from 0.
        frame: usize,
        /// Vertices of the first frame.
        expected: usize,
        /// Vertices of this one.
        found: usize,
    },
    /// A name without the extension of a format that can be written.
    #[error("a mesh is written as what its name ends in: .ply, .stl, .obj or .off")]
    UnknownFormat,
    /// A format of single precision, for a mesh that f32 does not hold where it lies.
    #[error(
        "the mesh lies too far from the origin for the numbers of binary STL; write it as .ply"
    )]
    TooFar,
    /// The same for a motion.
    #[error(
        "the motion counts from an origin that PC2 cannot store; set it to zero to write positions that count from there"
    )]
    MotionTooFar,
    /// More elements than the format can count.
    #[error("{count} {element} are more than the format can count")]
    TooMany {
        /// The counted element.
        element: &'static str,
        /// Their number.
        count: usize,
    },
}

/// Writes a file through `contents` into a temporary file beside it, which is renamed once it is complete and synced.
/// So a failure of the program leaves no half-written output, and a power failure none under the file's name, if disk
/// and file system honour `fsync`. A path that is not a regular file (`/dev/stdout`) is written directly.
///
/// # Errors
/// [`WriteErrorKind::Io`], also for an error of `contents`.
pub fn write_atomically(
    path: impl AsRef<Path>,
    contents: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let path = path.as_ref();
    write(path, contents).map_err(|e| WriteError { path: path.to_path_buf(), kind: e.into() })
}

fn write(path: &Path, contents: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    // A link stays a link: its target is replaced.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    if target.metadata().is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir()) {
        return fill(&File::create(&target)?, contents);
    }
    let folder = match target.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        // The mode of any new file, less the process's umask.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let temporary = builder.prefix(".dibs-").tempfile_in(folder)?;
    fill(temporary.as_file(), contents)?;
    temporary.as_file().sync_all()?;
    temporary.persist(&target)?;
    // The folder holds the name: without this sync the old file may come back. Not every system can open a folder.
    #[cfg(unix)]
    File::open(folder)?.sync_all()?;
    Ok(())
}

fn fill(file: &File, contents: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut buffered = BufWriter::new(file);
    contents(&mut buffered)?;
    buffered.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;

    #[test]
    fn failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.ply");
        write_atomically(&path, |out| out.write_all(b"old")).unwrap();
        let error = write_atomically(&path, |out| {
            out.write_all(b"half of the new one")?;
            Err(io::Error::other("no room"))
        })
        .unwrap_err();
        assert!(error.to_string().contains("no room"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        write_atomically(&path, |out| out.write_all(b"new")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn missing_folder_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent").join("out.ply");
        let error = Mesh::default().write_ply(&path).unwrap_err();
        assert!(error.to_string().contains("out.ply"), "{error}");
    }
}
