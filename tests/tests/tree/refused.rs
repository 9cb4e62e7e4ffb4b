//! Trees whose checksum is right but whose sections do not fit each other: each is refused, by the name of the section
//! or row that is wrong. And rows outside of a tree's tables have no value.

// Requirements: M-01, S-02

use dibs_build::{Builder, BuiltTree, IndexWidth, Mesh, generate};
use dibs_nostd::format::{MAX_STACK, NodeLink};
use dibs_nostd::{FormatError, Index, Query, Tree, TriangleRow};
use dibs_tests::surfaces::{cuboid, joined, moved, sheet};
use dibs_tests::tree_bytes::{row_of_section, section, with_words, word};
use glam::Vec3;

/// A kind that a reader skips.
const UNKNOWN: u32 = 1 << 31 | 1;

fn heart() -> BuiltTree {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    Builder::new().build(&mesh).expect("a valid mesh")
}

fn triangle() -> BuiltTree {
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    Builder::new().build(&mesh).expect("a valid mesh")
}

/// Two cubes: a tree with two roots, each its own solid.
fn cubes() -> BuiltTree {
    let (positions, triangles) = cuboid(Vec3::ZERO, Vec3::ONE);
    let cube =
        Mesh { positions: positions.to_vec(), triangles: triangles.to_vec(), ..Mesh::default() };
    let both = joined(&[cube.clone(), moved(&cube, Vec3::X * 3.0)]);
    Builder::new().build(&both).expect("a valid mesh")
}

/// Why a tree with these numbers changed is refused.
fn refusal<I: Index>(bytes: &[u8], words: &[(usize, u32)]) -> FormatError {
    Tree::<I>::from_bytes(&with_words(bytes, words)).expect_err("is wrong")
}

#[test]
fn a_header_counts_no_more_than_links_can_name() {
    let built = heart();
    for (at, value) in [(16, 1 << 28), (20, 1 << 28)] {
        let expected = FormatError::Field { offset: at as u8, value };
        assert_eq!(refusal::<u16>(built.blob(), &[(at, value)]), expected);
    }
    // More roots than nodes.
    let one = triangle();
    assert_eq!(word(one.blob(), 20), 1, "one node");
    let expected = FormatError::Field { offset: 44, value: 1 };
    assert_eq!(refusal::<u16>(one.blob(), &[(44, 1)]), expected);
}

#[test]
fn a_table_of_sections_is_whole_and_has_each_once() {
    let built = heart();
    let bytes = built.blob();
    let first = word(bytes, 80);
    // A section in the header, and the first one twice.
    assert_eq!(refusal::<u16>(bytes, &[(84, 0)]), FormatError::Section { kind: first });
    let [kind, offset, length] = [80, 84, 88].map(|at| word(bytes, at));
    let twice = [(92, kind), (96, offset), (100, length)];
    assert_eq!(refusal::<u16>(bytes, &twice), FormatError::Section { kind: first });
    // A header that promises a row after the last byte.
    let header = with_words(&bytes[..80], &[(52, 80), (48, 1)]);
    let expected = FormatError::Length { expected: 92, found: 80 };
    assert_eq!(Tree::<u16>::from_bytes(&header).expect_err("too short"), expected);
}

#[test]
fn every_triangle_is_in_one_leaf() {
    // Without the tables whose checks would also refuse the change.
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let plain = Builder::new().with_metric(false).with_adjacency(false).index(IndexWidth::Bits32);
    let built = plain.build(&mesh).expect("a valid mesh");
    let (bytes, tree) = (built.blob(), built.tree::<u32>().expect("valid"));
    let nodes = section(bytes, 1).0;
    let link_at = |row: u32| nodes + 12 * row as usize + 8;
    let links = (0..tree.node_count()).map(|row| (row, tree.node(row).expect("a node").2));
    let (mut leaves, mut inner) = (Vec::new(), Vec::new());
    for (row, link) in links {
        match link {
            NodeLink::Leaf { first, count } => leaves.push((first, count, row)),
            NodeLink::Children { first, count } => inner.push((first, count, row)),
        }
    }
    leaves.sort_unstable();
    // The last children of all, of one more than there are nodes.
    let &(first, count, row) = inner.iter().max().expect("a root");
    let more = NodeLink::Children { first, count: count + 1 }.encode();
    assert_eq!(
        refusal::<u32>(bytes, &[(link_at(row), more)]),
        FormatError::NodeOrder { node: first }
    );
    // The first leaf with the second's triangles, and the last leaf without its last triangle.
    let [(_, _, row), (second, count, _)] = [leaves[0], leaves[1]];
    let other = NodeLink::Leaf { first: second, count }.encode();
    assert_eq!(
        refusal::<u32>(bytes, &[(link_at(row), other)]),
        FormatError::Leaf { first: second }
    );
    let &(first, count, row) = leaves.iter().rev().find(|(_, count, _)| *count > 1).expect("one");
    let last = leaves[leaves.len() - 1].0;
    assert_eq!(first, last, "the last leaf has several triangles");
    let less = NodeLink::Leaf { first, count: count - 1 }.encode();
    let refused = refusal::<u32>(bytes, &[(link_at(row), less)]);
    assert_eq!(refused, FormatError::Leaf { first: tree.triangle_count() - 1 });
    // A radius above the largest code.
    let code = 0x100_0001;
    let refused = refusal::<u32>(bytes, &[(nodes + 4, code)]);
    assert_eq!(refused, FormatError::Radius { node: 0, code });
    // A leaf of two triangles in a tree of one.
    let one = triangle();
    let at = section(one.blob(), 1).0 + 4;
    let two = NodeLink::Leaf { first: 0, count: 2 }.encode();
    assert_eq!(refusal::<u16>(one.blob(), &[(at, two)]), FormatError::Leaf { first: 0 });
}

