//! Reads whole files, and bounds memory by their length.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The bytes of a regular file.
///
/// # Errors
/// Those of the operating system. Also for a folder, and for a pipe or a device, which have no length: reading them may
/// block, or fill the memory.
pub(crate) fn whole(path: &Path) -> io::Result<Vec<u8>> {
    first(path, u64::MAX)
}

/// The first bytes of a regular file: at most `most`, fewer where it is shorter.
///
/// # Errors
/// As [`whole`].
pub(crate) fn first(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    // Checked before the file is opened as well, since opening a pipe blocks until its other end is open.
    check(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    check(&metadata)?;
    let length = metadata.len().min(most);
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn check(metadata: &std::fs::Metadata) -> io::Result<()> {
    let (kind, what) = match metadata {
        metadata if metadata.is_file() => return Ok(()),
        metadata if metadata.is_dir() => (io::ErrorKind::IsADirectory, "it is a folder"),
        _ => (
            io::ErrorKind::InvalidInput,
            "it is a pipe or a device; save its content as a file first",
        ),
    };
    Err(io::Error::new(kind, what))
}

/// The text of a regular file.
///
/// # Errors
/// As [`whole`]. Also where it is not UTF-8.
pub(crate) fn text(path: &Path) -> io::Result<String> {
    String::from_utf8(whole(path)?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not text in UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_read_than_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "abc").unwrap();
        assert_eq!(whole(&path).unwrap(), b"abc");
        assert_eq!(first(&path, 2).unwrap(), b"ab");
        assert_eq!(first(&path, u64::MAX).unwrap(), b"abc");
        assert_eq!(whole(folder.path()).unwrap_err().kind(), io::ErrorKind::IsADirectory);
    }

    /// A device returns bytes without end, and a pipe without a writer blocks its reader.
    #[cfg(unix)]
    #[test]
    fn devices_and_pipes_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        for path in [Path::new("/dev/zero"), &pipe] {
            for most in [36, u64::MAX] {
                let error = first(path, most).unwrap_err();
                assert!(error.to_string().contains("pipe or a device"), "{error}");
            }
        }
    }
}
