//! The tree's bytes compared with their specification, `docs/format.md`, and damaged trees.
//!
//! One file, because all tests damage the same trees.

// Requirements: A-12, M-01

use dibs_build::{BuildError, Builder, BuiltTree, IndexWidth, Mesh, ReadOptions, Unit, generate};
use dibs_nostd::format::{CRC, MAX_STACK, NodeLink};
use dibs_nostd::{FormatError, Options, Query, QueryError, Sphere, Tree, TriangleRow};
use dibs_tests::tree_bytes::{section, with_words, word};
use fastrand::Rng;
use glam::{DVec3, Vec3};

fn heart(index: IndexWidth) -> (Mesh, BuiltTree) {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let tree = Builder::new().index(index).build(&mesh).expect("a valid mesh");
    (mesh, tree)
}

/// Changes a word and corrects the checksum, so that only the word is wrong.
fn with_word(bytes: &[u8], at: usize, value: u32) -> Vec<u8> {
    with_words(bytes, &[(at, value)])
}

#[test]
fn the_example_of_the_specification_is_what_the_builder_writes() {
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let builder = Builder::new().stretch(1.5).with_vertex_order(false).with_rest_shape(false);
    let tree = builder.with_metric(false).with_adjacency(false).build(&mesh).expect("a valid mesh");
    let text = include_str!("../../../docs/format.md");
    let example = text.split("```text").nth(1).and_then(|t| t.split("```").next());
    let digits: String = example.expect("an example").split_whitespace().collect();
    let written: String = tree.blob().iter().map(|b| format!("{b:02x}")).collect();
    assert_eq!(digits, written);
}

#[test]
fn every_field_and_section_stands_where_the_specification_says() {
    for (index, width) in [(IndexWidth::Bits16, 2), (IndexWidth::Bits32, 4)] {
        let (mesh, built) = heart(index);
        let bytes = built.blob();
        assert_eq!(&bytes[..4], b"DIBS");
        assert_eq!(bytes[4..8], [5, 0, width as u8, 1]);
        let (vertices, triangles, nodes) = (word(bytes, 12), word(bytes, 16), word(bytes, 20));
        assert_eq!(triangles as usize, mesh.triangles.len());
        assert_eq!(vertices as usize, mesh.positions.len());
        assert_eq!(word(bytes, 52) as usize, bytes.len());
        assert_eq!([56, 64, 68, 72, 76].map(|at| word(bytes, at)), [0, vertices, triangles, 0, 0]);
        assert_eq!(section(bytes, 1).1, nodes as usize * (2 * width + 4));
        assert_eq!(section(bytes, 2).1, triangles as usize * 3 * width);
        let (order, length) = section(bytes, 3);
        assert_eq!(length, vertices as usize * width);
        let (rest, length) = section(bytes, 4);
        assert_eq!(length, vertices as usize * 12);
        let short = |at: usize| usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        for row in 0..vertices as usize {
            let vertex = short(order + row * width);
            let x = f32::from_bits(word(bytes, rest + 12 * row));
            assert_eq!(x, mesh.positions[vertex].x);
            assert_eq!(built.vertex_order()[row] as usize, vertex);
        }
        let mut identity = CRC.digest();
        let ((at, length), (rest, rest_length)) = (section(bytes, 2), section(bytes, 4));
        identity.update(&bytes[at..at + length]);
        identity.update(&bytes[rest..rest + rest_length]);
        assert_eq!(identity.finalize(), word(bytes, 8));
    }
}

#[test]
fn every_flipped_bit_and_every_truncation_is_refused() {
    let (_, built) = heart(IndexWidth::Bits16);
    let mut bytes = built.blob().to_vec();
    // Unoptimised builds, such as the sanitizers', test a fifth of the bytes.
    let step = if cfg!(debug_assertions) { 5 } else { 1 };
    for at in (0..bytes.len()).step_by(step) {
        for bit in 0..8 {
            bytes[at] ^= 1 << bit;
            assert!(Tree::<u16>::from_bytes(&bytes).is_err(), "byte {at} bit {bit}");
            bytes[at] ^= 1 << bit;
        }
    }
    for length in (0..bytes.len()).step_by(step) {
        assert!(Tree::<u16>::from_bytes(&bytes[..length]).is_err(), "{length} bytes");
    }
    assert!(Tree::<u16>::from_bytes(&bytes).is_ok());
}