#[test]
fn every_number_of_a_metric_is_checked() {
    let built = heart();
    let at = section(built.blob(), 5).0;
    let row = |row: u32, number: usize| at + 12 * row as usize + 4 * number;
    let infinite = f32::INFINITY.to_bits();
    for (triangle, number, value) in
        [(2, 1, infinite), (2, 2, infinite), (2, 2, (-1.0_f32).to_bits())]
    {
        let refused = refusal::<u16>(built.blob(), &[(row(triangle, number), value)]);
        assert_eq!(refused, FormatError::Metric { triangle }, "number {number}");
    }
    // The first triangle continues no other.
    let first = word(built.blob(), row(0, 0));
    let refused = refusal::<u16>(built.blob(), &[(row(0, 0), first | 1 << 31)]);
    assert_eq!(refused, FormatError::Metric { triangle: 0 });
}

#[test]
fn the_solids_of_a_trees_roots_are_checked() {
    const WRONG: FormatError = FormatError::Section { kind: 12 };
    let built = cubes();
    let bytes = built.blob();
    assert_eq!((word(bytes, 44), word(bytes, 16)), (1, 24), "two roots");
    let (at, length) = section(bytes, 12);
    assert_eq!(length, 16);
    let table = [0, 4, 8, 12].map(|by| word(bytes, at + by));
    assert_eq!(table, [0, 0, 12, 1], "each root's first triangle and solid");
    for (by, wrong) in [
        (0, 1),  // The first root's triangles begin later.
        (8, 0),  // The second's are those of the first.
        (8, 24), // There are no more triangles.
        (4, 2),  // A solid of a third root.
        (12, 7),
    ] {
        assert_eq!(refusal::<u16>(bytes, &[(at + by, wrong)]), WRONG, "{wrong} at {by}");
    }
    // Each a cavity of the other: neither is the outer shell.
    assert_eq!(refusal::<u16>(bytes, &[(at + 4, 1), (at + 12, 0)]), WRONG);
    // Open surfaces, and a cavity, are right.
    for solids in [[u32::MAX, u32::MAX], [0, 0], [0, u32::MAX]] {
        let changed = with_words(bytes, &[(at + 4, solids[0]), (at + 12, solids[1])]);
        assert!(Tree::<u16>::from_bytes(&changed).is_ok(), "{solids:?}");
    }
    // Sides without the section, and the section without sides.
    for kind in [12, 8] {
        let row = row_of_section(bytes, kind);
        assert_eq!(refusal::<u16>(bytes, &[(row, UNKNOWN)]), WRONG, "without section {kind}");
    }
}

#[test]
fn a_neighbour_that_has_another_is_refused() {
    let built = heart();
    let tree = built.tree::<u16>().expect("valid");
    let at = section(built.blob(), 8).0;
    let TriangleRow(other) = tree.neighbour(TriangleRow(0), 0).expect("a closed surface");
    let back =
        (0..3).find(|&edge| tree.neighbour(TriangleRow(other), edge) == Some(TriangleRow(0)));
    let mut bytes = built.blob().to_vec();
    let place = at + 6 * other as usize + 2 * back.expect("the same edge") as usize;
    bytes[place..place + 2].copy_from_slice(&[0xFF; 2]);
    let refused = Tree::<u16>::from_bytes(&with_words(&bytes, &[])).expect_err("one-sided");
    assert_eq!(refused, FormatError::Neighbour { triangle: 0, edge: 0 });
}

