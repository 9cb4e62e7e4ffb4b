//! Turns a file's elements into a checked mesh. One file, because the checks depend on their order.

// Requirement: M-03

use super::coordinates::{FileCoordinates, check_nearness, rounding};
use super::polygon::Triangulator;
use super::raw::Raw;
use super::weld::first_coincident;
use super::{Format, Import, ReadErrorKind, ReadOptions, Report};
use crate::Mesh;
use crate::components::connected_by_vertices;
use dibs_nostd::format::MAX_ROOTS;
use glam::{DVec3, Vec3};
use std::collections::{HashMap, HashSet};

/// The exact tests multiply two squared lengths. For edges down to a thousandth of a mesh of this size, the product of
/// two squared edges is still a normal f32.
const LEAST_EXTENT: f64 = 1e-6;

/// Above this, fourth powers of distances overflow f32.
const MOST_COORDINATE: f64 = dibs_nostd::MAX_COORDINATE as f64;

/// Ear clipping takes quadratic time at worst: up to a second for a face below this size.
const MOST_CORNERS: usize = 10_000;

/// Faces of more corners than this must be few: the squares of all corner counts sum up to at most three times the
/// largest.
const FEW_CORNERS: usize = 100;
const MOST_WORK: usize = 3 * MOST_CORNERS * MOST_CORNERS;

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// Checks a mesh whose positions are already converted by their `place`.
pub(crate) fn import(
    raw: &Raw,
    format: Format,
    options: &ReadOptions,
    place: FileCoordinates,
) -> Result<Import> {
    let positions = positions(raw, format)?;
    let is_stl = matches!(format, Format::StlAscii | Format::StlBinary);
    let mut report = Report {
        format,
        unit: place.unit,
        extension_disagrees: false,
        vertices: 0,
        unreferenced_vertices: 0,
        faces: raw.ends.len(),
        triangles: 0,
        file_triangles: 0,
        polygons_triangulated: 0,
        polygons_not_simple: 0,
        welded: 0,
        coincident: 0,
        dropped_degenerate: 0,
        dropped_duplicates: 0,
        components: Vec::new(),
        border_edges: 0,
        non_manifold_edges: 0,
        inconsistent_edges: 0,
        extent: 0.0,
        origin: place.origin.to_array(),
        recentred: options.origin.is_none() && place.origin != DVec3::ZERO,
        position_error: position_error(raw, place.origin),
        remarks: raw.remarks.clone(),
    };
    let (faces, short) = triangles(raw, &mut report)?;
    report.file_triangles = faces.len();
    let mut surface = Surface { positions, faces, short };
    check_scale(raw, format)?;
    report.extent =
        check_nearness(raw.corner_positions().map(DVec3::from), || "the mesh".to_owned())?;
    surface.weld(is_stl, options.weld_tolerance, &mut report);
    surface.drop_degenerate(options.strict, &mut report)?;
    surface.drop_duplicates(options.strict, &mut report)?;
    if surface.faces.is_empty() {
        let Report { dropped_degenerate: degenerate, remarks, .. } = report;
        return Err(ReadErrorKind::NoTriangles { degenerate, remarks });
    }
    surface.keep_components(options.largest_component, &mut report)?;
    surface.count_edges(&mut report);
    surface.count_vertices(&mut report);
    report.triangles = surface.faces.len();
    let faces = || surface.faces.iter().map(|triangle| triangle.face);
    let groups = raw.groups.as_ref();
    let groups = groups.map(|groups| groups.labels(faces(), format == Format::Obj)).transpose()?;
    let faces = faces().map(|face| face as u32 - 1).collect();
    let triangles = surface.faces.into_iter().map(|face| face.corners).collect();
    Ok(Import {
        mesh: Mesh { origin: place.origin, positions: surface.positions, triangles },
        report,
        groups,
        faces,
    })
}

/// The name of a vertex in an error.
fn vertex_name(vertex: usize, format: Format) -> String {
    match format {
        Format::Obj => format!("vertex {}", vertex + 1),
        Format::StlAscii | Format::StlBinary => {
            format!("corner {} of triangle {}", vertex % 3 + 1, vertex / 3 + 1)
        }
        _ => format!("vertex {vertex} (counted from 0)"),
    }
}

