//! glTF 2.0 and GLB: the triangles of the default scene in its default pose, transformed by its nodes, in metres.
//!
//! Our own reader, although `gltf` exists: it panics on documents that refer to accessors, or to bytes of accessors,
//! that do not exist. After checking these first, nothing would be left for it to do.
//!
//! One file, because a document's parts refer to each other.

mod accessor;
mod buffers;
mod document;
mod skin;

use super::raw::{Raw, excerpt};
use super::text::trimmed;
use super::{Format, ReadErrorKind};
use crate::Unit;
use accessor::{Use, numbers};
use buffers::Buffers;
use document::{Document, Head, Mesh, Node, Primitive};
use glam::{DMat4, DQuat, DVec3};
use std::collections::HashMap;
use std::path::Path;

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// Most positions and corners for each byte of the files: ten times as many as a mesh has that a scene places once.
const MOST_A_BYTE: usize = 3;

/// Extensions that change no position: surfaces are the same without them.
const HARMLESS: [&str; 7] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    "KHR_mesh_quantization",
];

pub(super) fn read(bytes: &[u8], folder: &Path) -> Result<Raw> {
    let (json, binary) = parts(bytes)?;
    let json = trimmed(json);
    let head: Head = parse(json)?;
    if head.asset.version.starts_with(['0', '1']) {
        return Err(old(&head.asset.version));
    }
    check_required(&head.extensions_required)?;
    let document: Document = parse(json)?;
    for (number, node) in document.nodes.iter().enumerate() {
        node.check().map_err(|what| malformed(format!("node {number} has {what}")))?;
    }
    let buffers = Buffers::new(folder, binary, &document.buffers);
    let mut surface = Surface {
        document: &document,
        most: MOST_A_BYTE.saturating_mul(bytes.len().saturating_add(buffers.room())),
        buffers,
        worlds: skin::worlds(&document),
        raw: Raw::new(0),
        first: HashMap::new(),
        left_out: LeftOut::default(),
    };
    let mut waiting: Vec<_> =
        roots(&document)?.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
    let mut seen = vec![false; document.nodes.len()];
    while let Some((number, above)) = waiting.pop() {
        let node = get(&document.nodes, number, "node")?;
        if std::mem::replace(&mut seen[number], true) {
            return Err(malformed(format!("node {number} is in the scene twice")));
        }
        let place = above * node.place();
        surface.node(node, number, &place)?;
        waiting.extend(node.children.iter().rev().map(|&child| (child, place)));
    }
    if document.nodes.is_empty() {
        // A library of meshes without a scene: each mesh untransformed.
        for (number, mesh) in document.meshes.iter().enumerate() {
            surface.mesh(mesh, number, &Placement::At(DMat4::IDENTITY), &mesh.weights)?;
        }
    }
    let is_elsewhere = |(node, seen): &(&Node, &bool)| node.mesh.is_some() && !**seen;
    surface.left_out.nodes = document.nodes.iter().zip(&seen).filter(is_elsewhere).count();
    Ok(surface.finish())
}

fn parse<'a, T: serde::Deserialize<'a>>(json: &'a [u8]) -> Result<T> {
    serde_json::from_slice(json).map_err(|error| malformed(error.to_string()))
}

fn malformed(what: impl Into<String>) -> ReadErrorKind {
    ReadErrorKind::Malformed { format: Format::Gltf, line: None, what: what.into() }
}

fn old(version: &str) -> ReadErrorKind {
    ReadErrorKind::Foreign {
        what: format!("glTF of version {}", excerpt(version)),
        remedy: "convert it to version 2.0: `gltf-pipeline -i OLD -o NEW.glb`, or open it in Blender and export it"
            .to_owned(),
    }
}

fn packed(extension: &str) -> ReadErrorKind {
    ReadErrorKind::Foreign {
        what: format!("glTF packed by {}", excerpt(extension)),
        remedy: "export it without compression".to_owned(),
    }
}