#[test]
fn a_wrong_value_with_a_right_checksum_is_named() {
    let (_, built) = heart(IndexWidth::Bits16);
    let bytes = built.blob();
    let (nodes, triangles) = (section(bytes, 1).0, section(bytes, 2).0);
    let refuse = |at: usize, value: u32| {
        Tree::<u16>::from_bytes(&with_word(bytes, at, value)).expect_err("is wrong")
    };
    assert!(matches!(Tree::<u32>::from_bytes(bytes), Err(FormatError::Width { found: 2, .. })));
    assert!(matches!(refuse(0, 0), FormatError::Magic { .. }));
    assert!(matches!(refuse(4, 0x0102_0002), FormatError::Version { found: 2 }));
    assert!(matches!(refuse(4, 0x0702_0005), FormatError::Field { offset: 7, value: 7 }));
    for (at, value) in
        [(12, 0), (12, 65_537), (16, 0), (20, 0), (24, 513), (40, 2), (44, 64), (56, 6), (56, 256)]
    {
        let expected = FormatError::Field { offset: at as u8, value };
        assert_eq!(refuse(at, value), expected, "field at {at}");
    }
    for wrong in [0.5f32, f32::NAN, f32::INFINITY] {
        assert!(matches!(refuse(28, wrong.to_bits()), FormatError::Field { offset: 28, .. }));
        assert!(wrong == 0.5 || matches!(refuse(32, wrong.to_bits()), FormatError::Field { .. }));
    }
    for wrong in [-0.5f32, f32::NAN, f32::INFINITY] {
        assert!(matches!(refuse(36, wrong.to_bits()), FormatError::Field { offset: 36, .. }));
    }
    assert!(matches!(refuse(40, 1), FormatError::Section { kind: 9 }));
    assert!(matches!(refuse(20, word(bytes, 20) - 1), FormatError::Section { kind: 1 }));
    for (at, value) in
        [(64, word(bytes, 12) - 1), (64, 65_537), (68, word(bytes, 16) - 1), (72, 1), (76, 1)]
    {
        let expected = FormatError::Field { offset: at as u8, value };
        assert_eq!(refuse(at, value), expected, "field at {at}");
    }
    // Reserved kinds, and those of newer libraries, must not be skipped unless they are marked as optional.
    for kind in [0, 11, 13, 99, (1 << 31) - 1] {
        assert_eq!(refuse(80, kind), FormatError::Kind { kind });
    }
    assert_eq!(refuse(80, 1 << 31 | 1), FormatError::Section { kind: 1 });
    assert!(matches!(refuse(84, 7), FormatError::Section { kind: 1 }));
    assert!(matches!(refuse(24, word(bytes, 24) - 1), FormatError::Stack { .. }));
    assert!(matches!(refuse(24, word(bytes, 24) + 1), FormatError::Stack { .. }));
    assert!(matches!(refuse(nodes, 0xFFFF_FFFF), FormatError::Pin { node: 0, pin: 0xFFFF }));
    let root = word(bytes, nodes + 4);
    assert!(matches!(refuse(nodes + 4, root - 1), FormatError::NodeOrder { node: 0 }));
    assert!(matches!(refuse(nodes + 4, root + 1), FormatError::NodeOrder { node: 2 }));
    assert!(matches!(refuse(nodes + 4, root - (1 << 28)), FormatError::NodeOrder { .. }));
    assert!(matches!(refuse(nodes + 4, 1 << 31), FormatError::NodeOrder { .. }));
    let corner = refuse(triangles, 0xFFFF_FFFF);
    assert!(matches!(corner, FormatError::Corner { triangle: 0, vertex: 0xFFFF }));
}

