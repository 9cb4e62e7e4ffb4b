//! A numbered series of mesh files, each a frame: `heart_%03d.vtp`.

use crate::Motion;
use crate::read::{Format, Place, ReadError, ReadErrorKind, elements};
use glam::Vec3;
use std::path::{Path, PathBuf};

/// Files of one name but for a number.
pub(super) struct Series<'a> {
    path: &'a Path,
    before: &'a str,
    after: &'a str,
    /// Digits of a number that zeros fill up.
    width: usize,
}

impl<'a> Series<'a> {
    /// The series that a file's name with `%d` or `%03d` means.
    pub fn named(path: &'a Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let (before, rest) = name.split_once('%')?;
        let (width, after) = rest.split_once('d')?;
        let is_number = width.is_empty() || width.starts_with('0');
        let width = if width.is_empty() { 0 } else { width.parse().ok()? };
        (is_number && !path.exists()).then_some(Self { path, before, after, width })
    }

    fn file(&self, number: u64) -> PathBuf {
        let Self { before, after, width, .. } = self;
        self.path.with_file_name(format!("{before}{number:0width$}{after}"))
    }

    /// The numbers that there are, in their order.
    fn numbers(&self) -> Result<Vec<u64>, std::io::Error> {
        let folder = self.path.parent().filter(|folder| *folder != Path::new(""));
        let mut numbers = Vec::new();
        for entry in std::fs::read_dir(folder.unwrap_or(Path::new(".")))? {
            let name = entry?.file_name();
            let digits = name.to_str().and_then(|name| name.strip_prefix(self.before));
            let digits = digits.and_then(|digits| digits.strip_suffix(self.after));
            let number = digits.and_then(|digits| digits.parse().ok());
            let is_named_so = |number: &u64| self.file(*number).file_name() == Some(&name);
            numbers.extend(number.filter(is_named_so));
        }
        numbers.sort_unstable();
        Ok(numbers)
    }

    pub fn read(&self, place: &Place) -> Result<Motion, ReadError> {
        let fail = |path: &Path, kind| ReadError { path: path.to_path_buf(), kind };
        let numbers = self.numbers().map_err(|error| fail(self.path, error.into()))?;
        let Some(&first) = numbers.first() else {
            return Err(fail(self.path, ReadErrorKind::NoSeries));
        };
        let mut triangles = None;
        let mut frames = Vec::with_capacity(numbers.len());
        for (number, found) in (first..).zip(&numbers) {
            let path = self.file(number);
            if number != *found {
                return Err(fail(&path, ReadErrorKind::Gap { next: *found }));
            }
            let frame = frame(&path, number - first, &mut triangles, place);
            frames.push(frame.map_err(|kind| fail(&path, kind))?);
        }
        Ok(Motion { frames, rate: 0.0, origin: place.origin })
    }
}

/// Reads the positions in a file. Polygons that differ from the first file's are an error.
fn frame(
    path: &Path,
    number: u64,
    polygons: &mut Option<(Vec<u32>, Vec<usize>)>,
    place: &Place,
) -> Result<Vec<Vec3>, ReadErrorKind> {
    let (format, raw) = elements(std::fs::read(path)?, path, false)?;
    if matches!(format, Format::StlAscii | Format::StlBinary) {
        return Err(ReadErrorKind::UnnumberedFrame);
    }
    let of_first = polygons.get_or_insert_with(|| (raw.corners.clone(), raw.ends.clone()));
    if *of_first != (raw.corners, raw.ends) {
        return Err(ReadErrorKind::OtherTriangles);
    }
    super::frame(&raw.positions, number as usize, place)
}
