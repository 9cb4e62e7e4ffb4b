//! Gmsh's meshes, versions 2 and 4.1, text or binary: their triangles and quads.
//!
//! Our own reader, although `mshio` exists: that is of 2020, knows version 4.1 alone, and panics on numbers of other
//! widths than it expects.

use super::cursor::Cursor;
use super::groups::FaceGroups;
use super::raw::{Raw, excerpt};
use super::scalar::{Endian, Scalar};
use super::{Format, ReadErrorKind};
use std::collections::HashMap;

type Result<T> = std::result::Result<T, ReadErrorKind>;

pub(super) fn read(bytes: &[u8], groups: bool) -> Result<Raw> {
    let mut file = Cursor::new(bytes, Format::Gmsh);
    file.skip_to("$MeshFormat")?;
    let version = file.needed("version")?;
    let is_binary = file.text_index()? == 1;
    let size = file.text_index()?;
    let is_known = matches!(version, "2" | "2.1" | "2.2" | "4.1");
    if !is_known || size != 8 {
        return Err(ReadErrorKind::Foreign {
            what: format!("a Gmsh mesh of version {}", excerpt(version)),
            remedy: "save it as version 4.1: `gmsh OLD.msh -save -format msh41 -o NEW.msh`"
                .to_owned(),
        });
    }
    let is_old = version.starts_with('2');
    if is_binary {
        file.line();
        // The number 1, in the order of the bytes.
        file.binary = Some(Endian::Little);
        if file.number(Scalar::I32)? != 1.0 {
            file.binary = Some(Endian::Big);
        }
    }
    file.skip_to("$EndMeshFormat")?;
    let mut mesh = Mesh { raw: Raw::new(0), row: HashMap::new(), physical: HashMap::new() };
    mesh.raw.groups = groups.then(FaceGroups::default);
    let (mut has_nodes, mut has_elements) = (false, false);
    while let Some(section) = file.word() {
        let Some(name) = section.strip_prefix('$') else {
            return Err(file.malformed(format!("'{}' is no section", excerpt(section))));
        };
        match (name, is_old) {
            ("PhysicalNames", _) if groups => mesh.names(&mut file)?,
            ("Entities", false) if groups => mesh.entities(&mut file)?,
            ("Nodes", true) => mesh.old_nodes(&mut file)?,
            ("Nodes", false) => mesh.nodes(&mut file)?,
            ("Elements", true) => mesh.old_elements(&mut file)?,
            ("Elements", false) => mesh.elements(&mut file)?,
            _ => {}
        }
        has_nodes |= name == "Nodes";
        has_elements |= name == "Elements";
        file.skip_to(&format!("$End{name}"))?;
    }
    if !(has_nodes && has_elements) {
        return Err(file.truncated("no '$Nodes' or no '$Elements'".to_owned()));
    }
    // Without physical groups all numbers are 0.
    mesh.raw.groups = mesh.raw.groups.filter(|groups| groups.of_face.iter().any(|&n| n != 0.0));
    Ok(mesh.raw)
}

struct Mesh {
    raw: Raw,
    /// The row of each node's number.
    row: HashMap<u64, u32>,
    /// The physical group of each surface that has one.
    physical: HashMap<i64, f64>,
}

impl Mesh {
    /// The names of physical groups: text, also among binary sections.
    fn names(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        for _ in 0..file.text_index()? {
            let (dimension, number) = (file.text_index()?, file.text_number()?);
            let name = file.line().trim_matches('"').to_owned();
            if let Some(groups) = self.raw.groups.as_mut().filter(|_| dimension == 2) {
                groups.names.push((number, name));
            }
        }
        Ok(())
    }

