//! PLY through `ply-rs-bw`: ASCII, little- and big-endian, any scalar types.

use super::raw::{Raw, excerpt};
use super::text::trimmed;
use super::{Format, ReadErrorKind};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    BeginList, ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyDef,
    PropertyType, ScalarType,
};
use std::io::{BufRead, ErrorKind};

pub(super) fn read(mut bytes: Vec<u8>) -> Result<Raw, ReadErrorKind> {
    make_header_ascii(&mut bytes);
    end_lines(&mut bytes);
    let mut reader = Reader::new(bytes.as_slice());
    let header =
        Parser::<Other>::new().read_header(&mut reader).map_err(|error| malformed(&error))?;
    let mut raw = Raw::new(0);
    for element in header.elements.values() {
        let remaining = reader.get_ref().len();
        check_count(element, header.encoding, remaining)?;
        match element.name.as_str() {
            "vertex" => {
                if let Some(missing) =
                    ["x", "y", "z"].iter().find(|c| !element.properties.contains_key(**c))
                {
                    return Err(unusable(format!("its vertices have no property '{missing}'")));
                }
                let vertices = Parser::<Vertex>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|error| malformed(&error))?;
                raw.positions = vertices.into_iter().map(|vertex| vertex.position).collect();
            }
            "face" => {
                for face in corners(&mut reader, element, &header, &mut raw)? {
                    face.add_to(&mut raw)?;
                }
            }
            // A list holds several strips, each ended by -1.
            name if name.contains("strip") => {
                for strips in corners(&mut reader, element, &header, &mut raw)? {
                    strips.add_strips_to(&mut raw)?;
                }
            }
            name => {
                let several = format!("elements '{}' were left out", excerpt(name));
                let one = format!("element '{}' was left out", excerpt(name));
                raw.remark(element.count, &one, &several);
                Parser::<Other>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|error| malformed(&error))?;
            }
        }
    }
    let rest = reader.get_ref();
    if header.encoding == Encoding::Ascii {
        let lines =
            trimmed(rest).split(|&byte| byte == b'\n').filter(|line| !line.trim_ascii().is_empty());
        raw.remark(
            lines.count(),
            "line was left out: it follows the elements that the header counts",
            "lines were left out: they follow the elements that the header counts",
        );
    } else {
        raw.remark(
            if trimmed(rest).is_empty() { 0 } else { rest.len() },
            "byte was left out: it follows the elements that the header counts",
            "bytes were left out: they follow the elements that the header counts",
        );
    }
    Ok(raw)
}

/// The lists of vertex numbers of an element, under whatever name.
/// Old programs end lines with a carriage return alone.
fn end_lines(bytes: &mut [u8]) {
    let end = bytes.windows(END.len()).position(|window| window == END);
    let Some(after) = end.map(|end| end + END.len()) else { return };
    let is_text = bytes[..after].windows(5).any(|window| window == b"ascii");
    if bytes[..after].contains(&b'\n') || bytes.get(after) != Some(&b'\r') {
        return;
    }
    let end = if is_text { bytes.len() } else { after + 1 };
    for byte in &mut bytes[..end] {
        if *byte == b'\r' {
            *byte = b'\n';
        }
    }
}

fn corners<T: BufRead>(
    reader: &mut Reader<T>,
    element: &ElementDef,
    header: &ply_rs_bw::ply::Header,
    raw: &mut Raw,
) -> Result<Vec<Face>, ReadErrorKind> {
    let is_list = |property: &&PropertyDef| {
        let PropertyType::List(_, scalar) = &property.data_type else { return false };
        !matches!(scalar, ScalarType::Float | ScalarType::Double)
    };
    let lists: Vec<&PropertyDef> = element.properties.values().filter(is_list).collect();
    let known = lists.iter().find(|list| NAMES.contains(&list.name.as_str()));
    let list = match (known, &lists[..]) {
        (Some(list), _) | (None, [list]) => list.name.as_str(),
        _ if element.count == 0 => NAMES[0],
        _ => {
            let names: Vec<String> =
                lists.iter().map(|list| format!("'{}'", excerpt(&list.name))).collect();
            return Err(unusable(format!(
                "its element '{}' has no list of the name 'vertex_indices' or 'vertex_index', but {}",
                excerpt(&element.name),
                if names.is_empty() { "none".to_owned() } else { names.join(", ") }
            )));
        }
    };
    if !NAMES.contains(&list) {
        raw.remarks.push(format!("vertex numbers were taken from the list '{}'", excerpt(list)));
    }
    let mut renamed = ElementDef { properties: Default::default(), ..element.clone() };
    for property in element.properties.values() {
        let mut property = property.clone();
        // Another list may already have the usual name, and hold other numbers.
        if property.name == list {
            NAMES[0].clone_into(&mut property.name);
        } else if property.name == NAMES[0] {
            property.name += " of other numbers";
        }
        renamed.properties.insert(property.name.clone(), property);
    }
    Parser::<Face>::new()
        .read_payload_for_element(reader, &renamed, header)
        .map_err(|error| malformed(&error))
}