fn positions(raw: &Raw, format: Format) -> Result<Vec<Vec3>> {
    let narrow = |(row, position): (usize, &[f64; 3])| {
        for &value in position {
            let vertex = || vertex_name(row, format);
            if !value.is_finite() {
                return Err(ReadErrorKind::NonFinite { vertex: vertex(), value });
            }
            if !(value as f32).is_finite() {
                return Err(ReadErrorKind::Overflow { vertex: vertex(), value });
            }
        }
        Ok(Vec3::from_array(position.map(|value| value as f32)))
    };
    raw.positions.iter().enumerate().map(narrow).collect()
}

fn check_scale(raw: &Raw, format: Format) -> Result<()> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for &row in &raw.corners {
        let Some(position) = raw.positions.get(row as usize) else { continue };
        for ((low, high), &value) in low.iter_mut().zip(&mut high).zip(position) {
            if value.abs() > MOST_COORDINATE {
                let vertex = vertex_name(row as usize, format);
                return Err(ReadErrorKind::TooLarge { vertex, value, most: MOST_COORDINATE });
            }
            *low = low.min(value);
            *high = high.max(value);
        }
    }
    let extent = low.iter().zip(&high).map(|(l, h)| (h - l) * (h - l)).sum::<f64>().sqrt();
    // If all vertices coincide, the error for degenerate triangles is clearer.
    if extent > 0.0 && extent < LEAST_EXTENT {
        return Err(ReadErrorKind::TooSmall { extent, least: LEAST_EXTENT });
    }
    Ok(())
}

/// Largest distance of a corner from its position in the file.
fn position_error(raw: &Raw, origin: DVec3) -> f64 {
    let corners = raw.corner_positions().map(DVec3::from);
    let rounded = corners.map(rounding).fold(0.0, f64::max);
    // The file's own numbers were rounded to f64, and so are their products with the unit.
    rounded + 4.0 * f64::EPSILON * origin.length()
}

/// A triangle, and the face (counted from 1) that it comes from.
struct Triangle {
    corners: [u32; 3],
    face: usize,
}

/// Cuts faces into triangles, and lists the faces of fewer than three corners.
fn triangles(raw: &Raw, report: &mut Report) -> Result<(Vec<Triangle>, Vec<usize>)> {
    let mut triangulator = Triangulator::new();
    let mut cut = Vec::new();
    let mut triangles = Vec::with_capacity(raw.ends.len());
    let (mut short, mut work) = (Vec::new(), 0_usize);
    for (face, corners) in (1..).zip(raw.faces()) {
        if let Some(&corner) = corners.iter().find(|&&c| c as usize >= raw.positions.len()) {
            return Err(ReadErrorKind::IndexOutOfRange {
                face,
                index: i64::from(corner) + i64::from(raw.first_vertex),
                vertices: raw.positions.len(),
                first: raw.first_vertex,
            });
        }
        if corners.len() > MOST_CORNERS {
            let corners = corners.len();
            return Err(ReadErrorKind::LargePolygon { face, corners, most: MOST_CORNERS });
        }
        work = work.saturating_add(corners.len() * corners.len());
        if corners.len() > FEW_CORNERS && work > MOST_WORK {
            return Err(ReadErrorKind::LargePolygon {
                face,
                corners: corners.len(),
                most: FEW_CORNERS,
            });
        }
        if corners.len() < 3 {
            short.push(face);
            continue;
        }
        let simple = triangulator.cut(corners, &raw.positions, &mut cut);
        report.polygons_triangulated += usize::from(corners.len() > 3);
        report.polygons_not_simple += usize::from(!simple);
        triangles.extend(cut.drain(..).map(|corners| Triangle { corners, face }));
    }
    Ok((triangles, short))
}

struct Surface {
    positions: Vec<Vec3>,
    faces: Vec<Triangle>,
    /// Faces (counted from 1) of fewer than three corners.
    short: Vec<usize>,
}

