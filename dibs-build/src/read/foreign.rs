//! Files of kinds that are not read: each with its name, and the command that converts it.

use super::{ReadErrorKind, ReadTarget};
use std::path::Path;

/// How to convert a file to a mesh that can be read.
enum Remedy {
    Meshio,
    Assimp,
    Gmsh,
    FreeSurfer,
    Blender,
    Unpack,
    Segment,
    Motion,
    Fetch,
}

/// Position of a kind's mark in the file, the mark, the kind, and the remedy.
const MARKS: &[(usize, &[u8], &str, Remedy)] = &[
    (0, b"ISO-10303-21", "a STEP file", Remedy::Gmsh),
    (72, b"S      1", "an IGES file", Remedy::Gmsh),
    (0, b"DBRep_DrawableShape", "an Open CASCADE model", Remedy::Gmsh),
    (0, b"MeshVersionFormatted", "a Medit mesh", Remedy::Meshio),
    (0, b"*heading", "an Abaqus input file", Remedy::Meshio),
    (0, b"*node", "an Abaqus input file", Remedy::Meshio),
    (0, b"*part", "an Abaqus input file", Remedy::Meshio),
    (0, b"** ", "an Abaqus input file", Remedy::Meshio),
    (0, b"begin bulk", "a Nastran input file", Remedy::Meshio),
    (0, b"sol ", "a Nastran input file", Remedy::Meshio),
    (0, b"/prep7", "an Ansys input file", Remedy::Meshio),
    (0, b"\x89HDF", "an HDF5 file (MED, XDMF, CGNS)", Remedy::Meshio),
    (0, b"Kaydara FBX Binary", "an FBX scene", Remedy::Assimp),
    (0, b"; FBX", "an FBX scene", Remedy::Assimp),
    (0, b"BLENDER", "a Blender file", Remedy::Blender),
    (0, b"PXR-USDC", "a USD scene", Remedy::Blender),
    (0, b"#usda", "a USD scene", Remedy::Blender),
    (0, b"Ogawa", "an Alembic scene", Remedy::Blender),
    (0, b"xof ", "a DirectX mesh", Remedy::Assimp),
    (0, b"#VRML", "a VRML scene", Remedy::Assimp),
    (0, b"\xff\xff\xfe", "a FreeSurfer surface", Remedy::FreeSurfer),
    (0, b"NRRD000", "a volume image (NRRD)", Remedy::Segment),
    (0, b"ObjectType = Image", "a volume image (MetaImage)", Remedy::Segment),
    (128, b"DICM", "a DICOM image", Remedy::Segment),
    (344, b"n+1\0", "a volume image (NIfTI)", Remedy::Segment),
    (0, b"POINTCACHE2\0", "a motion (PC2)", Remedy::Motion),
    (0, b"\x93NUMPY", "a motion (NumPy)", Remedy::Motion),
    (0, b"version https://git-lfs", "a pointer of Git LFS in a mesh's place", Remedy::Fetch),
    (0, b"<!DOCTYPE html", "a web page", Remedy::Fetch),
    (0, b"<html", "a web page", Remedy::Fetch),
    (0, b"\x1f\x8b", "a compressed file (gzip)", Remedy::Unpack),
    (0, b"PK\x03\x04", "a compressed file (ZIP)", Remedy::Unpack),
];

/// The same for XML: the root element, the kind, and the remedy.
const ELEMENTS: &[(&[u8], &str, Remedy)] = &[
    (b"<COLLADA", "a COLLADA scene", Remedy::Assimp),
    (b"<X3D", "an X3D scene", Remedy::Assimp),
    (b"<GIFTI", "a GIFTI surface", Remedy::FreeSurfer),
    (b"<Xdmf", "an XDMF file", Remedy::Meshio),
    (b"<amf", "an AMF file", Remedy::Assimp),
];

/// The first element of an XML file is expected within this many bytes.
const BEGINNING: usize = 1024;

/// The error for a file of a kind that is known but not read.
pub(super) fn named(bytes: &[u8], path: &Path, wanted: ReadTarget) -> Option<ReadErrorKind> {
    let starts = |at: usize, mark: &[u8]| {
        let found = bytes.get(at..).and_then(|bytes| bytes.get(..mark.len()));
        found.is_some_and(|found| found.eq_ignore_ascii_case(mark))
    };
    let beginning = &bytes[..bytes.len().min(BEGINNING)];
    let has = |mark: &[u8]| beginning.windows(mark.len()).any(|window| window == mark);
    let mark = MARKS.iter().find(|(at, mark, ..)| starts(*at, mark));
    let mark = mark.map(|(_, _, what, remedy)| (what, remedy));
    let element = || {
        let found = ELEMENTS.iter().find(|(mark, ..)| starts(0, b"<") && has(mark));
        found.map(|(_, what, remedy)| (what, remedy))
    };
    let (what, remedy) = mark.or_else(element)?;
    Some(ReadErrorKind::Foreign { what: (*what).to_owned(), remedy: remedy.text(path, wanted) })
}

impl Remedy {
    fn text(&self, path: &Path, wanted: ReadTarget) -> String {
        let is_volume = wanted == ReadTarget::Volume;
        let old = path.display();
        let new = path.with_extension(if is_volume { "vtu" } else { "ply" });
        let new = new.display();
        match self {
            Self::Meshio => format!("convert it: `meshio convert {old} {new}` (pip install meshio)"),
            Self::Assimp => format!("convert it: `assimp export {old} {new}`"),
            Self::Gmsh => {
                let (what, dimension) = if is_volume { ("volume", 3) } else { ("surface", 2) };
                let new = path.with_extension("msh");
                format!("mesh its {what}: `gmsh {old} -{dimension} -o {}`", new.display())
            }
            Self::FreeSurfer => {
                format!("convert it: `mris_convert {old} {}`", path.with_extension("stl").display())
            }
            Self::Blender => "open it in Blender and export the mesh as PLY".to_owned(),
            Self::Unpack => "unpack it, and give the mesh that is in it".to_owned(),
            Self::Segment => {
                "it has no surface yet: segment it, in 3D Slicer for example, and export that as PLY"
                    .to_owned()
            }
            Self::Fetch => "fetch the mesh itself (`git lfs pull`, or another link)".to_owned(),
            Self::Motion => {
                let what = if is_volume { "volume" } else { "mesh" };
                format!("give the {what} here, and this file where a motion is asked for")
            }
        }
    }
}