/// The usual names of a face's list of vertex numbers.
const END: &[u8] = b"end_header";

const NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Comments come in any encoding, but the parser requires UTF-8.
fn make_header_ascii(bytes: &mut [u8]) {
    let end = bytes.windows(END.len()).position(|window| window == END).unwrap_or(0);
    for byte in &mut bytes[..end] {
        if !byte.is_ascii() {
            *byte = b'?';
        }
    }
}

/// Refuses an element count that does not fit in the rest of the file, before anything is allocated for it. Elements
/// without properties take no bytes in binary, so their count would be unbounded.
fn check_count(
    element: &ElementDef,
    encoding: Encoding,
    remaining: usize,
) -> Result<(), ReadErrorKind> {
    let least_bytes: usize = match encoding {
        // A number takes at least a digit and a separator; the last line may lack its end.
        Encoding::Ascii => 2 * element.properties.len(),
        _ => element
            .properties
            .values()
            .map(|p| match &p.data_type {
                PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => size(scalar),
            })
            .sum(),
    };
    let room = (remaining + 1) / least_bytes.max(1);
    if element.count > room {
        return Err(ReadErrorKind::Count {
            element: format!("'{}' elements", element.name),
            claimed: element.count as u64,
            found: room as u64,
            at_most: true,
        });
    }
    Ok(())
}

fn size(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

fn malformed(error: &ParseError) -> ReadErrorKind {
    if error.kind() == ErrorKind::UnexpectedEof {
        return ReadErrorKind::Truncated {
            format: Format::Ply,
            missing: "there are fewer elements than its header says".to_owned(),
        };
    }
    // The first line is the message, the others repeat the input.
    let text = error.to_string();
    let first = text.lines().next().unwrap_or_default();
    let what = first.split_once(": ").map_or(first, |(_, what)| what).trim_end_matches('.');
    ReadErrorKind::Malformed { format: Format::Ply, line: error.line(), what: what.to_owned() }
}

fn unusable(what: String) -> ReadErrorKind {
    ReadErrorKind::Malformed { format: Format::Ply, line: None, what }
}

struct Vertex {
    position: [f64; 3],
}

impl Vertex {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        let coordinate = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.position[coordinate] = value;
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        // A coordinate that is not a scalar stays NaN, which is refused later.
        Self { position: [f64::NAN; 3] }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let value = match property {
            Property::Char(v) => f64::from(v),
            Property::UChar(v) => f64::from(v),
            Property::Short(v) => f64::from(v),
            Property::UShort(v) => f64::from(v),
            Property::Int(v) => f64::from(v),
            Property::UInt(v) => f64::from(v),
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            _ => return PropertyAccessResult::Ignored,
        };
        self.set(name, value)
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, f64::from(value))
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value)
    }
}

/// Vertex numbers of a face: in one of two lists, depending on their type in the file.
#[derive(Default)]
struct Face {
    signed: Vec<i32>,
    unsigned: Vec<u32>,
}

impl Face {
    fn numbers(&self) -> impl Iterator<Item = i64> {
        let signed = self.signed.iter().map(|&number| i64::from(number));
        signed.chain(self.unsigned.iter().map(|&number| i64::from(number)))
    }

    fn add_to(&self, raw: &mut Raw) -> Result<(), ReadErrorKind> {
        for number in self.numbers() {
            raw.corners.push(u32::try_from(number).map_err(|_| raw.bad_index(number))?);
        }
        raw.end_face();
        Ok(())
    }

    fn add_strips_to(&self, raw: &mut Raw) -> Result<(), ReadErrorKind> {
        let numbers: Vec<i64> = self.numbers().collect();
        for strip in numbers.split(|&number| number == -1 || number == i64::from(u32::MAX)) {
            for (number, triangle) in strip.windows(3).enumerate() {
                let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
                // Every second triangle is wound the other way.
                for corner in if number % 2 == 0 { [a, b, c] } else { [b, a, c] } {
                    raw.corners.push(u32::try_from(corner).map_err(|_| raw.bad_index(corner))?);
                }
                raw.end_face();
            }
        }
        Ok(())
    }
}

fn is_corners(name: &str) -> bool {
    name == NAMES[0]
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn begin_list_int(&mut self, name: &str, _len: usize) -> BeginList<'_, i32> {
        if is_corners(name) { BeginList::Fill(&mut self.signed) } else { BeginList::UseSetter }
    }

    fn begin_list_uint(&mut self, name: &str, _len: usize) -> BeginList<'_, u32> {
        if is_corners(name) { BeginList::Fill(&mut self.unsigned) } else { BeginList::UseSetter }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !is_corners(name) {
            return PropertyAccessResult::Ignored;
        }
        match property {
            Property::ListChar(v) => self.signed = v.into_iter().map(i32::from).collect(),
            Property::ListShort(v) => self.signed = v.into_iter().map(i32::from).collect(),
            Property::ListUChar(v) => self.unsigned = v.into_iter().map(u32::from).collect(),
            Property::ListUShort(v) => self.unsigned = v.into_iter().map(u32::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

/// Elements that are not used.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}