/// Two cubes that touch along an edge: of its four triangles each has one neighbour, and no other triangle at the edge
/// may take its place.
#[test]
fn a_neighbour_is_not_another_triangle_at_the_edge() {
    let mut mesh = Mesh::default();
    for low in [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0)] {
        let (positions, triangles) = cuboid(low, low + Vec3::ONE);
        let numbers = positions.map(|at| {
            let known = mesh.positions.iter().position(|&position| position == at);
            known.unwrap_or_else(|| {
                mesh.positions.push(at);
                mesh.positions.len() - 1
            }) as u32
        });
        mesh.triangles.extend(triangles.map(|corners| corners.map(|v| numbers[v as usize])));
    }
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (14, 24));
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let mut owners = std::collections::BTreeMap::<_, Vec<_>>::new();
    for row in 0..tree.triangle_count() {
        let [a, b, c] = tree.corners(TriangleRow(row)).expect("a row");
        for (edge, ends) in (0..).zip([(a, b), (b, c), (c, a)]) {
            owners.entry(ends).or_default().push((row, edge));
        }
    }
    let at_edge = owners.into_values().find(|rows| rows.len() == 2).expect("an edge of four");
    let [(one, edge), (other, same)] = at_edge[..] else { unreachable!("two rows") };
    let [own, theirs] = [(one, edge), (other, same)].map(|(row, edge)| {
        let TriangleRow(across) = tree.neighbour(TriangleRow(row), edge).expect("a closed surface");
        across
    });
    assert_ne!(own, theirs, "each has its own");
    let mut bytes = built.blob().to_vec();
    let place = section(&bytes, 8).0 + 6 * one as usize + 2 * edge as usize;
    bytes[place..place + 2].copy_from_slice(&(theirs as u16).to_le_bytes());
    let refused = Tree::<u16>::from_bytes(&with_words(&bytes, &[])).expect_err("not a pair");
    let FormatError::Neighbour { triangle, .. } = refused else { panic!("{refused}") };
    assert_eq!(triangle, one.min(own), "the first of the two");
}

/// Above 65,535 triangles a row of 16 bits names one of several.
#[test]
fn a_large_narrow_tree_knows_its_neighbours_and_its_border() {
    let mesh = sheet(182, 100.0, |x, y| x * y * 0.01);
    let built = Builder::new().index(IndexWidth::Bits16).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    assert!(tree.triangle_count() > 65_535 && tree.has_adjacency());
    let corners = |row| tree.corners(TriangleRow(row)).expect("a row");
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let mut owners = std::collections::HashMap::new();
    for row in 0..tree.triangle_count() {
        for edge in edges(corners(row)) {
            owners.insert(edge, TriangleRow(row));
        }
    }
    let mut border = 0;
    for row in 0..tree.triangle_count() {
        for (edge, (from, to)) in (0..).zip(edges(corners(row))) {
            let expected = owners.get(&(to, from)).copied();
            assert_eq!(tree.neighbour(TriangleRow(row), edge), expected);
            border += u32::from(expected.is_none());
        }
    }
    assert_eq!(border, 4 * 182);
    assert_eq!(tree.neighbour(TriangleRow(tree.triangle_count()), 0), None);
}

#[test]
fn rows_outside_the_tables_have_no_value() {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    // Equal limits are not stored.
    let limits = (0..320).map(|triangle| if triangle % 2 == 0 { 1.5 } else { 1.25 }).collect();
    for built in [Builder::new(), Builder::new().limits(limits)] {
        let built = built.build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let (last, outside) = (TriangleRow(319), TriangleRow(320));
        assert!(tree.stretch_limit(last).is_some() && tree.corners(last).is_some());
        assert_eq!((tree.stretch_limit(outside), tree.corners(outside)), (None, None));
        assert!(tree.vertex_number(tree.vertex_count() - 1).is_some());
        assert_eq!(tree.vertex_number(tree.vertex_count()), None);
        assert_eq!(tree.rest_position(tree.vertex_count()), None);
        assert_eq!(tree.metric(320), None);
        assert_eq!(tree.node(tree.node_count()), None);
    }
}

/// A copy without a section that the tree has is another tree.
#[test]
fn a_tree_moves_only_to_a_copy_with_its_sections() {
    let built = heart();
    let tree = built.tree::<u16>().expect("valid");
    assert!(tree.moved_to(built.blob()).is_ok());
    for kind in [3, 4, 5, 8] {
        let row = row_of_section(built.blob(), kind);
        let other = with_words(built.blob(), &[(row, UNKNOWN)]);
        let refused = tree.moved_to(&other).expect_err("a section is missing");
        assert_eq!(refused, FormatError::Section { kind: 1 });
    }
    // The view that a query reads is checked against the bytes.
    let query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    assert_eq!(query.tree().check(built.blob()), Ok(()));
    let other = with_words(built.blob(), &[(8, !tree.mesh_id())]);
    let refused = query.tree().check(&other).expect_err("another mesh");
    assert_eq!(refused, FormatError::Field { offset: 8, value: tree.mesh_id() });
    let short = tree.moved_to(&built.blob()[..100]).expect_err("a part");
    assert!(matches!(short, FormatError::Length { .. } | FormatError::Section { .. }), "{short}");
}