/// A reader that does not know an extension that a document requires must refuse it.
fn check_required(names: &[String]) -> Result<()> {
    let is_unknown = |name: &&String| !HARMLESS.iter().any(|known| name.starts_with(known));
    match names.iter().find(is_unknown) {
        None => Ok(()),
        Some(name) if name.contains("compression") => Err(packed(name)),
        Some(name) => Err(ReadErrorKind::Foreign {
            what: format!("glTF that requires the extension {}, which is not read", excerpt(name)),
            remedy: "export it without this extension".to_owned(),
        }),
    }
}

fn get<'a, T>(all: &'a [T], number: usize, name: &str) -> Result<&'a T> {
    all.get(number).ok_or_else(|| malformed(format!("{name} {number} is not there")))
}

/// The document, and the binary part of a GLB file.
fn parts<'a>(bytes: &'a [u8]) -> Result<(&'a [u8], &'a [u8])> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, &[]));
    }
    let cut_off = || ReadErrorKind::Truncated {
        format: Format::Gltf,
        missing: "a part is shorter than its header says".to_owned(),
    };
    if let Some(&[version @ (0 | 1), 0, 0, 0]) = bytes.get(4..8) {
        return Err(old(&version.to_string()));
    }
    // Magic, version and length; then parts, each preceded by its length and kind.
    let part = |bytes: &'a [u8]| {
        let (length, after) = bytes.split_first_chunk::<4>()?;
        after.get(4..)?.split_at_checked(u32::from_le_bytes(*length) as usize)
    };
    let (json, rest) = bytes.get(12..).and_then(part).ok_or_else(cut_off)?;
    if rest.is_empty() {
        return Ok((json, rest));
    }
    let (binary, _) = part(rest).ok_or_else(cut_off)?;
    Ok((json, binary))
}

/// The root nodes of the default scene; without one, those of the whole document.
fn roots(document: &Document) -> Result<Vec<usize>> {
    match (document.scene, &document.scenes[..]) {
        (Some(number), _) => {
            get(&document.scenes, number, "scene").map(|scene| scene.nodes.clone())
        }
        (None, [first, ..]) => Ok(first.nodes.clone()),
        (None, []) => {
            let mut is_child = vec![false; document.nodes.len()];
            for &child in document.nodes.iter().flat_map(|node| &node.children) {
                if let Some(is_child) = is_child.get_mut(child) {
                    *is_child = true;
                }
            }
            Ok((0..is_child.len()).filter(|&node| !is_child[node]).collect())
        }
    }
}

/// Accepted lengths of a rotation's quaternion, which should be 1 but may be rounded to a few digits.
const UNIT: std::ops::RangeInclusive<f64> = 0.99..=1.01;

impl Node {
    /// Fails for a transform that other readers would interpret differently.
    fn check(&self) -> std::result::Result<(), &'static str> {
        let is_unit = |rotation| UNIT.contains(&DQuat::from_array(rotation).length());
        if !self.rotation.is_none_or(is_unit) {
            return Err("a rotation that is no unit quaternion");
        }
        let is_affine = |m: [f64; 16]| [m[3], m[7], m[11], m[15]] == [0.0, 0.0, 0.0, 1.0];
        if !self.matrix.is_none_or(is_affine) {
            return Err("a matrix whose last row is not 0, 0, 0, 1");
        }
        Ok(())
    }

    fn place(&self) -> DMat4 {
        match self.matrix {
            Some(columns) => DMat4::from_cols_array(&columns),
            None => DMat4::from_scale_rotation_translation(
                self.scale.map_or(DVec3::ONE, DVec3::from),
                self.rotation.map_or(DQuat::IDENTITY, |q| DQuat::from_array(q).normalize()),
                self.translation.map_or(DVec3::ZERO, DVec3::from),
            ),
        }
    }
}

/// Counts of elements that are not read.
#[derive(Default)]
struct LeftOut {
    /// Nodes with a mesh that are not in the default scene.
    nodes: usize,
    /// Parts of meshes that are points and lines.
    lines: usize,
    /// Parts of meshes without positions.
    unplaced: usize,
    /// Corners after the last whole triangle.
    corners: usize,
    morphed: usize,
    skinned: usize,
    instanced: usize,
}

