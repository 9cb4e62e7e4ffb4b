//! The header: its fields, read and checked.

use crate::tree::format::field as at;
use crate::tree::format::{
    CRC, HEADER_BYTES, MAGIC, MAX_ROOTS, MAX_STACK, PathKind, VERSION, u32_at,
};
use crate::tree::{FormatError, Index, Unit};

/// The header's fields used by queries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Header {
    pub paths: PathKind,
    pub mesh_id: u32,
    pub vertices: u32,
    pub triangles: u32,
    pub nodes: u32,
    pub stack: u32,
    pub stretch: f32,
    pub radius_unit: f32,
    pub position_error: f32,
    /// 1 if there is an origin section, else 0.
    pub origin: u32,
    /// Number of roots less one. The roots are the first rows of the node table.
    pub other_roots: u32,
    /// Rows of the section table.
    pub sections: u32,
    /// The code of the file's unit.
    pub unit: u32,
    pub file_vertices: u32,
    pub file_triangles: u32,
    pub checksum: u32,
}

impl Header {
    /// Checks that these values still equal those in the bytes.
    pub fn check(&self, bytes: &[u8]) -> Result<(), FormatError> {
        for (offset, value) in [
            (at::MESH_ID, self.mesh_id),
            (at::VERTICES, self.vertices),
            (at::TRIANGLES, self.triangles),
            (at::NODES, self.nodes),
            (at::STACK, self.stack),
            (at::STRETCH, self.stretch.to_bits()),
            (at::RADIUS_UNIT, self.radius_unit.to_bits()),
            (at::POSITION_ERROR, self.position_error.to_bits()),
            (at::ORIGIN, self.origin),
            (at::OTHER_ROOTS, self.other_roots),
            (at::SECTIONS, self.sections),
            (at::UNIT, self.unit),
            (at::FILE_VERTICES, self.file_vertices),
            (at::FILE_TRIANGLES, self.file_triangles),
            (at::CHECKSUM, self.checksum),
        ] {
            if u32_at(bytes, offset) != Some(value) {
                return Err(FormatError::Field { offset: offset as u8, value });
            }
        }
        let paths = self.paths.code();
        if bytes.get(at::PATHS) != Some(&paths) {
            return Err(FormatError::Field { offset: at::PATHS as u8, value: paths.into() });
        }
        Ok(())
    }
}

const MAX_UNIT: u32 = Unit::Micrometre.code() as u32;

/// A header field. The length has been checked, so it exists.
const fn field(bytes: &[u8], offset: usize) -> Result<u32, FormatError> {
    match u32_at(bytes, offset) {
        Some(value) => Ok(value),
        None => {
            Err(FormatError::Length { expected: HEADER_BYTES as u32, found: bytes.len() as u32 })
        }
    }
}

