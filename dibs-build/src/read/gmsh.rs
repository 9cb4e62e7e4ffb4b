//! Gmsh's meshes, versions 1, 2 and 4.1, text or binary: their triangles and quads, or the boundary of their volumes.
//!
//! Our own reader, although `mshio` exists: it is from 2020, reads only version 4.1, and panics on numbers of other
//! widths than it expects.

use super::cursor::Cursor;
use super::groups::FaceGroups;
use super::raw::{Raw, excerpt};
use super::scalar::{Endian, Scalar};
use super::volume::{Shape, Volumes};
use super::{Format, ReadErrorKind, ReadTarget};
use std::collections::HashMap;

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// How a version of the format writes its sections.
#[derive(Clone, Copy, PartialEq)]
enum Version {
    /// `$NOD` and `$ELM`, without a header.
    One,
    Two,
    Four,
}

pub(super) fn read(bytes: &[u8], wanted: ReadTarget) -> Result<Raw> {
    let groups = wanted == ReadTarget::Groups;
    let mut file = Cursor::new(bytes, Format::Gmsh);
    let version = header(&mut file)?;
    let mut mesh = Mesh { wanted, ..Mesh::default() };
    mesh.raw.groups = groups.then(FaceGroups::default);
    let (mut has_nodes, mut has_elements) = (false, false);
    while let Some(section) = file.word() {
        let Some(name) = section.strip_prefix('$') else {
            return Err(file.malformed(format!("'{}' is no section", excerpt(section))));
        };
        match (name, version) {
            ("PhysicalNames", _) if groups => mesh.names(&mut file)?,
            ("Entities", Version::Four) if groups => mesh.entities(&mut file)?,
            ("NOD", Version::One) | ("Nodes" | "ParametricNodes", Version::Two) => {
                mesh.old_nodes(&mut file, name == "ParametricNodes")?;
            }
            ("Nodes", Version::Four) => mesh.nodes(&mut file)?,
            ("ELM", Version::One) => mesh.oldest_elements(&mut file)?,
            ("Elements", Version::Two) => mesh.old_elements(&mut file)?,
            ("Elements", Version::Four) => mesh.elements(&mut file)?,
            _ => {}
        }
        has_nodes |= matches!(name, "Nodes" | "ParametricNodes" | "NOD");
        has_elements |= matches!(name, "Elements" | "ELM");
        let end = if version == Version::One { "$END" } else { "$End" };
        let end = format!("{end}{name}");
        let mut after = file.clone();
        after.skip_to(&end)?;
        let is_counted = matches!(name, "Nodes" | "ParametricNodes" | "NOD" | "Elements" | "ELM");
        if is_counted && file.word() != Some(&end) {
            return Err(file.malformed(format!("more in ${name} than it counts")));
        }
        file = after;
    }
    if !(has_nodes && has_elements) {
        return Err(file.truncated("no '$Nodes' or no '$Elements'".to_owned()));
    }
    let Mesh { mut raw, volumes, volume_names, .. } = mesh;
    if let (Some(groups), true) = (&mut raw.groups, raw.ends.is_empty()) {
        groups.names = volume_names;
    }
    volumes.finish(&mut raw, groups, &flatten(wanted))?;
    // Without physical groups all numbers are 0.
    raw.groups = raw.groups.filter(|groups| groups.of_face.iter().any(|&n| n != 0.0));
    Ok(raw)
}

/// Reads the header; numbers may be binary from there on.
fn header(file: &mut Cursor<'_>) -> Result<Version> {
    let start = file.clone();
    match file.word() {
        Some("$NOD") => {
            *file = start;
            return Ok(Version::One);
        }
        Some(word) if word.starts_with('$') => *file = start,
        _ => return Err(file.malformed("no '$MeshFormat' at its beginning".to_owned())),
    }
    file.skip_to("$MeshFormat")?;
    let version = file.needed("version")?;
    let is_binary = file.text_index()? == 1;
    let size = file.text_index()?;
    let is_known = matches!(version, "2" | "2.0" | "2.1" | "2.2" | "4.1");
    if !is_known || size != 8 {
        return Err(ReadErrorKind::Foreign {
            what: format!("a Gmsh mesh of version {}", excerpt(version)),
            remedy: "save it as version 4.1: `gmsh OLD.msh -save -format msh41 -o NEW.msh`"
                .to_owned(),
        });
    }
    if is_binary {
        file.line();
        // The number 1, in the byte order of the file.
        file.binary = Some(Endian::Little);
        if file.number(Scalar::I32)? != 1.0 {
            file.binary = Some(Endian::Big);
        }
    }
    file.skip_to("$EndMeshFormat")?;
    Ok(if version.starts_with('2') { Version::Two } else { Version::Four })
}