    /// The physical groups of surfaces. In the file they follow the groups of points and of curves.
    fn entities(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        skip_line(file);
        let counts = file.numbers(4, Scalar::U64, "numbers of entities")?;
        for (dimension, &count) in counts[..3].iter().enumerate() {
            for _ in 0..file.whole(count)? {
                let entity = file.number(Scalar::I32)?;
                // A point's place, or the corners of a box.
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
                    return Err(file.malformed(format!(
                        "surface {entity} is in several physical groups, and a triangle has one label"
                    )));
                }
                // Its sign turns the surface, which the elements show.
                self.physical.insert(entity as i64, number.abs());
            }
        }
        Ok(())
    }

    fn nodes(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        skip_line(file);
        let blocks = file.index(Scalar::U64)?;
        // Nodes in all, their smallest and largest number.
        file.numbers(3, Scalar::U64, "numbers")?;
        for _ in 0..blocks {
            let dimension = file.index(Scalar::I32)?;
            let _entity = file.number(Scalar::I32)?;
            let is_parametric = file.index(Scalar::I32)? == 1;
            let count = file.index(Scalar::U64)?;
            let tags = file.numbers(count, Scalar::U64, "nodes")?;
            // A place on its curve or surface stands beside a node's coordinates.
            let more = if is_parametric { dimension.min(3) } else { 0 };
            for tag in tags {
                let tag = file.whole(tag)?;
                self.node(file, tag)?;
                file.numbers(more, Scalar::F64, "parameters")?;
            }
        }
        Ok(())
    }

    fn old_nodes(&mut self, file: &mut Cursor<'_>) -> Result<()> {
        let count = file.text_index()?;
        skip_line(file);
        for _ in 0..count {
            let tag = file.index(Scalar::I32)?;
            self.node(file, tag)?;
        }
        Ok(())
    }

    fn node(&mut self, file: &mut Cursor<'_>, tag: u64) -> Result<()> {
        let mut position = [0.0; 3];
        for value in &mut position {
            *value = file.number(Scalar::F64)?;
        }
        if self.row.insert(tag, self.raw.positions.len() as u32).is_some() {
            return Err(file.malformed(format!("node {tag} stands there twice")));
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
            let group = self.physical.get(&(entity as i64)).filter(|_| dimension == 2.0);
            let group = group.copied().unwrap_or(0.0);
            let kind = file.index(Scalar::I32)?;
            let nodes = nodes_of(kind, file)?;
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
            // Binary elements of one type stand together, below one header.
            let (tag, kind, block, tags);
            if file.binary.is_some() {
                kind = file.index(Scalar::I32)?;
                (tag, block, tags) = (None, file.index(Scalar::I32)?, file.index(Scalar::I32)?);
            } else {
                tag = Some(file.index(Scalar::I32)?);
                kind = file.index(Scalar::I32)?;
                (block, tags) = (1, file.index(Scalar::I32)?);
            }
            let nodes = nodes_of(kind, file)?;
            for _ in 0..block {
                let tag = tag.map_or_else(|| file.index(Scalar::I32), Ok)?;
                // The first is the physical group, 0 for none.
                let tags = file.numbers(tags, Scalar::I32, "tags")?;
                let group = tags.first().copied().unwrap_or(0.0);
                let nodes = file.numbers(nodes, Scalar::I32, "nodes")?;
                self.element(file, kind, tag, &nodes, group.abs())?;
            }
            done += block.max(1);
        }
        Ok(())
    }

    /// Triangles and quads are kept.
    fn element(
        &mut self,
        file: &Cursor<'_>,
        kind: u64,
        tag: u64,
        nodes: &[f64],
        group: f64,
    ) -> Result<()> {
        if !matches!(kind, 2 | 3) {
            return Ok(());
        }
        for &node in nodes {
            let row = self.row.get(&file.whole(node)?).copied();
            let missing =
                || file.malformed(format!("element {tag} has node {node}, which is not there"));
            self.raw.corners.push(row.ok_or_else(missing)?);
        }
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

/// The nodes of an element of this type.
fn nodes_of(kind: u64, file: &Cursor<'_>) -> Result<u64> {
    // Points, lines and volumes, also of higher orders, are passed over.
    Ok(match kind {
        15 => 1,
        1 => 2,
        2 | 8 => 3,
        3 | 4 | 26 => 4,
        7 | 27 => 5,
        6 | 28 => 6,
        5 => 8,
        11 => 10,
        14 => 14,
        13 => 18,
        12 => 27,
        17 => 20,
        18 => 15,
        19 => 13,
        29 => 20,
        30 => 35,
        31 => 56,
        9 | 10 | 16 | 20..=25 => {
            return Err(ReadErrorKind::Foreign {
                what: "a Gmsh mesh of curved triangles".to_owned(),
                remedy: "mesh it again with flat ones: `gmsh MODEL.geo -2 -order 1 -o NEW.msh`"
                    .to_owned(),
            });
        }
        _ => return Err(file.malformed(format!("an element of the unknown type {kind}"))),
    })
}
