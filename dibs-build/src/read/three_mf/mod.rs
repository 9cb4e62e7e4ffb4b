//! 3MF: the objects that its build refers to, from all models of the package.
//!
//! Our own reader on top of `zip` and `quick-xml`, although `threemf` exists: it ignores the transforms of an object's
//! parts, and allocates as much memory as a compressed file asks for.

mod package;

use super::raw::{Raw, coordinate, excerpt};
use super::{Format, ReadErrorKind, inflate};
use crate::Unit;
use glam::{DMat4, DVec3};
use package::{Package, tags};
use quick_xml::events::BytesStart;
use std::collections::{HashMap, HashSet};

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// An organ has no more copies of its vertices than this, unless the copies are few.
const MOST_COPIES: usize = 10;

/// Parts of the namespaces of extensions that are read, or that change no position.
const KNOWN: [&str; 3] = ["/production/", "/material/", "/trianglesets/"];

/// The prefix of most extensions' namespaces.
const NAMESPACES: &str = "http://schemas.microsoft.com/3dmanufacturing/";

/// Elements with geometry of another kind.
const OTHERS: [&str; 5] =
    ["beamlattice", "booleanshape", "displacementmesh", "levelset", "slicestack"];

pub(super) fn read(bytes: &[u8]) -> Result<Raw> {
    let mut package = Package::new(bytes)?;
    let root = package.root()?;
    let mut model = Model::default();
    let mut seen = HashSet::from([root.clone()]);
    let mut waiting = vec![root];
    while let Some(path) = waiting.pop() {
        let text = package.text(&path)?;
        (model.path, model.current) = (path, None);
        tags(&text, |tag| model.enter(tag))?;
        // With the production extension, objects may be in models of their own.
        for other in std::mem::take(&mut model.others) {
            if seen.insert(other.clone()) {
                waiting.push(other);
            }
        }
    }
    model.modifiers = modifiers(&mut package)?;
    model.assemble(bytes.len())
}

/// Parts that slicers mark, in files of their own, as subtracted from an object or as a region of other settings.
fn modifiers(package: &mut Package<'_>) -> Result<usize> {
    let mut modifiers = 0;
    // The files of Bambu Studio and OrcaSlicer, and of PrusaSlicer.
    for path in ["Metadata/model_settings.config", "Metadata/Slic3r_PE_model.config"] {
        if !package.has(path) {
            continue;
        }
        tags(&package.text(path)?, |tag| {
            let value = |name| tag.try_get_attribute(name).ok().flatten().map(|found| found.value);
            let kind = match tag.local_name().as_ref() {
                "part" => value("subtype"),
                "metadata" if value("key").is_some_and(|key| key == "volume_type") => {
                    value("value")
                }
                _ => None,
            };
            let is_other = |kind: &str| !matches!(kind, "normal_part" | "ModelPart");
            modifiers += usize::from(kind.is_some_and(|kind| is_other(&kind)));
            Ok(())
        })?;
    }
    Ok(modifiers)
}

fn malformed(what: impl Into<String>) -> ReadErrorKind {
    ReadErrorKind::Malformed { format: Format::ThreeMf, line: None, what: what.into() }
}

#[derive(Default)]
struct Object {
    /// Whether its type is not `model`, but `support` or another kind that is not part of the surface.
    is_support: bool,
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Component objects, and their transforms.
    parts: Vec<(Key, DMat4)>,
}

/// The path of a model and the number of an object in it.
type Key = (String, String);

#[derive(Default)]
struct Model {
    /// The unit of the package's first model.
    unit: Option<Unit>,
    /// Length of the present model's unit in the package's unit.
    scale: f64,
    /// The path of the present model, and the other models that it refers to.
    path: String,
    others: Vec<String>,
    objects: Vec<Object>,
    /// The present object.
    current: Option<usize>,
    /// The index in `objects` of each object's key.
    numbers: HashMap<Key, usize>,
    items: Vec<(Key, DMat4)>,
    /// Number of elements that are left out.
    unread: usize,
    /// Number of parts that are not part of the surface, but are read as if they were.
    modifiers: usize,
}