/// A leaf's vertices must be at the positions that a query reads: otherwise it could reject the leaf too early.
#[test]
fn a_leaf_whose_vertices_are_not_at_their_places_is_refused() {
    let (mesh, _) = heart(IndexWidth::Bits16);
    // Without rest metric and adjacency, whose checks would also refuse the change.
    let built = Builder::new().with_metric(false).with_adjacency(false).build(&mesh);
    let built = built.expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let bytes = built.blob();
    let table = section(bytes, 2).0;
    let mut refused = 0;
    for row in 0..tree.node_count() {
        let Some((.., NodeLink::Leaf { first, count })) = tree.node(row) else { continue };
        for triangle in first + 1..first + count {
            let [a, b, c] = tree.corners(TriangleRow(triangle)).expect("in the tree");
            let others = (first..first + count).filter(|&t| t != triangle);
            let is_new =
                |v| others.clone().all(|t| !tree.corners(TriangleRow(t)).unwrap().contains(&v));
            if !is_new(c) {
                continue;
            }
            let mut wrong = bytes.to_vec();
            let at = table + 6 * triangle as usize;
            for (corner, vertex) in [c, a, b].into_iter().enumerate() {
                let place = at + 2 * corner..at + 2 * corner + 2;
                wrong[place].copy_from_slice(&(vertex as u16).to_le_bytes());
            }
            let sealed = with_word(&wrong, 0, word(&wrong, 0));
            let error = Tree::<u16>::from_bytes(&sealed).expect_err("a new corner, not the third");
            assert_eq!(error, FormatError::Patch { triangle, vertex: c });
            refused += 1;
        }
    }
    assert!(refused > 50, "{refused} leaves tried");
}

/// A query that reads a leaf's first rows relies on their vertices being at the leaf's first positions.
#[test]
fn a_leaf_whose_triangles_come_too_early_is_refused() {
    let (mesh, _) = heart(IndexWidth::Bits16);
    let built = Builder::new().with_metric(false).with_adjacency(false).build(&mesh);
    let built = built.expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let bytes = built.blob();
    let table = section(bytes, 2).0;
    let (mut refused, mut accepted) = (0, 0);
    for row in 0..tree.node_count() {
        let Some((.., NodeLink::Leaf { first, count })) = tree.node(row) else { continue };
        for triangle in first + 1..(first + count).saturating_sub(1) {
            // The next triangle comes before this one.
            let at = table + 6 * triangle as usize;
            let mut swapped = bytes.to_vec();
            swapped[at..at + 12].rotate_left(6);
            let sealed = with_word(&swapped, 0, word(&swapped, 0));
            let known: Vec<u32> = (first..triangle)
                .flat_map(|t| tree.corners(TriangleRow(t)).expect("in the tree"))
                .collect();
            let [a, b, _] = tree.corners(TriangleRow(triangle + 1)).expect("in the tree");
            match [a, b].into_iter().find(|v| !known.contains(v)) {
                Some(vertex) => {
                    let error = Tree::<u16>::from_bytes(&sealed).expect_err("a new first corner");
                    assert_eq!(error, FormatError::Patch { triangle, vertex });
                    refused += 1;
                }
                None => {
                    Tree::<u16>::from_bytes(&sealed).expect("both corners are known");
                    accepted += 1;
                }
            }
        }
    }
    assert!(refused > 50 && accepted > 5, "{refused} refused, {accepted} accepted");
}

