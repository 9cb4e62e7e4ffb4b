//! Writes meshes to files: PLY, STL, OBJ and OFF.

use std::io::{self, Write};
use std::path::Path;

use glam::Vec3;

use crate::write::{WriteError, WriteErrorKind, write_atomically};
use crate::{Format, Mesh};

impl Format {
    /// The format of a file name's extension, in either case; binary for STL.
    ///
    /// # Errors
    /// [`WriteErrorKind::UnknownFormat`] for another extension.
    ///
    /// ```
    /// # use dibs_build::Format;
    /// assert_eq!(Format::from_name("heart.stl")?, Format::StlBinary);
    /// assert!(Format::from_name("heart.txt").is_err());
    /// # Ok::<(), dibs_build::WriteError>(())
    /// ```
    pub fn from_name(path: impl AsRef<Path>) -> Result<Self, WriteError> {
        let path = path.as_ref();
        let extension = path.extension().and_then(|extension| extension.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("ply") => Ok(Self::Ply),
            Some("stl") => Ok(Self::StlBinary),
            Some("obj") => Ok(Self::Obj),
            Some("off") => Ok(Self::Off),
            _ => Err(WriteError { path: path.to_path_buf(), kind: WriteErrorKind::UnknownFormat }),
        }
    }
}

impl Mesh {
    /// Writes the mesh. Text holds the shortest digits that give the same f32 numbers back; STL holds positions but no
    /// vertex numbers.
    ///
    /// # Errors
    /// [`WriteError`], also for a format that is only read; the file is complete or untouched.
    ///
    /// # Panics
    /// For STL, if a triangle names a vertex that the mesh does not have.
    pub fn write(&self, path: impl AsRef<Path>, format: Format) -> Result<(), WriteError> {
        let path = path.as_ref();
        let contents: fn(&Self, &mut dyn Write) -> io::Result<()> = match format {
            Format::Ply => ply,
            Format::StlBinary => stl,
            Format::StlAscii => ascii_stl,
            Format::Obj => obj,
            Format::Off => off,
            _ => {
                let kind = WriteErrorKind::UnknownFormat;
                return Err(WriteError { path: path.to_path_buf(), kind });
            }
        };
        write_atomically(path, |out| contents(self, out))
    }

    /// Writes a binary little-endian PLY file, whatever its name: f32 positions, 32-bit vertex numbers.
    ///
    /// # Errors
    /// [`WriteError`]; the file is complete or untouched.
    pub fn write_ply(&self, path: impl AsRef<Path>) -> Result<(), WriteError> {
        self.write(path, Format::Ply)
    }
}

fn ply(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    mesh.positions.iter().try_for_each(|&position| put(out, position))?;
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        for corner in triangle {
            out.write_all(&corner.to_le_bytes())?;
        }
    }
    Ok(())
}

fn stl(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let count = u32::try_from(mesh.triangles.len()).map_err(io::Error::other)?;
    // A header that does not begin with "solid", as text does.
    out.write_all(&[0; 80])?;
    out.write_all(&count.to_le_bytes())?;
    for &triangle in &mesh.triangles {
        let corners = mesh.corners(triangle);
        put(out, normal(corners))?;
        corners.into_iter().try_for_each(|corner| put(out, corner))?;
        out.write_all(&[0; 2])?;
    }
    Ok(())
}

fn ascii_stl(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "solid")?;
    for &triangle in &mesh.triangles {
        let corners = mesh.corners(triangle);
        let Vec3 { x, y, z } = normal(corners);
        writeln!(out, "facet normal {x} {y} {z}\nouter loop")?;
        for Vec3 { x, y, z } in corners {
            writeln!(out, "vertex {x} {y} {z}")?;
        }
        writeln!(out, "endloop\nendfacet")?;
    }
    writeln!(out, "endsolid")
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

fn obj(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    for Vec3 { x, y, z } in &mesh.positions {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [a, b, c] in mesh.triangles.iter().map(|corners| corners.map(|corner| corner + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

fn off(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "OFF\n{} {} 0", mesh.positions.len(), mesh.triangles.len())?;
    for Vec3 { x, y, z } in &mesh.positions {
        writeln!(out, "{x} {y} {z}")?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    Ok(())
}

fn put(out: &mut dyn Write, vector: Vec3) -> io::Result<()> {
    vector.to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))
}
