//! Converts a file's groups of faces to labels of triangles.

use super::{Format, ReadErrorKind};
use serde::{Deserialize, Serialize};

/// The labels of a mesh's triangles, from the groups of its file: [`ReadOptions::groups`](super::ReadOptions::groups).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Groups {
    /// A label for each triangle of the mesh.
    pub labels: Vec<u8>,
    /// The labels that occur, in ascending order.
    pub groups: Vec<Group>,
}

/// The triangles of a label.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// The label.
    pub label: u8,
    /// Its name in the file; empty where the file has none.
    pub name: String,
    /// Its triangles.
    pub triangles: usize,
}

/// The groups of a file's faces, as the file has them.
#[derive(Default)]
pub(crate) struct FaceGroups {
    /// The group number of each face. Whether a number is a valid label is checked last, since faces may be dropped.
    pub of_face: Vec<f64>,
    /// Names of group numbers.
    pub names: Vec<(f64, String)>,
}

impl FaceGroups {
    /// The number of a name. Names are numbered in the order of their first use.
    pub fn number(&mut self, name: &str) -> f64 {
        if let Some(&(number, _)) = self.names.iter().find(|(_, other)| other == name) {
            return number;
        }
        let number = self.names.len() as f64;
        self.names.push((number, name.to_owned()));
        number
    }

    /// The labels of triangles that come from these faces, which are counted from 1.
    ///
    /// # Errors
    /// [`ReadErrorKind::Label`] where a group's number is not a label, [`ReadErrorKind::ManyGroups`] where there are
    /// more names than labels.
    pub fn labels(
        &self,
        faces: impl Iterator<Item = usize>,
        is_named: bool,
    ) -> Result<Groups, ReadErrorKind> {
        if is_named && self.names.len() > MOST {
            return Err(ReadErrorKind::ManyGroups { groups: self.names.len(), most: MOST });
        }
        let label = |face: usize| {
            let value = self.of_face.get(face - 1).copied().unwrap_or(f64::NAN);
            let is_label = (0.0..MOST as f64).contains(&value) && value.fract() == 0.0;
            is_label.then_some(value as u8).ok_or(ReadErrorKind::Label { face, value })
        };
        let labels = faces.map(label).collect::<Result<Vec<u8>, _>>()?;
        let name = |label: u8| {
            let found = self.names.iter().find(|(number, _)| *number == f64::from(label));
            found.map_or(String::new(), |(_, name)| name.clone())
        };
        let group = |label: u8| {
            let triangles = labels.iter().filter(|&&other| other == label).count();
            (triangles > 0).then(|| Group { label, name: name(label), triangles })
        };
        Ok(Groups { groups: (0..=u8::MAX).filter_map(group).collect(), labels })
    }
}

/// Number of possible labels.
const MOST: usize = 256;

/// For a file that has no groups: how its format would state them.
pub(super) fn expected(format: Format) -> &'static str {
    match format {
        Format::Obj => "an OBJ file has them as statements `g` or `usemtl`",
        Format::Gmsh => "a Gmsh file has them as physical groups of surfaces",
        Format::Vtk | Format::Vtp => {
            "a VTK file has them as cell data named label, labels or RegionId"
        }
        _ => "they are read of OBJ, VTK and Gmsh",
    }
}

/// Whether cell data of this name are labels.
pub(super) fn is_name(name: &str) -> bool {
    ["label", "labels", "regionid"].iter().any(|known| name.eq_ignore_ascii_case(known))
}