pub(super) const fn read<I: Index>(bytes: &[u8]) -> Result<Header, FormatError> {
    let Some(start) = bytes.first_chunk::<HEADER_BYTES>() else {
        return Err(FormatError::Length {
            expected: HEADER_BYTES as u32,
            found: bytes.len() as u32,
        });
    };
    let magic = [start[0], start[1], start[2], start[3]];
    if u32::from_le_bytes(magic) != u32::from_le_bytes(MAGIC) {
        return Err(FormatError::Magic { found: magic });
    }
    let version = u16::from_le_bytes([start[at::VERSION], start[at::VERSION + 1]]);
    if version != VERSION {
        return Err(FormatError::Version { found: version });
    }
    let (width, path_code) = (start[at::WIDTH], start[at::PATHS]);
    if width as usize != I::BYTES {
        return Err(FormatError::Width { expected: I::BYTES as u8, found: width });
    }
    let Some(paths) = PathKind::from_code(path_code) else {
        return Err(FormatError::Field { offset: at::PATHS as u8, value: path_code as u32 });
    };
    let length = tri!(field(bytes, at::LENGTH));
    if length as usize != bytes.len() {
        return Err(FormatError::Length { expected: length, found: bytes.len() as u32 });
    }
    tri!(checksum(bytes));
    let header = Header {
        paths,
        mesh_id: tri!(field(bytes, at::MESH_ID)),
        vertices: tri!(field(bytes, at::VERTICES)),
        triangles: tri!(field(bytes, at::TRIANGLES)),
        nodes: tri!(field(bytes, at::NODES)),
        stack: tri!(field(bytes, at::STACK)),
        stretch: f32::from_bits(tri!(field(bytes, at::STRETCH))),
        radius_unit: f32::from_bits(tri!(field(bytes, at::RADIUS_UNIT))),
        position_error: f32::from_bits(tri!(field(bytes, at::POSITION_ERROR))),
        origin: tri!(field(bytes, at::ORIGIN)),
        other_roots: tri!(field(bytes, at::OTHER_ROOTS)),
        sections: tri!(field(bytes, at::SECTIONS)),
        unit: tri!(field(bytes, at::UNIT)),
        file_vertices: tri!(field(bytes, at::FILE_VERTICES)),
        file_triangles: tri!(field(bytes, at::FILE_TRIANGLES)),
        checksum: tri!(field(bytes, at::CHECKSUM)),
    };
    let [first_reserved, last_reserved] = at::RESERVED;
    let reserved = [tri!(field(bytes, first_reserved)), tri!(field(bytes, last_reserved))];
    let wrong = if header.vertices == 0 || header.vertices > I::MAX_VERTICES {
        Some((at::VERTICES, header.vertices))
    } else if header.triangles == 0 || header.triangles >= 1 << 28 {
        Some((at::TRIANGLES, header.triangles))
    } else if header.nodes == 0 || header.nodes >= 1 << 28 {
        Some((at::NODES, header.nodes))
    } else if header.stack as usize > MAX_STACK {
        Some((at::STACK, header.stack))
    } else if !(header.stretch >= 1.0 && header.stretch <= 1e6) {
        Some((at::STRETCH, header.stretch.to_bits()))
    } else if !(header.radius_unit >= 0.0 && header.radius_unit <= 1e18) {
        Some((at::RADIUS_UNIT, header.radius_unit.to_bits()))
    } else if !(header.position_error >= 0.0 && header.position_error <= 1e18) {
        Some((at::POSITION_ERROR, header.position_error.to_bits()))
    } else if header.origin > 1 {
        Some((at::ORIGIN, header.origin))
    } else if header.other_roots >= MAX_ROOTS || header.other_roots >= header.nodes {
        Some((at::OTHER_ROOTS, header.other_roots))
    } else if header.unit > MAX_UNIT {
        Some((at::UNIT, header.unit))
    } else if header.file_vertices < header.vertices || header.file_vertices > I::MAX_VERTICES {
        Some((at::FILE_VERTICES, header.file_vertices))
    } else if header.file_triangles < header.triangles {
        Some((at::FILE_TRIANGLES, header.file_triangles))
    } else if reserved[0] != 0 {
        Some((first_reserved, reserved[0]))
    } else if reserved[1] != 0 {
        Some((last_reserved, reserved[1]))
    } else {
        None
    };
    match wrong {
        Some((offset, value)) => Err(FormatError::Field { offset: offset as u8, value }),
        None => Ok(header),
    }
}

const fn checksum(bytes: &[u8]) -> Result<(), FormatError> {
    let stated = tri!(field(bytes, at::CHECKSUM));
    let Some((before, rest)) = bytes.split_at_checked(at::CHECKSUM) else { return Ok(()) };
    let Some((_, after)) = rest.split_at_checked(4) else { return Ok(()) };
    let mut digest = CRC.digest();
    digest.update(before);
    digest.update(after);
    let computed = digest.finalize();
    if computed == stated { Ok(()) } else { Err(FormatError::Checksum { stated, computed }) }
}