/// A query on a validated tree whose bytes were damaged afterwards ends, with an error or an answer.
#[test]
fn a_query_on_damaged_bytes_ends() {
    let (mesh, built) = heart(IndexWidth::Bits16);
    let bytes = built.blob();
    let tree = Tree::<u16>::from_bytes(bytes).expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let (nodes, length) = section(bytes, 1);
    let mut rng = Rng::with_seed(5);
    let (mut errors, mut answers) = (0, 0);
    for _ in 0..2_000 {
        let mut damaged = bytes.to_vec();
        for _ in 0..1 + rng.usize(..8) {
            damaged[nodes + rng.usize(..length)] ^= 1 << rng.u32(..8);
        }
        let view = tree.moved_to(&damaged).expect("same layout");
        let mut query = Query::<u16, MAX_STACK>::new(&view).expect("deep enough");
        let tool = Sphere::new(rows[rng.usize(..rows.len())] * 1.3, 1.0).expect("valid");
        let both = [
            query.closest(rows.as_slice(), &tool, &Options::cold()),
            query.closest_batched(rows.as_slice(), &tool, &Options::cold()),
        ];
        for result in both {
            match result {
                Ok(found) => {
                    answers += 1;
                    assert!(
                        found.work() <= 3 * tree.node_count() + 9 * (tree.triangle_count() + 1) + 1
                    );
                }
                Err(QueryError::Corrupt { .. } | QueryError::Uncovered { .. }) => errors += 1,
                Err(other) => panic!("{other}"),
            }
        }
    }
    println!("{answers} answers, {errors} errors");
    assert!(answers > 0 && errors > 0);
}

/// Metric and limits, read only by the specification, and the refusals of wrong ones.
#[test]
fn metric_and_limits_stand_where_the_specification_says() {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let limits: Vec<f32> = (0..320).map(|t| 1.1 + (t % 10) as f32 * 0.1).collect();
    for (index, width) in [(IndexWidth::Bits16, 2), (IndexWidth::Bits32, 4)] {
        let built = Builder::new().index(index).limits(limits.clone()).build(&mesh);
        let built = built.expect("a valid mesh");
        let bytes = built.blob();
        assert_eq!(f32::from_bits(word(bytes, 28)), 2.0);
        let [(triangles, _), (metric, length), (codes, codes_length)] =
            [2, 5, 6].map(|kind| section(bytes, kind));
        assert_eq!((length, codes_length), (320 * 12, 320 * 2));
        let index = |at: usize| match width {
            2 => u32::from(u16::from_le_bytes([bytes[at], bytes[at + 1]])),
            _ => word(bytes, at),
        };
        let rows = |row: usize| [0, 1, 2].map(|c| index(triangles + (3 * row + c) * width));
        let (mut fans, mut flips, mut starts) = (0, 0, Vec::new());
        for row in 0..320 {
            let corners = rows(row).map(|r| built.vertex_order()[r as usize]);
            let is_same =
                |t: &[u32; 3]| (0..3).any(|i| [t[i], t[(i + 1) % 3], t[(i + 2) % 3]] == corners);
            let triangle =
                mesh.triangles.iter().position(is_same).expect("of the mesh, as oriented");
            let code = u16::from_le_bytes([bytes[codes + 2 * row], bytes[codes + 2 * row + 1]]);
            let share = f64::from(code) / 65_535.0;
            let limit = f64::from(limits[triangle]);
            assert!(share * 2.0 >= limit && share * 2.0 < limit + 4e-5, "{share} for {limit}");
            let at = |i: usize| f32::from_bits(word(bytes, metric + 12 * row + 4 * i));
            let centre_first = |row: usize| {
                let [a, b, c] = rows(row);
                let is_reversed = word(bytes, metric + 12 * row + 4) & 1 == 1;
                if is_reversed { [b, a, c] } else { [a, b, c] }
            };
            let [a, b, c] = centre_first(row)
                .map(|r| mesh.positions[built.vertex_order()[r as usize] as usize].as_dvec3());
            let (e1, e2) = (b - a, c - a);
            let expected = [e1.dot(e1), e1.dot(e2), e2.dot(e2)].map(|x| x * share * share);
            for (i, expected) in expected.into_iter().enumerate() {
                let found = f64::from(at(i).abs() * if i == 1 { at(i).signum() } else { 1.0 });
                let scale = share * share * e1.length() * e2.length();
                assert!(
                    (found - expected).abs() < 1e-4 * scale.max(expected),
                    "{found} {expected}"
                );
                assert!(i == 1 || found < expected, "{found} must be below {expected}");
            }
            let [centre, other, _] = centre_first(row);
            if at(0).is_sign_negative() {
                let [before, _, third] = centre_first(row - 1);
                assert_eq!([centre, other], [before, third]);
                fans += 1;
            } else if at(0).to_bits() & 1 == 1 {
                let [before, _, third] = centre_first(row - 1);
                assert_eq!([centre, other], [third, before]);
                flips += 1;
            } else {
                assert_eq!(centre, rows(row)[0]);
                starts.push(row);
            }
        }
        assert!(fans > 100 && flips > 20, "{fans} triangles continue a fan, {flips} flip");

        let refuse = |at: usize, value: u32| {
            let changed = with_word(bytes, at, value);
            match width {
                2 => Tree::<u16>::from_bytes(&changed).map(|_| ()),
                _ => Tree::<u32>::from_bytes(&changed).map(|_| ()),
            }
        };
        for wrong in [f32::NAN, f32::INFINITY] {
            let refused = refuse(metric + 24, wrong.to_bits());
            assert_eq!(refused, Err(FormatError::Metric { triangle: 2 }));
        }
        // A fan's first triangle must not be marked as continuing or flipping it, or be measured from another corner.
        let touches = |row: usize| rows(row).iter().any(|v| rows(row - 1).contains(v));
        let alone = starts.into_iter().skip(1).find(|&row| !touches(row)).expect("not one patch");
        let at = metric + 12 * alone;
        for (number, mark) in [(0, 1 << 31), (0, 1), (4, 1)] {
            let refused = refuse(at + number, word(bytes, at + number) ^ mark);
            assert_eq!(refused, Err(FormatError::Metric { triangle: alone as u32 }));
        }
        assert_eq!(refuse(codes + 8, 0), Err(FormatError::Limit { triangle: 4 }));
    }
}

