//! VTK's XML, PolyData and unstructured grids: text, inline binary and appended data, compressed by zlib or not.
//!
//! Our own reader on top of `quick-xml`; `vtk.rs` says why not `vtkio`.

use super::groups::is_name;
use super::raw::{Raw, coordinate, excerpt};
use super::scalar::{Endian, Scalar, index};
use super::vtk_cells::{LabelledFaces, not_a_surface, split};
use super::{Format, ReadErrorKind, ReadTarget, base64, inflate};
use flate2::read::ZlibDecoder;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::mem::take;

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// The element whose content may not be XML.
const APPENDED: &[u8] = b"<AppendedData";

pub(super) fn read(bytes: &[u8], wanted: ReadTarget) -> Result<Raw> {
    let end = bytes.windows(APPENDED.len()).position(|window| window == APPENDED);
    let (head, appended) = bytes.split_at(end.unwrap_or(bytes.len()));
    let head = String::from_utf8_lossy(head);
    let mut file = File { appended, surface: LabelledFaces::of(wanted), ..File::default() };
    let mut xml = Reader::from_str(&head);
    // Only the end of the document is cut off.
    xml.config_mut().check_end_names = false;
    loop {
        match xml.read_event().map_err(|error| malformed(error.to_string()))? {
            Event::Start(tag) => file.enter(&tag)?,
            Event::Empty(tag) => {
                file.enter(&tag)?;
                file.leave(tag.name().0)?;
            }
            Event::Text(text) => file.text(&text.xml10_content()),
            Event::CData(text) => file.text(&text.xml10_content()),
            Event::GeneralRef(entity) if file.array.is_some() => {
                return Err(malformed(format!("the entity '{}' among numbers", excerpt(&entity))));
            }
            Event::End(tag) => file.leave(tag.name().0)?,
            Event::Eof => break,
            _ => {}
        }
    }
    if file.order.is_none() {
        return Err(malformed("no <VTKFile> in it".to_owned()));
    }
    if !file.is_complete {
        return Err(truncated(&format!("no </{}>", file.kind)));
    }
    file.surface.end()
}

fn malformed(what: String) -> ReadErrorKind {
    ReadErrorKind::Malformed { format: Format::Vtp, line: None, what }
}

fn truncated(missing: &str) -> ReadErrorKind {
    ReadErrorKind::Truncated { format: Format::Vtp, missing: missing.to_owned() }
}

/// The numbers of an element that is being read.
struct Array {
    name: String,
    scalar: Scalar,
    format: String,
    offset: usize,
    text: String,
    /// Depth of elements inside, whose text does not belong to the array.
    depth: usize,
}

#[derive(Default)]
struct File<'a> {
    order: Option<Endian>,
    has_long_headers: bool,
    is_compressed: bool,
    /// From the element `AppendedData` on.
    appended: &'a [u8],
    /// `PolyData` or `UnstructuredGrid`.
    kind: String,
    /// Points, Polys, Strips, Cells, `CellData`, or others.
    section: String,
    array: Option<Array>,
    connectivity: Vec<u64>,
    offsets: Vec<u64>,
    types: Vec<u64>,
    /// Number of vertices in the previous pieces.
    first: u32,
    /// The cells of a piece, the number of cells that are not polygons, and their labels.
    polygons: Vec<Vec<u32>>,
    strips: Vec<Vec<u32>>,
    grid: Vec<(u64, Vec<u32>)>,
    others: usize,
    /// The piece's number of points, as stated.
    points: Option<usize>,
    labels: Option<Vec<f64>>,
    surface: LabelledFaces,
    is_complete: bool,
}