impl Model {
    fn enter(&mut self, tag: &BytesStart<'_>) -> Result<()> {
        let name = tag.local_name();
        let attribute = |name: &str| match tag.try_get_attribute(name) {
            Ok(found) => Ok(found.map(|attribute| attribute.value.into_owned())),
            Err(error) => Err(malformed(error.to_string())),
        };
        let needed = |of: &str| {
            attribute(of)?
                .ok_or_else(|| malformed(format!("<{}> has no {of}", excerpt(name.as_ref()))))
        };
        let number = |of: &str| {
            let text = needed(of)?;
            coordinate(text.trim())
                .ok_or_else(|| malformed(format!("'{}' is not a number", excerpt(&text))))
        };
        let row = |of: &str| {
            let text = needed(of)?;
            let row = text.trim().parse();
            row.map_err(|_| malformed(format!("'{}' is not a vertex number", excerpt(&text))))
        };
        match name.as_ref() {
            "model" => {
                check_required(tag)?;
                let (unit, factor) = unit(attribute("unit")?.as_deref())?;
                let first = *self.unit.get_or_insert(unit);
                self.scale = factor * unit.millimetres() / first.millimetres();
            }
            "object" => {
                self.numbers.insert((self.path.clone(), needed("id")?), self.objects.len());
                self.current = Some(self.objects.len());
                let kind = attribute("type")?;
                let is_support =
                    matches!(kind.as_deref(), Some("support" | "solidsupport" | "other"));
                self.objects.push(Object { is_support, ..Object::default() });
            }
            "vertex" => {
                let position = [number("x")?, number("y")?, number("z")?];
                let scale = self.scale;
                self.object()?.positions.push(position.map(|x| scale * x));
            }
            "triangle" => {
                let triangle = [row("v1")?, row("v2")?, row("v3")?];
                self.object()?.triangles.push(triangle);
            }
            "component" | "item" => {
                let path = match with_prefix(tag, "path") {
                    Some(path) => {
                        let path = path.trim_start_matches('/').to_owned();
                        self.others.push(path.clone());
                        path
                    }
                    None => self.path.clone(),
                };
                let place = transform(attribute("transform")?.as_deref(), self.scale)?;
                let part = ((path, needed("objectid")?), place);
                if name.as_ref() == "item" {
                    self.items.push(part);
                } else {
                    self.object()?.parts.push(part);
                }
            }
            other if OTHERS.contains(&other) => self.unread += 1,
            _ => {}
        }
        Ok(())
    }

    fn object(&mut self) -> Result<&mut Object> {
        let object = self.current.and_then(|current| self.objects.get_mut(current));
        object.ok_or_else(|| malformed("a mesh outside of an object"))
    }

    fn find(&self, key: &Key) -> Result<usize> {
        let unknown = || malformed(format!("object {} is not there", excerpt(&key.1)));
        self.numbers.get(key).copied().ok_or_else(unknown)
    }

    /// Places every item of the build, with all its components.
    fn assemble(self, bytes: usize) -> Result<Raw> {
        if self.items.is_empty() {
            return Err(malformed("its build names no object"));
        }
        let vertices: usize = self.objects.iter().map(|object| object.positions.len()).sum();
        // A plausible file of so many bytes may contain many copies of a small object.
        let most = bytes.max(MOST_COPIES * vertices);
        let mut raw = Raw::new(0);
        let items = self.items.iter().rev().map(|(key, place)| Ok((self.find(key)?, *place)));
        let mut waiting = items.collect::<Result<Vec<_>>>()?;
        let mut is_placed = vec![false; self.objects.len()];
        let (mut placed, mut supports) = (0, 0);
        while let Some((number, place)) = waiting.pop() {
            let object = &self.objects[number];
            is_placed[number] = true;
            placed += 1;
            if raw.positions.len() + object.positions.len() > most || placed > most {
                return Err(malformed("too many copies of its objects, or one in itself"));
            }
            if object.is_support {
                supports += 1;
                continue;
            }
            object.add_to(&mut raw, &place);
            for (key, inner) in object.parts.iter().rev() {
                waiting.push((self.find(key)?, place * *inner));
            }
        }
        raw.unit = self.unit;
        let is_elsewhere =
            |(object, placed): &(&Object, &bool)| !**placed && !object.triangles.is_empty();
        let elsewhere = self.objects.iter().zip(&is_placed).filter(is_elsewhere).count();
        raw.remark(
            elsewhere,
            "object was left out: it is not in the build",
            "objects were left out: they are not in the build",
        );
        raw.remark(
            supports,
            "object was left out: it is of a type for supports",
            "objects were left out: they are of a type for supports",
        );
        raw.remark(
            self.modifiers,
            "part was read as surface, although a slicer takes it away, or for its settings alone: delete it there",
            "parts were read as surface, although a slicer takes them away, or for their settings alone: delete them there",
        );
        raw.remark(
            self.unread,
            "element of an extension was left out: a lattice, a boolean or the like",
            "elements of extensions were left out: lattices, booleans or the like",
        );
        Ok(raw)
    }
}