/// Labels are in the order of the triangles' rows, change no other bytes, and must be one for each triangle.
#[test]
fn labels_are_stored_by_row() {
    let (mesh, plain) = heart(IndexWidth::Bits16);
    let labels: Vec<u8> = (0..mesh.triangles.len()).map(|number| (number % 251) as u8).collect();
    for index in [IndexWidth::Bits16, IndexWidth::Bits32] {
        let built = Builder::new().index(index).labels(labels.clone()).build(&mesh).unwrap();
        let (at, length) = section(built.blob(), 10);
        assert_eq!(length, mesh.triangles.len());
        for row in 0..mesh.triangles.len() {
            let (corners, label) = match index {
                IndexWidth::Bits16 => labelled(&built.tree::<u16>().unwrap(), row as u32),
                _ => labelled(&built.tree::<u32>().unwrap(), row as u32),
            };
            let is_it = |own: &[u32; 3]| corners.iter().all(|corner| own.contains(corner));
            let number = mesh.triangles.iter().position(is_it).expect("is there");
            assert_eq!(label, Some(labels[number]));
            assert_eq!(built.blob()[at + row], labels[number]);
        }
        let outside = TriangleRow(mesh.triangles.len() as u32);
        assert_eq!(built.tree::<u16>().ok().and_then(|tree| tree.label(outside)), None);
    }
    let built = Builder::new().labels(labels).build(&mesh).unwrap();
    assert_eq!(built.summary().mesh_id, plain.summary().mesh_id);
    assert_eq!(plain.tree::<u16>().unwrap().label(TriangleRow(0)), None);
    let table = 80 + 12 * (word(built.blob(), 48) - 1) as usize;
    assert_eq!(word(built.blob(), table), 10);
    for wrong in [0, 319, 321] {
        let bytes = with_word(built.blob(), table + 8, wrong);
        assert!(matches!(Tree::<u16>::from_bytes(&bytes), Err(FormatError::Section { kind: 10 })));
    }
}