/// The remedy for curved elements.
fn flatten(wanted: ReadTarget) -> String {
    let dimension = if wanted == ReadTarget::Volume { 3 } else { 2 };
    format!("mesh it again with flat elements: `gmsh MODEL.geo -{dimension} -order 1 -o NEW.msh`")
}

#[derive(Default)]
struct Mesh {
    wanted: ReadTarget,
    raw: Raw,
    /// The row of each node by its number.
    row: HashMap<u64, u32>,
    /// The physical group of each surface and volume that has one, by its dimension and number.
    physical: HashMap<(u64, i64), f64>,
    volumes: Volumes,
    /// Names of physical groups of volumes.
    volume_names: Vec<(f64, String)>,
}

impl Mesh {
    /// The names of physical groups: text, also among binary sections.
    fn names(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        for _ in 0..file.text_index()? {
            let (dimension, number) = (file.text_index()?, file.text_number()?);
            let name = file.line().trim_matches('"').to_owned();
            let Some(groups) = &mut self.raw.groups else { continue };
            match dimension {
                2 => groups.names.push((number, name)),
                3 => self.volume_names.push((number, name)),
                _ => {}
            }
        }
        Ok(())
    }

    /// The physical groups of surfaces. In the file they follow the groups of points and of curves.
    fn entities(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        skip_line(file);
        let counts = file.numbers(4, Scalar::U64, "numbers of entities")?;
        for (dimension, &count) in (0..).zip(&counts) {
            for _ in 0..file.whole(count)? {
                let entity = file.number(Scalar::I32)?;
                // A point's position, or the corners of a box.
                file.numbers(if dimension == 0 { 3 } else { 6 }, Scalar::F64, "coordinates")?;
                let physical = file.index(Scalar::U64)?;
                let physical = file.numbers(physical, Scalar::I32, "physical groups")?;
                if dimension > 0 {
                    let borders = file.index(Scalar::U64)?;
                    file.numbers(borders, Scalar::I32, "borders")?;
                }
                let &[number, ref others @ ..] = &physical[..] else { continue };
                if dimension < 2 {
                    continue;
                }
                if !others.is_empty() {
                    let entity =
                        format!("{} {entity}", if dimension == 2 { "surface" } else { "volume" });
                    return Err(file.malformed(format!(
                        "{entity} is in several physical groups, and a triangle has one label"
                    )));
                }
                // The sign reverses the surface, which the elements' winding already shows.
                self.physical.insert((dimension, entity as i64), number.abs());
            }
        }
        Ok(())
    }

    fn nodes(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        skip_line(file);
        let blocks = file.index(Scalar::U64)?;
        // Number of nodes, their smallest and largest number.
        file.numbers(3, Scalar::U64, "numbers")?;
        for _ in 0..blocks {
            let dimension = file.index(Scalar::I32)?;
            let _entity = file.number(Scalar::I32)?;
            let is_parametric = file.index(Scalar::I32)? == 1;
            let count = file.index(Scalar::U64)?;
            let tags = file.numbers(count, Scalar::U64, "nodes")?;
            // A node's coordinates may be followed by its parameters on its curve or surface.
            let more = if is_parametric { dimension.min(3) } else { 0 };
            for tag in tags {
                let tag = file.whole(tag)?;
                self.node(file, tag)?;
                file.numbers(more, Scalar::F64, "parameters")?;
            }
        }
        Ok(())
    }

    fn old_nodes(&mut self, file: &mut Cursor<'_>, is_parametric: bool) -> Result<()> {
        let count = file.text_index()?;
        skip_line(file);
        for _ in 0..count {
            let tag = file.index(Scalar::I32)?;
            self.node(file, tag)?;
            if file.binary.is_none() {
                // Parameters on a curve or surface may follow.
                file.line();
            } else if is_parametric {
                let (dimension, _) = (file.index(Scalar::I32)?, file.number(Scalar::I32)?);
                let more = if dimension < 3 { dimension } else { 0 };
                file.numbers(more, Scalar::F64, "parameters")?;
            }
        }
        Ok(())
    }

    fn node(&mut self, file: &mut Cursor<'_>, tag: u64) -> Result<()> {
        let mut position = [0.0; 3];
        for value in &mut position {
            *value = file.number(Scalar::F64)?;
        }
        if self.row.insert(tag, self.raw.positions.len() as u32).is_some() {
            return Err(file.malformed(format!("node {tag} is defined twice")));
        }
        self.raw.positions.push(position);
        Ok(())
    }

    fn elements(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        skip_line(file);
        let blocks = file.index(Scalar::U64)?;
        file.numbers(3, Scalar::U64, "numbers")?;
        for _ in 0..blocks {
            let (dimension, entity) = (file.number(Scalar::I32)?, file.number(Scalar::I32)?);
            let group = self.physical.get(&(dimension as u64, entity as i64));
            let group = group.copied().unwrap_or(0.0);
            let kind = file.index(Scalar::I32)?;
            let nodes = nodes_of(kind, self.wanted)?;
            for _ in 0..file.index(Scalar::U64)? {
                let tag = file.index(Scalar::U64)?;
                let nodes = file.numbers(nodes, Scalar::U64, "nodes")?;
                self.element(file, kind, tag, &nodes, group)?;
            }
        }
        Ok(())
    }