impl Object {
    fn add_to(&self, raw: &mut Raw, place: &DMat4) {
        let first = raw.positions.len() as u32;
        let positions = self.positions.iter();
        raw.positions.extend(positions.map(|&p| place.transform_point3(DVec3::from(p)).to_array()));
        // A mirror turns triangles inside out: reversing their order keeps their outer side outside.
        let is_mirrored = place.determinant() < 0.0;
        for &[a, b, c] in &self.triangles {
            let triangle = if is_mirrored { [a, c, b] } else { [a, b, c] };
            raw.corners.extend(triangle.map(|row| match self.positions.get(row as usize) {
                Some(_) => first + row,
                // A number that no vertex has.
                None => u32::MAX,
            }));
            raw.end_face();
        }
    }
}

/// A reader that does not know an extension that a model requires must refuse it.
fn check_required(model: &BytesStart<'_>) -> Result<()> {
    let required = model.try_get_attribute("requiredextensions");
    let required = required.map_err(|error| malformed(error.to_string()))?;
    let Some(required) = required else { return Ok(()) };
    for prefix in required.value.split_whitespace() {
        let namespace = model.try_get_attribute(format!("xmlns:{prefix}").as_str()).ok().flatten();
        let namespace = namespace.map_or(prefix.to_owned(), |found| found.value.into_owned());
        if !KNOWN.iter().any(|known| namespace.contains(known)) {
            return Err(ReadErrorKind::Foreign {
                what: format!(
                    "3MF that requires the extension {}, which is not read",
                    excerpt(namespace.trim_start_matches(NAMESPACES))
                ),
                remedy: "export it without this extension, or as PLY".to_owned(),
            });
        }
    }
    Ok(())
}

/// An attribute of an extension, with any prefix.
fn with_prefix(tag: &BytesStart<'_>, name: &str) -> Option<String> {
    let attributes = tag.attributes().filter_map(std::result::Result::ok);
    let mut named = attributes.filter(|attribute| attribute.key.local_name().as_ref() == name);
    named.next().map(|attribute| attribute.value.into_owned())
}

/// The unit for the one that a model states, and the stated unit's length in it: a foot is 12 inches.
fn unit(name: Option<&str>) -> Result<(Unit, f64)> {
    Ok(match name {
        None | Some("millimeter") => (Unit::Millimetre, 1.0),
        Some("micron") => (Unit::Micrometre, 1.0),
        Some("centimeter") => (Unit::Centimetre, 1.0),
        Some("inch") => (Unit::Inch, 1.0),
        Some("foot") => (Unit::Inch, 12.0),
        Some("meter") => (Unit::Metre, 1.0),
        Some(other) => return Err(malformed(format!("the unit '{}'", excerpt(other)))),
    })
}

/// Twelve numbers: the images of the axes, then the translation, which is a length.
fn transform(text: Option<&str>, scale: f64) -> Result<DMat4> {
    let Some(text) = text else { return Ok(DMat4::IDENTITY) };
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(coordinate).collect();
    match numbers.as_ref().map(|numbers| numbers.as_chunks::<3>().0) {
        Some(&[x, y, z, origin]) => Ok(DMat4::from_cols(
            DVec3::from(x).extend(0.0),
            DVec3::from(y).extend(0.0),
            DVec3::from(z).extend(0.0),
            (scale * DVec3::from(origin)).extend(1.0),
        )),
        _ => Err(malformed(format!("'{}' is no transform", excerpt(text)))),
    }
}