/// A tree stores its file's unit and counts, whatever was dropped, and the builder's unit takes precedence over the
/// file's.
#[test]
fn the_files_unit_and_counts_are_stored() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Z];
    // One triangle is degenerate, one a duplicate; no triangle uses the last vertex.
    let triangles = [[0, 1, 1], [0, 1, 2], [1, 2, 0], [0, 2, 3]];
    let plain = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let facts = |built: BuiltTree| {
        let tree = built.tree::<u16>().expect("valid");
        (tree.unit(), tree.file_vertex_count(), tree.file_triangle_count())
    };
    assert_eq!(facts(Builder::new().build(&plain).expect("valid")), (None, 3, 1));
    for unit in Unit::ALL {
        let import = ReadOptions { unit: Some(unit), ..ReadOptions::default() };
        let import = import.check(&corners, &triangles).expect("a mesh");
        let built = Builder::new().build(&import).expect("valid");
        assert_eq!(word(built.blob(), 56), u32::from(unit.code()));
        let tree = built.tree::<u16>().expect("valid");
        assert_eq!((tree.vertex_count(), tree.triangle_count()), (4, 2));
        assert_eq!(facts(built), (Some(unit), 5, 4));
        let told = Builder::new().unit(unit).build(&plain).expect("valid");
        assert_eq!(facts(told).0, Some(unit));
        assert_eq!(Unit::from_code(unit.code()), Some(unit));
    }
    assert_eq!([0, 6, 255].map(Unit::from_code), [None; 3]);
}

/// A triangle's corners, by the mesh's numbers, and its label.
fn labelled<I: dibs_nostd::Index>(tree: &Tree<'_, I>, row: u32) -> ([u32; 3], Option<u8>) {
    let corners = tree.corners(TriangleRow(row)).expect("a row");
    let number = |vertex| tree.vertex_number(vertex).expect("has an order").0;
    (corners.map(number), tree.label(TriangleRow(row)))
}

/// The origin is stored in double precision, is part of the mesh's identity, and is checked.
#[test]
fn an_origin_is_stored_and_checked() {
    let (near, built) = heart(IndexWidth::Bits16);
    let origin = DVec3::new(4e9, -0.1, 1.0 / 3.0);
    let moved = Mesh { origin, ..near };
    for width in [IndexWidth::Bits16, IndexWidth::Bits32] {
        let far = Builder::new().index(width).build(&moved).unwrap();
        let found = match width {
            IndexWidth::Bits16 => far.tree::<u16>().unwrap().origin(),
            _ => far.tree::<u32>().unwrap().origin(),
        };
        assert_eq!((DVec3::from(found), far.origin()), (origin, origin));
    }
    assert_eq!(built.tree::<u16>().unwrap().origin(), [0.0; 3]);
    let far = Builder::new().build(&moved).unwrap();
    let tree = far.tree::<u16>().unwrap();
    let (x, y, z) = (4e9 + 12.5, 2.0, -7.0);
    assert_eq!(tree.local([x, y, z]), Vec3::new(12.5, 2.1, (-7.0 - 1.0_f64 / 3.0) as f32));
    let other = Mesh { origin: origin + DVec3::X, ..moved.clone() };
    let other = Builder::new().build(&other).unwrap();
    let ids = [&built, &far, &other].map(|built| built.summary().mesh_id);
    assert!(ids[0] != ids[1] && ids[1] != ids[2] && ids[0] != ids[2], "{ids:?}");

    let mut bytes = far.blob().to_vec();
    let (at, length) = section(&bytes, 9);
    assert_eq!((length, word(&bytes, 40)), (24, 1));
    let refuse = |at: usize, value: u32| {
        Tree::<u16>::from_bytes(&with_word(&bytes, at, value)).expect_err("is wrong")
    };
    assert_eq!(refuse(40, 0), FormatError::Section { kind: 9 });
    for (axis, top) in [(0, 0x7FF0_0000), (1, 0xFFF0_0000), (2, 0x7FF8_0000)] {
        assert_eq!(refuse(at + 8 * axis + 4, top), FormatError::Origin { axis: axis as u8 });
    }
    for place in at..at + length {
        for bit in 0..8 {
            bytes[place] ^= 1 << bit;
            assert!(Tree::<u16>::from_bytes(&bytes).is_err(), "byte {place} bit {bit}");
            bytes[place] ^= 1 << bit;
        }
    }
    let nowhere = Mesh { origin: DVec3::NAN, ..moved };
    assert!(matches!(Builder::new().build(&nowhere), Err(BuildError::Origin { .. })));
}
