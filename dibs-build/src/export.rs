//! Writes meshes to files: PLY, STL, OBJ and OFF.

use std::io::{self, Write};
use std::path::Path;

use glam::{DVec3, Vec3};

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
    /// Writes the mesh in the coordinates of the file that it was read from: in single precision if its
    /// [origin](Mesh::origin) is zero, otherwise in double precision. Text holds the shortest digits that give the same
    /// numbers back; STL holds positions but no vertex numbers.
    ///
    /// # Errors
    /// [`WriteError`]. Also for a format that is only read, and for binary STL, which is of single precision, if the
    /// origin is not zero. The file is complete or untouched.
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
        if format == Format::StlBinary && self.is_recentred() {
            return Err(WriteError { path: path.to_path_buf(), kind: WriteErrorKind::TooFar });
        }
        write_atomically(path, |out| contents(self, out))
    }

    /// Writes a binary little-endian PLY file, with any name: 32-bit vertex numbers, and positions in f32, or in f64 if the
    /// mesh has an [origin](Mesh::origin) other than zero.
    ///
    /// # Errors
    /// [`WriteError`]; the file is complete or untouched.
    pub fn write_ply(&self, path: impl AsRef<Path>) -> Result<(), WriteError> {
        self.write(path, Format::Ply)
    }

    fn is_recentred(&self) -> bool {
        self.origin != DVec3::ZERO
    }

    /// A position as text.
    fn text(&self, position: Vec3) -> String {
        if self.is_recentred() {
            let DVec3 { x, y, z } = self.origin + position.as_dvec3();
            return format!("{x} {y} {z}");
        }
        let Vec3 { x, y, z } = position;
        format!("{x} {y} {z}")
    }
}

fn ply(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let number = if mesh.is_recentred() { "double" } else { "float" };
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\n\
         element vertex {}\nproperty {number} x\nproperty {number} y\nproperty {number} z\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    for &position in &mesh.positions {
        if mesh.is_recentred() {
            let exact = mesh.origin + position.as_dvec3();
            exact.to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
        } else {
            put(out, position)?;
        }
    }
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
    // A header that does not begin with "solid", as text STL does.
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
        for corner in corners {
            writeln!(out, "vertex {}", mesh.text(corner))?;
        }
        writeln!(out, "endloop\nendfacet")?;
    }
    writeln!(out, "endsolid")
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

fn obj(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    for &position in &mesh.positions {
        writeln!(out, "v {}", mesh.text(position))?;
    }
    for [a, b, c] in mesh.triangles.iter().map(|corners| corners.map(|corner| corner + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

fn off(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "OFF\n{} {} 0", mesh.positions.len(), mesh.triangles.len())?;
    for &position in &mesh.positions {
        writeln!(out, "{}", mesh.text(position))?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    Ok(())
}

fn put(out: &mut dyn Write, vector: Vec3) -> io::Result<()> {
    vector.to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))
}
