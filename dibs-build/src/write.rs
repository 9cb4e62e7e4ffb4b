//! Writes output files so that they appear complete or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file that could not be written. An older file of that name is untouched.
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
    /// A name whose extension is of no format that can be written.
    #[error("a mesh is written as what its name ends in: .ply, .stl, .obj or .off")]
    UnknownFormat,
    /// A format of single precision, but f32 cannot represent the mesh at its position.
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

/// Writes a file through `contents` into a temporary file in the same folder, which takes the name once it is complete
/// and synced. So a failure of the program leaves no half-written output, and a power failure none under the file's
/// name, if disk and file system honour `fsync`. On Linux the temporary file has no name if the file system supports
/// that, so a killed program leaves none behind. A path that is not a regular file (`/dev/stdout`) is written directly.
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
    // A symbolic link stays a link: its target is replaced.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    if target.metadata().is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir()) {
        return fill(&File::create(&target)?, contents);
    }
    let folder = match target.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    match nameless::file(folder) {
        Some(file) => {
            fill(&file, contents)?;
            file.sync_all()?;
            nameless::persist(&file, folder, &target)?;
        }
        None => {
            let temporary = builder().tempfile_in(folder)?;
            fill(temporary.as_file(), contents)?;
            temporary.as_file().sync_all()?;
            temporary.persist(&target)?;
        }
    }
    // The name is stored in the folder: without this sync the old file may come back. Not every system can open a
    // folder.
    #[cfg(unix)]
    File::open(folder)?.sync_all()?;
    Ok(())
}

fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        // The mode that any new file gets: without the bits of the process's umask.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.prefix(".dibs-");
    builder
}

/// A temporary file without a name: nothing is left of it once its program has ended, in whatever way.
#[cfg(target_os = "linux")]
mod nameless {
    use rustix::fs::{AtFlags, CWD, Mode, OFlags};
    use std::fs::File;
    use std::io::{self, ErrorKind};
    use std::os::fd::AsRawFd;
    use std::path::{Path, PathBuf};

    /// `None` if the file system does not support such files, or cannot give them a name.
    pub fn file(folder: &Path) -> Option<File> {
        let flags = OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC;
        let file = File::from(rustix::fs::open(folder, flags, Mode::from(0o666)).ok()?);
        name(&file).exists().then_some(file)
    }

    /// Gives the file the name `target`, in place of an older file's.
    pub fn persist(file: &File, folder: &Path, target: &Path) -> io::Result<()> {
        match link(file, target) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                // A link cannot replace a file, so the file first gets a temporary name.
                super::builder().make_in(folder, |path| link(file, path))?.persist(target)?;
                Ok(())
            }
            linked => linked,
        }
    }

    fn link(file: &File, path: &Path) -> io::Result<()> {
        Ok(rustix::fs::linkat(CWD, name(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
    }

    /// The path of an open file in `/proc`.
    fn name(file: &File) -> PathBuf {
        PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()))
    }
}

/// Other systems have no such files.
#[cfg(not(target_os = "linux"))]
mod nameless {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    pub fn file(_folder: &Path) -> Option<File> {
        None
    }

    pub fn persist(_file: &File, _folder: &Path, _target: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
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

    /// While a file is written its folder shows no other file, so a killed program leaves none.
    #[cfg(target_os = "linux")]
    #[test]
    fn nothing_is_seen_of_a_file_until_it_is_complete() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        if nameless::file(folder.path()).is_none() {
            println!("skipped: the file system has no files without a name");
            return;
        }
        let path = folder.path().join("out.ply");
        let names = || std::fs::read_dir(folder.path()).unwrap().count();
        for (before, text) in [(0, b"one".as_slice()), (1, b"two")] {
            write_atomically(&path, |out| {
                out.write_all(text)?;
                out.flush()?;
                assert_eq!(names(), before);
                Ok(())
            })
            .unwrap();
            assert_eq!((std::fs::read(&path).unwrap().as_slice(), names()), (text, 1));
        }
        let other = folder.path().join("other");
        std::fs::write(&other, "").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&other));
    }

    #[test]
    fn missing_folder_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent").join("out.ply");
        let error = Mesh::default().write_ply(&path).unwrap_err();
        assert!(error.to_string().contains("out.ply"), "{error}");
    }
}