impl Surface {
    fn weld(&mut self, is_stl: bool, tolerance: Option<f32>, report: &mut Report) {
        let first = first_coincident(&self.positions, tolerance.unwrap_or(0.0));
        let mut referenced = self.referenced();
        if is_stl {
            // Every record repeats its corners, and the file has no vertex numbers, so the distinct positions are
            // numbered anew.
            referenced.fill(true);
        }
        let coincident = (0..)
            .zip(&first)
            .filter(|&(vertex, &first)| vertex != first && referenced[vertex as usize])
            .count();
        if tolerance.is_none() && !is_stl && !self.is_soup() {
            report.coincident = coincident;
            return;
        }
        report.welded = coincident;
        let moved = (0..).zip(&first).map(|(vertex, &first): (usize, _)| {
            let [from, to] = [vertex, first as usize].map(|v| self.positions[v].as_dvec3());
            if referenced[vertex] { from.distance(to) } else { 0.0 }
        });
        report.position_error += moved.fold(0.0, f64::max);
        for corner in self.faces.iter_mut().flat_map(|face| &mut face.corners) {
            *corner = first[*corner as usize];
        }
        if is_stl {
            self.renumber(&first);
        }
    }

    /// Removes the rows of welded vertices.
    fn renumber(&mut self, first: &[u32]) {
        let mut row = vec![0; first.len()];
        let mut kept = Vec::new();
        for (vertex, (&first, &position)) in first.iter().zip(&self.positions).enumerate() {
            if first as usize == vertex {
                row[vertex] = kept.len() as u32;
                kept.push(position);
            }
        }
        for corner in self.faces.iter_mut().flat_map(|face| &mut face.corners) {
            *corner = row[*corner as usize];
        }
        self.positions = kept;
    }

    /// Whether no two faces share a vertex, so that the file has no connectivity.
    fn is_soup(&self) -> bool {
        let mut user = vec![0; self.positions.len()];
        self.faces.iter().all(|triangle| {
            triangle.corners.iter().all(|&corner| {
                let before = std::mem::replace(&mut user[corner as usize], triangle.face);
                before == 0 || before == triangle.face
            })
        })
    }

    fn drop_degenerate(&mut self, strict: bool, report: &mut Report) -> Result<()> {
        let positions = &self.positions;
        let bad = |triangle: &Triangle| is_degenerate(triangle.corners, positions);
        let first_thin = self.faces.iter().find(|triangle| bad(triangle)).map(|t| t.face);
        let first = self.short.iter().copied().chain(first_thin).min();
        let before = self.faces.len();
        let thin = self.faces.iter().filter(|triangle| bad(triangle)).map(|t| t.corners);
        let thin: Vec<[u32; 3]> = thin.collect();
        self.faces.retain(|triangle| !bad(triangle));
        report.position_error += lost(&thin, self.faces.iter().map(|t| t.corners), &self.positions);
        let count = self.short.len() + before - self.faces.len();
        if let (true, Some(face)) = (strict, first) {
            return Err(ReadErrorKind::Degenerate { count, face });
        }
        report.dropped_degenerate = count;
        Ok(())
    }

    fn drop_duplicates(&mut self, strict: bool, report: &mut Report) -> Result<()> {
        let mut seen = HashSet::with_capacity(self.faces.len());
        let mut first = None;
        let before = self.faces.len();
        self.faces.retain(|triangle| {
            let mut corners = triangle.corners;
            corners.sort_unstable();
            let new = seen.insert(corners);
            if !new {
                first.get_or_insert(triangle.face);
            }
            new
        });
        let count = before - self.faces.len();
        if let (true, Some(face)) = (strict, first) {
            return Err(ReadErrorKind::Duplicate { count, face });
        }
        report.dropped_duplicates = count;
        Ok(())
    }

    /// Keeps the largest component, or all if `largest` is false; triangles that share a vertex are connected.
    fn keep_components(&mut self, largest: bool, report: &mut Report) -> Result<()> {
        let corners: Vec<[u32; 3]> = self.faces.iter().map(|face| face.corners).collect();
        let components = connected_by_vertices(&corners);
        let sizes: Vec<usize> = components.iter().map(Vec::len).collect();
        if !largest && components.len() > MAX_ROOTS as usize {
            return Err(ReadErrorKind::Components { sizes, coincident: report.coincident });
        }
        if largest && let [kept, _, ..] = &components[..] {
            let (mut at, mut kept) = (0, kept.iter().peekable());
            self.faces.retain(|_| {
                let is_kept = kept.next_if_eq(&&at).is_some();
                at += 1;
                is_kept
            });
        }
        report.components = sizes;
        Ok(())
    }

