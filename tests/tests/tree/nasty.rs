//! Malformed and degenerate mesh files, and the expected outcome of each.
//!
//! The files are not part of the project; without them these tests are ignored.

// Requirement: M-03

use dibs_build::{Import, ReadErrorKind, ReadOptions};
use dibs_nostd::format::MAX_ROOTS;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The expected outcome of reading a file.
enum Want {
    /// A mesh: its vertices, its triangles, and every other count of the report that is not 0.
    Mesh(usize, usize, &'static [(&'static str, usize)]),
    /// A kind of error, and a part of its message.
    Error(fn(&ReadErrorKind) -> bool, &'static str),
    /// Several components: their number; then vertices, triangles and counts if only the largest is kept. All are kept
    /// if a tree can have so many roots.
    Components(usize, usize, usize, &'static [(&'static str, usize)]),
}
use ReadErrorKind as K;
use Want::{Components, Error, Mesh};

const fn polygons(count: usize) -> (&'static str, usize) {
    ("polygons_triangulated", count)
}
const fn border(count: usize) -> (&'static str, usize) {
    ("border_edges", count)
}
const fn unreferenced(count: usize) -> (&'static str, usize) {
    ("unreferenced_vertices", count)
}
const fn degenerate(count: usize) -> (&'static str, usize) {
    ("dropped_degenerate", count)
}
const fn duplicates(count: usize) -> (&'static str, usize) {
    ("dropped_duplicates", count)
}
const fn welded(count: usize) -> (&'static str, usize) {
    ("welded", count)
}
const fn coincident(count: usize) -> (&'static str, usize) {
    ("coincident", count)
}
const fn inconsistent(count: usize) -> (&'static str, usize) {
    ("inconsistent_edges", count)
}