impl File<'_> {
    fn enter(&mut self, tag: &BytesStart<'_>) -> Result<()> {
        let attribute = |name: &str| match tag.try_get_attribute(name) {
            Ok(found) => Ok(found.map(|attribute| attribute.value.into_owned())),
            Err(error) => Err(malformed(error.to_string())),
        };
        if let Some(array) = &mut self.array {
            array.depth += 1;
            return Ok(());
        }
        match tag.name().0 {
            "VTKFile" => {
                let kind = attribute("type")?.unwrap_or_default();
                if !matches!(kind.as_str(), "PolyData" | "UnstructuredGrid") {
                    return Err(not_a_surface(&kind, self.surface.wanted));
                }
                self.kind = kind;
                let is_big = attribute("byte_order")?.is_some_and(|order| order == "BigEndian");
                self.order = Some(if is_big { Endian::Big } else { Endian::Little });
                self.has_long_headers = attribute("header_type")?.is_some_and(|t| t == "UInt64");
                self.is_compressed = match attribute("compressor")?.as_deref() {
                    None | Some("") => false,
                    Some("vtkZLibDataCompressor") => true,
                    Some(other) => {
                        return Err(ReadErrorKind::Foreign {
                            what: format!("VTK data compressed by {}", excerpt(other)),
                            remedy: "save it with ZLib or without compression".to_owned(),
                        });
                    }
                };
            }
            "Piece" => {
                self.first = self.surface.raw.positions.len() as u32;
                self.others = 0;
                self.points = attribute("NumberOfPoints")?.and_then(|n| n.trim().parse().ok());
                for name in ["NumberOfVerts", "NumberOfLines"] {
                    let count = attribute(name)?.and_then(|count| count.trim().parse().ok());
                    self.others = self.others.saturating_add(count.unwrap_or(0));
                }
            }
            "DataArray" if self.is_read(&attribute("Name")?.unwrap_or_default()) => {
                let kind = attribute("type")?.unwrap_or_default();
                // Labels that are not numbers are ignored.
                if self.section == "CellData" && scalar(&kind).is_err() {
                    return Ok(());
                }
                let width = attribute("NumberOfComponents")?;
                if self.section == "Points" && width.as_ref().is_some_and(|n| n.trim() != "3") {
                    let width = width.unwrap_or_default();
                    return Err(malformed(format!("points of {} coordinates", excerpt(&width))));
                }
                let offset = attribute("offset")?.and_then(|offset| offset.trim().parse().ok());
                self.array = Some(Array {
                    name: attribute("Name")?.unwrap_or_default(),
                    scalar: scalar(&kind)?,
                    format: attribute("format")?.unwrap_or_default(),
                    offset: offset.unwrap_or(0),
                    text: String::new(),
                    depth: 0,
                });
            }
            "Points" | "Verts" | "Lines" | "Polys" | "Strips" | "Cells" | "PointData"
            | "CellData" | "FieldData" => tag.name().0.clone_into(&mut self.section),
            // Arrays of strings, and information about an array.
            _ => {}
        }
        Ok(())
    }

    /// Whether an array of this name is needed.
    fn is_read(&self, name: &str) -> bool {
        match self.section.as_str() {
            "Points" => true,
            "Polys" | "Strips" | "Cells" => {
                matches!(name, "connectivity" | "offsets" | "types")
            }
            "CellData" => self.surface.wanted == ReadTarget::Groups && is_name(name),
            _ => false,
        }
    }

    /// Adds the cells of a piece.
    fn end_piece(&mut self) -> Result<()> {
        let (polygons, bands) = (take(&mut self.polygons), take(&mut self.strips));
        let labels = self.labels.take();
        let points = self.surface.raw.positions.len() - self.first as usize;
        if let Some(stated) = self.points.filter(|&stated| stated != points) {
            return Err(malformed(format!(
                "a piece of {stated} points, with the arrays of {points}"
            )));
        }
        if labels.is_some() && !polygons.is_empty() && !bands.is_empty() {
            return Err(ReadErrorKind::Foreign {
                what: "VTK data with labels of polygons and strips together".to_owned(),
                remedy: "save it as triangles: in ParaView, the filter Triangulate".to_owned(),
            });
        }
        // Pieces repeat the points at their common border, so the cells' faces there would seem to be on the boundary.
        if self.surface.has_volumes() {
            return Err(ReadErrorKind::Foreign {
                what: "a VTK grid of volume cells in several pieces".to_owned(),
                remedy: match self.surface.wanted {
                    ReadTarget::Volume => {
                        "join them: in ParaView, the filter Merge Blocks and then Save Data"
                    }
                    _ => "save its skin: in ParaView, the filters Merge Blocks and Extract Surface",
                }
                .to_owned(),
            });
        }
        self.surface.begin(labels);
        self.surface.skip(self.others);
        self.surface.faces(&polygons);
        self.surface.strips(&bands);
        for (kind, cell) in take(&mut self.grid) {
            self.surface.grid_cell(kind, cell, malformed)?;
        }
        self.surface.end_piece().map_err(malformed)
    }

    fn text(&mut self, text: &str) {
        if let Some(array) = self.array.as_mut().filter(|array| array.depth == 0) {
            array.text += text;
        }
    }

    fn leave(&mut self, tag: &str) -> Result<()> {
        if let Some(mut array) = self.array.take() {
            if array.depth > 0 {
                array.depth -= 1;
                self.array = Some(array);
                return Ok(());
            }
            let numbers = self.numbers(&array)?;
            let indices = || {
                let not_one = |number: &f64| malformed(format!("{number} is not a point number"));
                numbers.iter().map(|n| index(*n).ok_or_else(|| not_one(n))).collect::<Result<_>>()
            };
            match array.name.as_str() {
                _ if self.section == "Points" => {
                    let (points, rest) = numbers.as_chunks::<3>();
                    if !rest.is_empty() {
                        return Err(malformed("points that have not three coordinates".to_owned()));
                    }
                    self.surface.raw.positions.extend(points);
                }
                _ if self.section == "CellData" => self.labels = Some(numbers),
                "connectivity" => self.connectivity = indices()?,
                "offsets" => self.offsets = indices()?,
                "types" => self.types = indices()?,
                _ => {}
            }
            return Ok(());
        }
        match tag {
            "Polys" | "Strips" | "Cells" => {
                let points = take(&mut self.connectivity);
                let mut cells = split(&take(&mut self.offsets), &points).map_err(malformed)?;
                for point in cells.iter_mut().flatten() {
                    *point = point.saturating_add(self.first);
                }
                match tag {
                    "Polys" => self.polygons = cells,
                    "Strips" => self.strips = cells,
                    _ => {
                        let types = take(&mut self.types);
                        if types.len() != cells.len() {
                            let (cells, types) = (cells.len(), types.len());
                            return Err(malformed(format!("{cells} cells and {types} cell types")));
                        }
                        self.grid = types.into_iter().zip(cells).collect();
                    }
                }
            }
            "Piece" => self.end_piece()?,
            "PolyData" | "UnstructuredGrid" => self.is_complete = true,
            _ => {}
        }
        Ok(())
    }

    fn numbers(&self, array: &Array) -> Result<Vec<f64>> {
        let order = self.order.ok_or_else(|| malformed("no VTKFile around its data".to_owned()))?;
        let bytes = match array.format.as_str() {
            "ascii" => {
                let not_one = |word| malformed(format!("'{}' is not a number", excerpt(word)));
                return words(&array.text).map_err(not_one);
            }
            "binary" => self.payload(&decoded(array.text.as_bytes())?, order)?,
            "appended" => {
                let (is_raw, data) = self.appended()?;
                let data = data.get(array.offset..).ok_or_else(|| truncated("appended data"))?;
                if is_raw {
                    self.payload(data, order)?
                } else {
                    self.payload(&decoded(data)?, order)?
                }
            }
            other => return Err(malformed(format!("data as '{}'", excerpt(other)))),
        };
        Ok(array.scalar.read_all(&bytes, order))
    }

    /// Whether appended data are raw bytes, and the data, which start after an underscore.
    fn appended(&self) -> Result<(bool, &[u8])> {
        let end = self.appended.iter().position(|&byte| byte == b'>');
        let (tag, content) = self.appended.split_at(end.ok_or_else(|| truncated("appended data"))?);
        let start = content.iter().position(|&byte| byte == b'_');
        let start = start.ok_or_else(|| malformed("appended data without '_'".to_owned()))?;
        Ok((tag.windows(5).any(|window| window == b"\"raw\""), &content[start + 1..]))
    }

    /// The data that a header announces: one run of bytes, or compressed blocks.
    fn payload(&self, data: &[u8], order: Endian) -> Result<Vec<u8>> {
        let scalar = if self.has_long_headers { Scalar::U64 } else { Scalar::U32 };
        let cut_off = || truncated("an array of numbers is shorter than its header says");
        let mut rest = data;
        let mut take = |length: u64| -> Result<&[u8]> {
            let length = usize::try_from(length).unwrap_or(usize::MAX);
            let (taken, after) = rest.split_at_checked(length).ok_or_else(cut_off)?;
            rest = after;
            Ok(taken)
        };
        let word = |bytes: &[u8]| index(scalar.read(bytes, order)).ok_or_else(cut_off);
        let size = scalar.bytes() as u64;
        let first = word(take(size)?)?;
        if !self.is_compressed {
            return Ok(take(first)?.to_vec());
        }
        // The number of blocks, their size, the size of the last one, and then the compressed size of each.
        let _sizes = take(2 * size)?;
        let sizes = take(first.saturating_mul(size))?;
        let mut bytes = Vec::new();
        for length in sizes.chunks_exact(size as usize) {
            let block = take(word(length)?)?;
            let block = inflate::read(ZlibDecoder::new(block), block.len());
            bytes.extend(block.map_err(|error| malformed(format!("compressed data: {error}")))?);
        }
        Ok(bytes)
    }
}

fn decoded(text: &[u8]) -> Result<Vec<u8>> {
    base64::decode(text).ok_or_else(|| malformed("binary data that is no base64".to_owned()))
}

fn scalar(name: &str) -> Result<Scalar> {
    Ok(match name {
        "Int8" => Scalar::I8,
        "UInt8" => Scalar::U8,
        "Int16" => Scalar::I16,
        "UInt16" => Scalar::U16,
        "Int32" => Scalar::I32,
        "UInt32" => Scalar::U32,
        "Int64" => Scalar::I64,
        "UInt64" => Scalar::U64,
        "Float32" => Scalar::F32,
        "Float64" => Scalar::F64,
        _ => return Err(malformed(format!("'{}' is no type of numbers", excerpt(name)))),
    })
}

/// All numbers of a text, or the first word that is not a number.
fn words(text: &str) -> std::result::Result<Vec<f64>, &str> {
    text.split_ascii_whitespace().map(|word| coordinate(word).ok_or(word)).collect()
}