    fn count_edges(&self, report: &mut Report) {
        let mut edges: Vec<(u32, u32, bool)> = self
            .faces
            .iter()
            .flat_map(|triangle| {
                let [a, b, c] = triangle.corners;
                [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), from < to))
            })
            .collect();
        edges.sort_unstable();
        for uses in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            match uses {
                [_] => report.border_edges += 1,
                [one, other] => report.inconsistent_edges += usize::from(one.2 == other.2),
                _ => report.non_manifold_edges += 1,
            }
        }
    }

    fn count_vertices(&self, report: &mut Report) {
        report.vertices = self.positions.len();
        report.unreferenced_vertices = self.referenced().into_iter().filter(|used| !used).count();
    }

    fn referenced(&self) -> Vec<bool> {
        let mut referenced = vec![false; self.positions.len()];
        for corner in self.faces.iter().flat_map(|triangle| triangle.corners) {
            referenced[corner as usize] = true;
        }
        referenced
    }
}

/// Largest possible distance of a point of dropped triangles from the kept triangles. The distance of a triangle's
/// points from its longest edge is at most its height, and so is their distance from the union of the other two edges.
fn lost(dropped: &[[u32; 3]], kept: impl Iterator<Item = [u32; 3]>, positions: &[Vec3]) -> f64 {
    let edge = |a: u32, b: u32| (a.min(b), a.max(b));
    let edges = |[a, b, c]: [u32; 3]| [edge(a, b), edge(b, c), edge(c, a)];
    let length = |(a, b): (u32, u32)| {
        let [a, b] = [a, b].map(|corner| positions[corner as usize].as_dvec3());
        a.distance(b)
    };
    let mut thin = Vec::with_capacity(dropped.len());
    // The distance of each edge of a dropped triangle from the kept triangles.
    let mut from_kept = HashMap::new();
    for &corners in dropped {
        let [a, b, c] = corners.map(|corner| positions[corner as usize].as_dvec3());
        let mut edges = edges(corners);
        edges.sort_by(|&a, &b| length(b).total_cmp(&length(a)).then(a.cmp(&b)));
        let doubled_area = (b - a).cross(c - a).length();
        // A triangle without area is no surface.
        if doubled_area > 0.0 {
            from_kept.extend(edges.map(|edge| (edge, f64::INFINITY)));
            thin.push((edges, doubled_area / length(edges[0]), f64::INFINITY));
        }
    }
    if thin.is_empty() {
        return 0.0;
    }
    for edge in kept.flat_map(edges) {
        from_kept.entry(edge).and_modify(|distance| *distance = 0.0);
    }
    for _ in 0..MOST_ROUNDS {
        let mut is_done = true;
        for (edges, height, distance) in &mut thin {
            let [long, one, other] = edges.map(|edge| from_kept[&edge]);
            let found = *height + long.min(one.max(other));
            if found < *distance {
                *distance = found;
                is_done = false;
                for edge in *edges {
                    from_kept.entry(edge).and_modify(|known| *known = known.min(found));
                }
            }
        }
        if is_done {
            break;
        }
    }
    // A triangle that is connected to no kept one was an isolated sliver.
    let of = |&(_, height, distance): &(_, f64, f64)| {
        if distance.is_finite() { distance } else { height }
    };
    thin.iter().map(of).fold(0.0, f64::max)
}

/// Most dropped triangles in a row whose heights are added up.
const MOST_ROUNDS: usize = 64;

/// Whether a triangle repeats a vertex, or could be a line segment rounded to f32: its height is less than the distance
/// between neighbouring f32 numbers of its coordinates' size.
fn is_degenerate([a, b, c]: [u32; 3], positions: &[Vec3]) -> bool {
    if a == b || b == c || c == a {
        return true;
    }
    let [a, b, c] = [a, b, c].map(|corner| positions[corner as usize].as_dvec3());
    let doubled_area = (b - a).cross(c - a).length();
    let longest = [b - a, c - b, a - c].map(DVec3::length).into_iter().fold(0.0, f64::max);
    let coordinate = [a, b, c].map(|p| p.abs().max_element()).into_iter().fold(0.0, f64::max);
    doubled_area <= longest * coordinate * f64::from(f32::EPSILON)
}
