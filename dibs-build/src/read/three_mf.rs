//! 3MF: the objects that its build names, in millimetres.
//!
//! Our own reader of what `zip` and `quick-xml` find, although `threemf` exists: that leaves out where an object's
//! parts are placed, and takes all the memory that a compressed file asks for.

use super::raw::{Raw, coordinate, excerpt};
use super::{Format, ReadErrorKind, inflate};
use glam::{DMat4, DVec3};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;
use std::io::Cursor;
use zip::ZipArchive;

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// More copies of its vertices than this are no organ.
const MOST_COPIES: usize = 16;

pub(super) fn read(bytes: &[u8]) -> Result<Raw> {
    let text = model(bytes)?;
    let mut model = Model::default();
    let mut xml = Reader::from_str(&text);
    loop {
        match xml.read_event().map_err(|error| malformed(error.to_string()))? {
            Event::Start(tag) | Event::Empty(tag) => model.enter(&tag)?,
            Event::Eof => break,
            _ => {}
        }
    }
    model.assemble()
}

fn malformed(what: String) -> ReadErrorKind {
    ReadErrorKind::Malformed { format: Format::ThreeMf, line: None, what }
}

/// The text of the package's model.
fn model(bytes: &[u8]) -> Result<String> {
    let fail = |error: zip::result::ZipError| malformed(error.to_string());
    let mut package = ZipArchive::new(Cursor::new(bytes)).map_err(fail)?;
    let models: Vec<usize> = (0..package.len())
        .filter(|&number| {
            package
                .name_for_index(number)
                .and_then(std::result::Result::ok)
                .is_some_and(|n| n.ends_with(".model"))
        })
        .collect();
    let &[number] = &models[..] else {
        return Err(malformed(format!("{} models where one must be", models.len())));
    };
    let entry = package.by_index(number).map_err(fail)?;
    let text = inflate::read(entry, bytes.len()).map_err(|error| malformed(error.to_string()))?;
    String::from_utf8(text).map_err(|_| malformed("a model that is no UTF-8".to_owned()))
}

#[derive(Default)]
struct Object {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Other objects, and where they are placed.
    parts: Vec<(usize, DMat4)>,
}

#[derive(Default)]
struct Model {
    /// Millimetres of a unit; 0 before it is known.
    unit: f64,
    objects: Vec<Object>,
    /// The place in `objects` of each number in the file.
    numbers: HashMap<String, usize>,
    items: Vec<(usize, DMat4)>,
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
            row.map_err(|_| malformed(format!("'{}' is no number of a vertex", excerpt(&text))))
        };
        match name.as_ref() {
            "model" => self.unit = millimetres(attribute("unit")?.as_deref())?,
            "object" => {
                self.numbers.insert(needed("id")?, self.objects.len());
                self.objects.push(Object::default());
            }
            "vertex" => {
                let position = [number("x")?, number("y")?, number("z")?];
                self.object()?.positions.push(position);
            }
            "triangle" => {
                let triangle = [row("v1")?, row("v2")?, row("v3")?];
                self.object()?.triangles.push(triangle);
            }
            "component" | "item" => {
                let id = needed("objectid")?;
                let unknown = || malformed(format!("object {} is not there", excerpt(&id)));
                let object = self.numbers.get(&id).copied().ok_or_else(unknown)?;
                let place = (object, transform(attribute("transform")?.as_deref())?);
                if name.as_ref() == "item" {
                    self.items.push(place);
                } else if object + 1 == self.objects.len() {
                    return Err(malformed(format!("object {} is part of itself", excerpt(&id))));
                } else {
                    self.object()?.parts.push(place);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn object(&mut self) -> Result<&mut Object> {
        self.objects.last_mut().ok_or_else(|| malformed("a mesh outside of an object".to_owned()))
    }

    /// Places every item. Parts are objects that were there before, so this ends.
    fn assemble(self) -> Result<Raw> {
        let vertices: usize = self.objects.iter().map(|object| object.positions.len()).sum();
        let mut raw = Raw::new(0);
        let scale = DMat4::from_scale(DVec3::splat(self.unit));
        let mut waiting: Vec<(usize, DMat4)> =
            self.items.iter().rev().map(|&(object, place)| (object, scale * place)).collect();
        let mut placed = 0;
        while let Some((number, place)) = waiting.pop() {
            let object = &self.objects[number];
            placed += 1;
            if raw.positions.len() + object.positions.len() > MOST_COPIES * vertices
                || placed > MOST_COPIES * self.objects.len()
            {
                let what = format!("more than {MOST_COPIES} copies of its objects");
                return Err(malformed(what));
            }
            let first = raw.positions.len() as u32;
            let positions = object.positions.iter();
            raw.positions
                .extend(positions.map(|&p| place.transform_point3(DVec3::from(p)).to_array()));
            // A mirror turns triangles over: the other way round their outer side stays outside.
            let is_mirrored = place.determinant() < 0.0;
            for &[a, b, c] in &object.triangles {
                let triangle = if is_mirrored { [a, c, b] } else { [a, b, c] };
                raw.corners.extend(triangle.map(|row| match object.positions.get(row as usize) {
                    Some(_) => first + row,
                    // Of no vertex of any object.
                    None => u32::MAX,
                }));
                raw.end_face();
            }
            waiting.extend(object.parts.iter().rev().map(|&(part, inner)| (part, place * inner)));
        }
        Ok(raw)
    }
}

fn millimetres(unit: Option<&str>) -> Result<f64> {
    Ok(match unit {
        None | Some("millimeter") => 1.0,
        Some("micron") => 1e-3,
        Some("centimeter") => 10.0,
        Some("inch") => 25.4,
        Some("foot") => 304.8,
        Some("meter") => 1000.0,
        Some(other) => return Err(malformed(format!("the unit '{}'", excerpt(other)))),
    })
}

/// Twelve numbers: the images of the axes, and then of the origin.
fn transform(text: Option<&str>) -> Result<DMat4> {
    let Some(text) = text else { return Ok(DMat4::IDENTITY) };
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(coordinate).collect();
    match numbers.as_ref().map(|numbers| numbers.as_chunks::<3>().0) {
        Some(&[x, y, z, origin]) => Ok(DMat4::from_cols(
            DVec3::from(x).extend(0.0),
            DVec3::from(y).extend(0.0),
            DVec3::from(z).extend(0.0),
            DVec3::from(origin).extend(1.0),
        )),
        _ => Err(malformed(format!("'{}' is no transform", excerpt(text)))),
    }
}