const OUTCOMES: &[(&str, Want)] = &[
    // Exported by 3ds Max: a binary file with the extension in capitals and 24 parts.
    ("assimp_3DSMaxExport.STL", Components(24, 1042, 170, &[welded(4958), unreferenced(955)])),
    (
        "assimp_OutOfMemory.off",
        Error(|k| matches!(k, K::Count { claimed: 353_535_235_358, .. }), "vertices"),
    ),
    (
        "assimp_Spider_binary.stl",
        Components(18, 722, 98, &[welded(3382), unreferenced(671), degenerate(56)]),
    ),
    ("assimp_box.obj", Mesh(8, 12, &[polygons(6)])),
    // On a very long line, one face goes around its four corners many times.
    (
        "assimp_box_longline.obj",
        Mesh(
            8,
            12,
            &[
                polygons(6),
                ("polygons_not_simple", 1),
                degenerate(466),
                duplicates(466),
                inconsistent(4),
            ],
        ),
    ),
    // A ring that is cut open to make it one polygon; a test below checks its area.
    ("assimp_concave_polygon.obj", Mesh(64, 64, &[polygons(1), border(64)])),
    ("assimp_cube.ply", Mesh(8, 12, &[polygons(6)])),
    ("assimp_cube_with_vertexcolors.obj", Mesh(8, 12, &[])),
    ("assimp_invalid_empty.obj", Error(|k| matches!(k, K::Empty), "empty")),
    ("assimp_invalid_empty.ply", Error(|k| matches!(k, K::Empty), "empty")),
    // A face without vertices is an error: a surface with a hole would hide the loss.
    (
        "assimp_invalid_malformed2.obj",
        Error(|k| matches!(k, K::Malformed { line: Some(23), .. }), "a face without vertices"),
    ),
    ("assimp_multiple_spaces.obj", Mesh(4, 1, &[unreferenced(1), border(3)])),
    (
        "assimp_point_cloud.obj",
        Error(|k| matches!(k, K::NoTriangles { degenerate: 0, .. }), "faces"),
    ),
    // A quad, followed by both of its halves.
    ("assimp_regr_3429812.obj", Mesh(4, 2, &[polygons(1), duplicates(2), border(4)])),
    (
        "assimp_spider.obj",
        Components(19, 762, 98, &[coincident(40), unreferenced(711), degenerate(56)]),
    ),
    (
        "assimp_testpoints.obj",
        Error(|k| matches!(k, K::NoTriangles { degenerate: 0, .. }), "faces"),
    ),
    ("assimp_triangle_with_empty_solid.stl", Mesh(3, 1, &[border(3)])),
    ("synthetic_ascii.stl", Mesh(162, 320, &[welded(798)])),
    (
        "synthetic_ascii_nan.stl",
        Error(|k| matches!(k, K::NonFinite { .. }), "corner 1 of triangle 1"),
    ),
    ("synthetic_ascii_truncated.stl", Error(|k| matches!(k, K::Truncated { .. }), "endsolid")),
    ("synthetic_ascii_upper_crlf.stl", Mesh(162, 320, &[welded(798)])),
    (
        "synthetic_collinear.obj",
        Error(|k| matches!(k, K::NoTriangles { degenerate: 320, .. }), "320"),
    ),
    (
        "synthetic_count_too_large.stl",
        Error(|k| matches!(k, K::Count { claimed: 1_000_000_000, found: 320, .. }), "triangles"),
    ),
    // The file does not show whether its count or its data is wrong.
    (
        "synthetic_count_zero_with_data.stl",
        Error(|k| matches!(k, K::Count { claimed: 0, found: 320, .. }), "triangles"),
    ),
    ("synthetic_dup_faces_and_flipped.obj", Mesh(162, 320, &[duplicates(20)])),
    ("synthetic_empty_file.stl", Error(|k| matches!(k, K::Empty), "empty")),
    // A ball flattened to a plane: its two sides coincide, but stay two sheets.
    ("synthetic_flat_plane_z0.obj", Mesh(162, 304, &[coincident(73), degenerate(16), border(32)])),
    ("synthetic_header_only_83_bytes.stl", Error(|k| matches!(k, K::Truncated { .. }), "83 bytes")),
    (
        "synthetic_index_out_of_range.obj",
        Error(|k| matches!(k, K::IndexOutOfRange { face: 2, index: 9, .. }), "vertex 9"),
    ),
    ("synthetic_inf.stl", Error(|k| matches!(k, K::NonFinite { .. }), "corner 1 of triangle 6")),
    ("synthetic_line_continuation.obj", Mesh(3, 1, &[border(3)])),
    ("synthetic_mixed_orientation.obj", Mesh(162, 320, &[inconsistent(240)])),
    ("synthetic_nan.stl", Error(|k| matches!(k, K::NonFinite { .. }), "corner 2 of triangle 6")),
    ("synthetic_nan_vertex.obj", Error(|k| matches!(k, K::NonFinite { .. }), "vertex 8")),
    ("synthetic_negative_index.obj", Mesh(3, 1, &[border(3)])),
    ("synthetic_negative_zero.stl", Mesh(162, 320, &[welded(798)])),
    ("synthetic_overflow_f32_vertex.obj", Error(|k| matches!(k, K::Overflow { .. }), "vertex 8")),
    ("synthetic_scale_1e-30.obj", Error(|k| matches!(k, K::TooSmall { .. }), "millimetres")),
    (
        "synthetic_short_vertex.obj",
        Error(|k| matches!(k, K::Malformed { line: Some(1), .. }), "three coordinates"),
    ),
    ("synthetic_touching_at_vertex.obj", Mesh(5, 2, &[border(6)])),
    ("synthetic_two_components.obj", Components(2, 324, 320, &[unreferenced(162)])),
    ("synthetic_unwelded_soup.obj", Mesh(960, 320, &[welded(798), unreferenced(798)])),
    ("trimesh_LICENSE.md", Error(|k| matches!(k, K::UnknownFormat), "convert")),
    ("trimesh_empty.obj", Error(|k| matches!(k, K::NoTriangles { degenerate: 0, .. }), "faces")),
    ("trimesh_empty.stl", Error(|k| matches!(k, K::NoTriangles { degenerate: 0, .. }), "faces")),
    // Its faces refer to normals that are missing; a group's name contains an f.
    ("trimesh_face_in_group_name_mid_file.obj", Mesh(5, 2, &[border(6)])),
    // Two tetrahedra that both contain the triangle between them.
    ("trimesh_joined_tetrahedra.obj", Mesh(5, 7, &[duplicates(1), ("non_manifold_edges", 3)])),
    ("trimesh_mirror.ply", Mesh(143, 286, &[])),
    (
        "trimesh_multibody.stl",
        Components(2, 20, 20, &[welded(76), unreferenced(8), inconsistent(8)]),
    ),
    ("trimesh_negative_indices.obj", Mesh(8, 12, &[polygons(6)])),
    // A face of two corners has no area.
    ("trimesh_notenoughindices.obj", Mesh(3, 1, &[degenerate(1), border(3)])),
    (
        "trimesh_obj_points.obj",
        Error(|k| matches!(k, K::NoTriangles { degenerate: 0, .. }), "faces"),
    ),
    ("trimesh_obj_with_no_face_in_chunk.obj", Mesh(3, 1, &[border(3)])),
    (
        "trimesh_ply_empty_header.ply",
        Error(|k| matches!(k, K::NoTriangles { degenerate: 0, .. }), "faces"),
    ),
    // A non-planar polygon of five corners: seen along its normal, one side runs back over another.
    ("trimesh_polygonfaces.obj", Mesh(5, 3, &[polygons(1), ("polygons_not_simple", 1), border(5)])),
    ("trimesh_soup.stl", Components(100, 300, 1, &[unreferenced(297), border(3)])),
    (
        "trimesh_stl_empty_bin.stl",
        Error(|k| matches!(k, K::NoTriangles { degenerate: 0, .. }), "faces"),
    ),
    ("trimesh_two_objects.obj", Components(2, 12, 12, &[coincident(4), unreferenced(4)])),
    ("trimesh_wallhole.obj", Mesh(92, 66, &[polygons(13), welded(57), unreferenced(57)])),
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/nasty")
}