/// What transforms a mesh.
enum Placement {
    /// Its node.
    At(DMat4),
    /// The joints of its skin, and not its node.
    Posed(Vec<DMat4>),
}

struct Surface<'a> {
    document: &'a Document,
    buffers: Buffers<'a>,
    /// The transform of each node; `None` for nodes in a cycle.
    worlds: Vec<Option<DMat4>>,
    raw: Raw,
    /// The first row of positions by node and accessors: parts of one mesh share positions.
    first: HashMap<(usize, Vec<usize>), u32>,
    /// Most positions and corners of a plausible mesh in files of this size.
    most: usize,
    left_out: LeftOut,
}

impl Surface<'_> {
    fn node(&mut self, node: &Node, number: usize, place: &DMat4) -> Result<()> {
        let Some(mesh) = node.mesh else { return Ok(()) };
        let mesh = get(&self.document.meshes, mesh, "mesh")?;
        if node.extensions.contains_key("EXT_mesh_gpu_instancing") {
            self.left_out.instanced += 1;
        }
        let placed = match node.skin {
            None => Placement::At(*place),
            Some(skin) => {
                self.left_out.skinned += 1;
                let skin = get(&self.document.skins, skin, "skin")?;
                let (document, most) = (self.document, self.most);
                Placement::Posed(skin::joints(
                    document,
                    &mut self.buffers,
                    &self.worlds,
                    skin,
                    most,
                )?)
            }
        };
        self.mesh(mesh, number, &placed, node.weights.as_ref().unwrap_or(&mesh.weights))
    }

    fn mesh(
        &mut self,
        mesh: &Mesh,
        node: usize,
        placed: &Placement,
        weights: &[f64],
    ) -> Result<()> {
        let is_morphed = mesh.primitives.iter().any(|primitive| !primitive.targets.is_empty());
        self.left_out.morphed += usize::from(is_morphed);
        for primitive in &mesh.primitives {
            self.add(primitive, node, placed, weights)?;
            if self.raw.positions.len() + self.raw.corners.len() > self.most {
                return Err(malformed("too many copies of its meshes"));
            }
        }
        Ok(())
    }

    fn add(
        &mut self,
        primitive: &Primitive,
        node: usize,
        placed: &Placement,
        weights: &[f64],
    ) -> Result<()> {
        let mode = primitive.mode.unwrap_or(4);
        let Some(&positions) = primitive.attributes.get("POSITION") else {
            self.left_out.unplaced += 1;
            return Ok(());
        };
        if !matches!(mode, 4..=6) {
            self.left_out.lines += 1;
            return Ok(());
        }
        let accessor = get(&self.document.accessors, positions, "accessor")?;
        if let Some(name) = primitive.extensions.keys().find(|name| name.contains("compression"))
            && accessor.buffer_view.is_none()
        {
            return Err(packed(name));
        }
        let targets = primitive.targets.iter().filter_map(|target| target.get("POSITION").copied());
        let skins = ["JOINTS_0", "WEIGHTS_0"].map(|name| primitive.attributes.get(name).copied());
        let skins = skins.into_iter().flatten();
        let key =
            (node, std::iter::once(positions).chain(targets).chain(skins).collect::<Vec<_>>());
        let count = accessor.count as u32;
        let first = match self.first.get(&key) {
            Some(&first) => first,
            None => {
                let first = self.raw.positions.len() as u32;
                let mut points = self.points(primitive, positions, weights)?;
                match placed {
                    Placement::At(place) => {
                        points.iter_mut().for_each(|point| *point = place.transform_point3(*point));
                    }
                    Placement::Posed(joints) => {
                        let (document, most) = (self.document, self.most);
                        skin::pose(
                            document,
                            &mut self.buffers,
                            primitive,
                            joints,
                            most,
                            &mut points,
                        )?;
                    }
                }
                self.raw.positions.extend(points.iter().map(DVec3::to_array));
                self.first.insert(key, first);
                first
            }
        };
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => {
                let indices = self.numbers(indices, Use::Indices)?;
                // A number beyond the part's own vertices must not refer to another part's.
                let row = |index: f64| {
                    if index < f64::from(count) { first + index as u32 } else { u32::MAX }
                };
                indices.into_iter().map(row).collect()
            }
            None => (first..first.saturating_add(count)).collect(),
        };
        // A mirror turns triangles inside out: reversing their order keeps their outer side outside.
        let is_mirrored = match placed {
            Placement::At(place) => place.determinant() < 0.0,
            Placement::Posed(joints) => {
                joints.first().is_some_and(|joint| joint.determinant() < 0.0)
            }
        };
        self.left_out.corners += match (mode, corners.len()) {
            (4, count) => count % 3,
            (_, count @ 0..3) => count,
            _ => 0,
        };
        for number in 0..if mode == 4 { corners.len() / 3 } else { corners.len().max(2) - 2 } {
            let triangle = match mode {
                4 => [3 * number, 3 * number + 1, 3 * number + 2],
                5 if number % 2 == 0 => [number, number + 1, number + 2],
                5 => [number + 1, number, number + 2],
                _ => [0, number + 1, number + 2],
            };
            let [a, b, c] = triangle;
            let triangle = if is_mirrored { [a, c, b] } else { triangle };
            self.raw.corners.extend(triangle.map(|corner| corners[corner]));
            self.raw.end_face();
        }
        Ok(())
    }

    /// Positions in the default pose: each morph target adds its displacements times its weight.
    fn points(
        &mut self,
        primitive: &Primitive,
        positions: usize,
        weights: &[f64],
    ) -> Result<Vec<DVec3>> {
        let vectors = |numbers: Vec<f64>| -> Vec<DVec3> {
            numbers.as_chunks::<3>().0.iter().map(|&point| DVec3::from(point)).collect()
        };
        let mut points = vectors(self.numbers(positions, Use::Positions)?);
        for (target, &weight) in primitive.targets.iter().zip(weights) {
            let Some(&target) = target.get("POSITION") else { continue };
            let moves = vectors(self.numbers(target, Use::Positions)?);
            if moves.len() != points.len() {
                return Err(malformed(
                    "a morph target with another number of vertices than its mesh",
                ));
            }
            for (point, by) in points.iter_mut().zip(moves) {
                *point += weight * by;
            }
        }
        Ok(points)
    }

    fn numbers(&mut self, number: usize, used: Use) -> Result<Vec<f64>> {
        numbers(self.document, &mut self.buffers, number, used, self.most)
    }

    fn finish(mut self) -> Raw {
        let raw = &mut self.raw;
        raw.unit = Some(Unit::Metre);
        raw.remark(
            self.left_out.nodes,
            "mesh was left out: it is not in the default scene",
            "meshes were left out: they are not in the default scene",
        );
        raw.remark(
            self.left_out.lines,
            "part of a mesh was left out: points and lines are no surface",
            "parts of meshes were left out: points and lines are no surface",
        );
        raw.remark(
            self.left_out.unplaced,
            "part of a mesh was left out: it has no positions, or an extension's",
            "parts of meshes were left out: they have no positions, or an extension's",
        );
        raw.remark(
            self.left_out.corners,
            "corner was left out: it makes no whole triangle",
            "corners were left out: they make no whole triangle",
        );
        raw.remark(
            self.left_out.morphed,
            "mesh has morph targets: it was read with their default weights, and their motion was left out",
            "meshes have morph targets: they were read with their default weights, and their motion was left out",
        );
        raw.remark(
            self.left_out.skinned,
            "mesh has a skin: it was read in the default pose of its joints, and their motion was left out",
            "meshes have skins: they were read in the default pose of their joints, and their motion was left out",
        );
        raw.remark(
            self.left_out.instanced,
            "mesh is placed several times by EXT_mesh_gpu_instancing, and was read once",
            "meshes are placed several times by EXT_mesh_gpu_instancing, and were read once each",
        );
        raw.remark(
            self.document.animations.len(),
            "animation was left out: give a motion in a file of its own",
            "animations were left out: give a motion in a file of its own",
        );
        self.raw
    }
}