    fn old_elements(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        let count = file.text_index()?;
        skip_line(file);
        let mut done = 0;
        while done < count {
            // Binary elements of one type are grouped, below one header.
            let (tag, kind, block, tags);
            if file.binary.is_some() {
                kind = file.index(Scalar::I32)?;
                (tag, block, tags) = (None, file.index(Scalar::I32)?, file.index(Scalar::I32)?);
            } else {
                tag = Some(file.index(Scalar::I32)?);
                kind = file.index(Scalar::I32)?;
                (block, tags) = (1, file.index(Scalar::I32)?);
            }
            let nodes = nodes_of(kind, self.wanted)?;
            for _ in 0..block {
                let tag = tag.map_or_else(|| file.index(Scalar::I32), Ok)?;
                // The first tag is the physical group, 0 for none.
                let tags = file.numbers(tags, Scalar::I32, "tags")?;
                let group = tags.first().copied().unwrap_or(0.0);
                let nodes = file.numbers(nodes, Scalar::I32, "nodes")?;
                self.element(file, kind, tag, &nodes, group.abs())?;
            }
            done += block.max(1);
        }
        Ok(())
    }

    fn oldest_elements(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        for _ in 0..file.text_index()? {
            let (tag, kind) = (file.text_index()?, file.text_index()?);
            // The physical group, and the entity.
            let (group, _) = (file.text_number()?, file.text_number()?);
            let count = file.text_index()?;
            if nodes_of(kind, self.wanted)? != count {
                let what = format!("element {tag} of the type {kind} has {count} nodes");
                return Err(file.malformed(what));
            }
            let nodes = file.numbers(count, Scalar::I32, "nodes")?;
            self.element(file, kind, tag, &nodes, group.abs())?;
        }
        Ok(())
    }

    /// Keeps triangles and quads, and volumes for their boundary; skips points and curves.
    fn element(
        &mut self,
        file: &Cursor<'_>,
        kind: u64,
        tag: u64,
        nodes: &[f64],
        group: f64,
    ) -> Result<()> {
        let shape = match kind {
            2 | 3 => None,
            4 => Some(Shape::Tetrahedron),
            5 => Some(Shape::Hexahedron),
            6 => Some(Shape::Wedge),
            7 => Some(Shape::Pyramid),
            11..=14 | 17..=19 | 29..=31 => {
                self.volumes.curved += 1;
                return Ok(());
            }
            _ => return Ok(()),
        };
        let row = |&node: &f64| {
            let row = self.row.get(&file.whole(node)?).copied();
            row.ok_or_else(|| {
                file.malformed(format!(
                    "element {tag} has node {node} (Gmsh's numbers), which is not there"
                ))
            })
        };
        let rows = nodes.iter().map(row).collect::<Result<Vec<u32>>>()?;
        if let Some(shape) = shape {
            self.volumes.push(shape, &rows, group);
            return Ok(());
        }
        self.raw.corners.extend(rows);
        self.raw.end_face();
        if let Some(groups) = &mut self.raw.groups {
            groups.of_face.push(group);
        }
        Ok(())
    }
}

/// Binary numbers begin on the next line.
fn skip_line(file: &mut Cursor<'_>) {
    if file.binary.is_some() {
        file.line();
    }
}

/// The number of nodes of an element of this type.
fn nodes_of(kind: u64, wanted: ReadTarget) -> Result<u64> {
    let curved = match kind {
        15 => return Ok(1),
        1 => return Ok(2),
        2 | 8 => return Ok(3),
        3 | 4 | 26 => return Ok(4),
        7 | 27 => return Ok(5),
        6 | 28 => return Ok(6),
        5 => return Ok(8),
        11 => return Ok(10),
        14 => return Ok(14),
        13 => return Ok(18),
        12 => return Ok(27),
        17 | 29 => return Ok(20),
        18 => return Ok(15),
        19 => return Ok(13),
        30 => return Ok(35),
        31 => return Ok(56),
        9 | 20..=25 | 42..=46 | 52..=56 => "curved triangles",
        10 | 16 | 36..=41 | 47..=51 | 57..=61 => "curved quads",
        _ => {
            return Err(ReadErrorKind::Foreign {
                what: format!("a Gmsh mesh with elements of the type {kind}, which is not read"),
                remedy: flatten(wanted),
            });
        }
    };
    Err(ReadErrorKind::Foreign {
        what: format!("a Gmsh mesh of {curved}"),
        remedy: flatten(wanted),
    })
}
