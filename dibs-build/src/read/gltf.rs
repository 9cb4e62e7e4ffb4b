//! glTF 2.0 and GLB: the triangles of the default scene, where its nodes put them.
//!
//! Our own reader, although `gltf` exists: that panics on documents whose numbers of accessors, and on accessors whose
//! bytes, are not there. With these checked first, nothing would be left for it to do.

use super::raw::{Raw, excerpt};
use super::scalar::{Endian, Scalar};
use super::{Format, ReadErrorKind, base64};
use glam::{DMat4, DQuat, DVec3};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Component, Path};

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// More copies than this are no organ: a scene may place one mesh often.
const MOST_COPIES: usize = 16;

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Document {
    scene: usize,
    scenes: Vec<Scene>,
    nodes: Vec<Node>,
    meshes: Vec<Mesh>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<View>,
    buffers: Vec<Buffer>,
    extensions_required: Vec<String>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Scene {
    nodes: Vec<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Node {
    children: Vec<usize>,
    mesh: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: HashMap<String, usize>,
    indices: Option<usize>,
    /// Triangles (4) where it is not said, strips (5), fans (6), or no surface.
    mode: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    shape: String,
    sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

pub(super) fn read(bytes: &[u8], folder: &Path) -> Result<Raw> {
    let (json, binary) = parts(bytes)?;
    let document: Document =
        serde_json::from_slice(json).map_err(|error| malformed(error.to_string()))?;
    let is_packed = |name: &&String| name.contains("compression") || name.contains("quantization");
    if let Some(name) = document.extensions_required.iter().find(is_packed) {
        return Err(ReadErrorKind::Foreign {
            what: format!("glTF packed by {}", excerpt(name)),
            remedy: "export it without compression".to_owned(),
        });
    }
    let buffers = document.buffers.iter().map(|buffer| buffer.read(binary, folder));
    let buffers = buffers.collect::<Result<Vec<Vec<u8>>>>()?;
    let most = MOST_COPIES * buffers.iter().map(Vec::len).sum::<usize>();
    let roots = match document.scenes.get(document.scene) {
        Some(scene) => scene.nodes.clone(),
        None => (0..document.nodes.len()).collect(),
    };
    let mut waiting: Vec<_> = roots.iter().rev().map(|&node| (node, DMat4::IDENTITY)).collect();
    let mut seen = vec![false; document.nodes.len()];
    let mut surface =
        Surface { document: &document, buffers, raw: Raw::new(0), first: HashMap::new() };
    while let Some((number, above)) = waiting.pop() {
        let node = get(&document.nodes, number, "node")?;
        if std::mem::replace(&mut seen[number], true) {
            return Err(malformed(format!("node {number} stands in the scene twice")));
        }
        let place = above * node.place();
        if let Some(mesh) = node.mesh {
            for primitive in &get(&document.meshes, mesh, "mesh")?.primitives {
                surface.add(primitive, number, &place)?;
                if surface.raw.positions.len() + surface.raw.corners.len() > most {
                    return Err(malformed(format!("more than {MOST_COPIES} copies of its meshes")));
                }
            }
        }
        waiting.extend(node.children.iter().rev().map(|&child| (child, place)));
    }
    Ok(surface.raw)
}

fn malformed(what: impl Into<String>) -> ReadErrorKind {
    ReadErrorKind::Malformed { format: Format::Gltf, line: None, what: what.into() }
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
    // Magic, version and length; then parts, each after its length and kind.
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

impl Buffer {
    /// The binary part, data inside the document, or a file beside it.
    fn read(&self, binary: &[u8], folder: &Path) -> Result<Vec<u8>> {
        let Some(uri) = &self.uri else { return Ok(binary.to_vec()) };
        if let Some(data) = uri.strip_prefix("data:") {
            let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
            let bytes = encoded.and_then(|encoded| base64::decode(encoded.as_bytes()));
            return bytes.ok_or_else(|| malformed("a buffer that is no base64"));
        }
        // A document names files beside it, not those of the computer.
        let path = Path::new(uri);
        if !path.components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(malformed(format!("the buffer '{}' is no file beside it", excerpt(uri))));
        }
        std::fs::read(folder.join(path)).map_err(|error| {
            let uri = excerpt(uri);
            malformed(format!("its buffer '{uri}' cannot be read ({error}); keep both together"))
        })
    }
}

impl Node {
    fn place(&self) -> DMat4 {
        match self.matrix {
            Some(columns) => DMat4::from_cols_array(&columns),
            None => DMat4::from_scale_rotation_translation(
                self.scale.map_or(DVec3::ONE, DVec3::from),
                self.rotation.map_or(DQuat::IDENTITY, DQuat::from_array),
                self.translation.map_or(DVec3::ZERO, DVec3::from),
            ),
        }
    }
}

struct Surface<'a> {
    document: &'a Document,
    buffers: Vec<Vec<u8>>,
    raw: Raw,
    /// The first row of each node's positions: parts of one mesh share them.
    first: HashMap<(usize, usize), u32>,
}

impl Surface<'_> {
    fn add(&mut self, primitive: &Primitive, node: usize, place: &DMat4) -> Result<()> {
        let mode = primitive.mode.unwrap_or(4);
        let Some(&positions) = primitive.attributes.get("POSITION") else { return Ok(()) };
        if !matches!(mode, 4..=6) {
            return Ok(());
        }
        let first = match self.first.get(&(node, positions)) {
            Some(&first) => first,
            None => {
                let first = self.raw.positions.len() as u32;
                let numbers = self.numbers(positions, "VEC3")?;
                let points = numbers.as_chunks::<3>().0.iter();
                let placed = points.map(|&p| place.transform_point3(DVec3::from(p)).to_array());
                self.raw.positions.extend(placed);
                self.first.insert((node, positions), first);
                first
            }
        };
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => {
                let indices = self.numbers(indices, "SCALAR")?;
                indices.into_iter().map(|index| first.saturating_add(index as u32)).collect()
            }
            None => (first..self.raw.positions.len() as u32).collect(),
        };
        // A mirror turns triangles over: the other way round their outer side stays outside.
        let is_mirrored = place.determinant() < 0.0;
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

    /// The numbers of an accessor: positions or indices.
    fn numbers(&self, number: usize, shape: &str) -> Result<Vec<f64>> {
        let accessor = get(&self.document.accessors, number, "accessor")?;
        let wrong = |what: &str| malformed(format!("accessor {number} {what}"));
        let (scalar, width) = match (accessor.component_type, shape) {
            (5126, "VEC3") => (Scalar::F32, 3),
            (5121, "SCALAR") => (Scalar::U8, 1),
            (5123, "SCALAR") => (Scalar::U16, 1),
            (5125, "SCALAR") => (Scalar::U32, 1),
            _ => return Err(wrong("has another type of numbers than its use asks for")),
        };
        if accessor.shape != shape {
            return Err(wrong("has another shape than its use asks for"));
        }
        let (Some(view), None) = (accessor.buffer_view, &accessor.sparse) else {
            return Err(wrong("is sparse, which is not supported"));
        };
        let view = get(&self.document.buffer_views, view, "buffer view")?;
        let buffer = get(&self.buffers, view.buffer, "buffer")?;
        let size = width * scalar.bytes();
        let stride = view.byte_stride.unwrap_or(size);
        let bytes = buffer.get(view.byte_offset..);
        let bytes = bytes.and_then(|bytes| bytes.get(accessor.byte_offset..));
        let last = accessor.count.checked_sub(1).and_then(|last| last.checked_mul(stride));
        let end = last.and_then(|last| last.checked_add(size));
        let fits = |bytes: &&[u8]| stride >= size && end.is_some_and(|end| end <= bytes.len());
        let bytes = bytes.filter(fits);
        let bytes =
            bytes.ok_or_else(|| wrong("reaches beyond its buffer; the file was cut off"))?;
        let elements = (0..accessor.count).map(|element| &bytes[element * stride..][..size]);
        Ok(elements.flat_map(|element| scalar.read_all(element, Endian::Little)).collect())
    }
}
