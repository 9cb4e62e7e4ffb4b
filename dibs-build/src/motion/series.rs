//! A numbered series of mesh files, each a frame: `heart_%03d.vtp`.

use crate::read::{self, ReadError, ReadErrorKind, ReadTarget};
use crate::{Motion, Unit};
use glam::{DVec3, Vec3};
use std::path::{Path, PathBuf};

/// Files whose names differ only in a number.
pub(super) struct Series<'a> {
    path: &'a Path,
    before: &'a str,
    after: &'a str,
    /// Digits that a number is padded to with leading zeros; `None` for any.
    width: Option<usize>,
}

impl<'a> Series<'a> {
    /// The series that a file name with `%d` or `%03d` stands for.
    pub fn named(path: &'a Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let (before, rest) = name.split_once('%')?;
        let (width, after) = rest.split_once('d')?;
        let is_number = width.is_empty() || width.starts_with('0');
        let width = if width.is_empty() { None } else { Some(width.parse().ok()?) };
        (is_number && !path.exists()).then_some(Self { path, before, after, width })
    }

    /// The path of a number's file, whether it exists or not.
    fn file(&self, number: u64, width: usize) -> PathBuf {
        let Self { before, after, .. } = self;
        self.path.with_file_name(format!("{before}{number:0width$}{after}"))
    }

    /// The numbers that exist and their files, in ascending order.
    pub fn files(&self) -> Result<Vec<(u64, PathBuf)>, std::io::Error> {
        let folder = self.path.parent().filter(|folder| *folder != Path::new(""));
        let mut files = Vec::new();
        for entry in std::fs::read_dir(folder.unwrap_or(Path::new(".")))? {
            let name = entry?.file_name();
            let digits = name.to_str().and_then(|name| name.strip_prefix(self.before));
            let digits = digits.and_then(|digits| digits.strip_suffix(self.after));
            let digits = digits.filter(|digits| digits.bytes().all(|digit| digit.is_ascii_digit()));
            let Some(digits) = digits else { continue };
            // Leading zeros may only pad to the requested width, if one is given.
            let is_filled = digits.len() > 1 && digits.starts_with('0');
            let fits = self
                .width
                .is_none_or(|width| digits.len() == width || digits.len() > width && !is_filled);
            if let (true, Ok(number)) = (fits, digits.parse()) {
                files.push((number, self.path.with_file_name(&name)));
            }
        }
        files.sort_unstable();
        Ok(files)
    }

    pub fn read(
        &self,
        wanted: ReadTarget,
        unit: Option<Unit>,
        origin: DVec3,
    ) -> Result<Motion, ReadError> {
        let fail = |path: &Path, kind| ReadError { path: path.to_path_buf(), kind };
        let files = self.files().map_err(|error| fail(self.path, error.into()))?;
        let Some((first, path)) = files.first() else {
            return Err(fail(self.path, ReadErrorKind::NoSeries));
        };
        let others = self.before.len() + self.after.len();
        let width = path.file_name().map_or(0, |name| name.len() - others);
        let mut faces = None;
        let mut frames = Vec::with_capacity(files.len());
        for (number, (found, path)) in (*first..).zip(&files) {
            if *found < number {
                return Err(fail(path, ReadErrorKind::Twice));
            }
            if *found > number {
                let missing = self.file(number, width);
                return Err(fail(&missing, ReadErrorKind::Gap { next: *found }));
            }
            let frame = frame(path, wanted, number - first, &mut faces, unit, origin);
            frames.push(frame.map_err(|kind| fail(path, kind))?);
        }
        Ok(Motion { frames, rate: 0.0, origin, faces: faces.unwrap_or_default() })
    }
}

/// Reads the positions in a file. Faces that differ from the first file's are an error.
fn frame(
    path: &Path,
    wanted: ReadTarget,
    number: u64,
    of_first: &mut Option<Vec<Vec<u32>>>,
    unit: Option<Unit>,
    origin: DVec3,
) -> Result<Vec<Vec3>, ReadErrorKind> {
    let (positions, faces) = read::frame(path, wanted, number as usize, unit, origin)?;
    if *of_first.get_or_insert_with(|| faces.clone()) != faces {
        return Err(ReadErrorKind::OtherTriangles);
    }
    Ok(positions)
}