/// Every count of the report that is not 0, except the sizes of the mesh.
fn counts(import: &Import) -> BTreeMap<String, usize> {
    let report = serde_json::to_value(&import.report).unwrap();
    let report = report.as_object().unwrap();
    report
        .iter()
        .filter(|(name, _)| {
            !matches!(name.as_str(), "vertices" | "faces" | "triangles" | "file_triangles")
        })
        .filter_map(|(name, value)| Some((name.clone(), value.as_u64()? as usize)))
        .filter(|&(_, count)| count != 0)
        .collect()
}

fn check_mesh(
    name: &str,
    import: &Import,
    vertices: usize,
    triangles: usize,
    want: &[(&str, usize)],
) {
    let mesh = &import.mesh;
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (vertices, triangles), "{name}");
    assert_eq!(
        (import.report.vertices, import.report.triangles),
        (vertices, triangles),
        "{name}: the report disagrees with the mesh"
    );
    assert!(import.report.file_triangles >= triangles, "{name}: {:?}", import.report);
    let want: BTreeMap<String, usize> = want.iter().map(|&(n, c)| (n.to_owned(), c)).collect();
    assert_eq!(counts(import), want, "{name}");
    assert!(mesh.positions.iter().all(|p| p.is_finite()), "{name}");
    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < vertices), "{name}");
}

#[test]
#[cfg_attr(not(real_meshes), ignore = "../shared/data is absent")]
fn every_file_has_its_outcome() {
    let folder = folder();
    for (name, want) in OUTCOMES {
        let path = folder.join(name);
        let outcome = dibs_build::read(&path);
        match want {
            Mesh(vertices, triangles, counts) => match outcome {
                Ok(import) => check_mesh(name, &import, *vertices, *triangles, counts),
                Err(error) => panic!("{error}"),
            },
            Error(is_kind, part) => {
                let error = outcome.err().unwrap_or_else(|| panic!("{name} gave a mesh"));
                assert!(is_kind(&error.kind), "{error}");
                let sentence = error.to_string();
                assert!(sentence.contains(part) && sentence.contains(name), "{sentence}");
                assert!(!sentence.contains('\n'), "{sentence}");
            }
            Components(components, vertices, triangles, counts) => {
                let options = ReadOptions { largest_component: true, ..Import::options() };
                let import = options.read(&path).unwrap();
                let sizes = &import.report.components;
                assert_eq!(sizes.len(), *components, "{name}");
                match outcome {
                    Ok(all) => {
                        assert!(*components <= MAX_ROOTS as usize, "{name}");
                        assert_eq!(all.report.triangles, sizes.iter().sum::<usize>(), "{name}");
                        assert_eq!(&all.report.components, sizes, "{name}");
                    }
                    Err(error) => {
                        assert!(*components > MAX_ROOTS as usize, "{error}");
                        assert!(error.to_string().contains("--largest-component"), "{error}");
                    }
                }
                check_mesh(name, &import, *vertices, *triangles, counts);
            }
        }
    }
}

#[test]
#[cfg_attr(not(real_meshes), ignore = "../shared/data is absent")]
fn every_file_is_in_the_table() {
    let folder = folder();
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name();
        let name = name.to_str().unwrap();
        assert!(OUTCOMES.iter().any(|(known, _)| *known == name), "{name} has no outcome");
    }
}

#[test]
#[cfg_attr(not(real_meshes), ignore = "../shared/data is absent")]
fn strict_refuses_what_is_otherwise_dropped() {
    let folder = folder();
    for (name, want) in OUTCOMES {
        let Mesh(_, _, counts) = want else { continue };
        let options = ReadOptions { strict: true, ..Import::options() };
        let outcome = options.read(folder.join(name));
        let has = |name| counts.iter().find(|(n, _)| *n == name).map(|(_, count)| *count);
        match (has("dropped_degenerate"), has("dropped_duplicates"), outcome) {
            (None, None, Ok(_)) => {}
            (Some(n), _, Err(e)) => {
                assert!(matches!(e.kind, K::Degenerate { count, .. } if count == n), "{e}");
            }
            (None, Some(n), Err(e)) => {
                assert!(matches!(e.kind, K::Duplicate { count, .. } if count == n), "{e}");
            }
            (_, _, outcome) => panic!("{name}: {outcome:?}"),
        }
    }
}

#[test]
#[cfg_attr(not(real_meshes), ignore = "../shared/data is absent")]
fn the_concave_polygon_keeps_its_area() {
    let folder = folder();
    let mesh = dibs_build::read(folder.join("assimp_concave_polygon.obj")).unwrap().mesh;
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
            (b - a).cross(c - a).length() / 2.0
        })
        .sum();
    // Both edges of the ring are regular polygons of 32 corners, up to the file's digits.
    let polygon = |radius: f64| {
        let corners = 32.0;
        corners / 2.0 * radius * radius * (std::f64::consts::TAU / corners).sin()
    };
    assert!((area - (polygon(0.7425) - polygon(0.6875))).abs() < 1e-3, "{area}");
}
