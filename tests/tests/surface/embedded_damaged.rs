//! Volumes that cannot move a surface, and damaged nodes: typed errors.

// Requirement: F-07

use dibs_build::{BuildError, Builder, BuiltTree, Mesh, Volume, VolumeError, generate};
use dibs_nostd::nodes::{Nodes, NodesError};
use dibs_nostd::{FormatError, PathKind, StretchError, Tree, measure_stretch};
use dibs_tests::tree_bytes::{reseal, row_of_section, section, with_words};
use glam::DVec3;

fn heart() -> (Mesh, Volume) {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let lattice = Volume::lattice(&mesh, [2, 2, 3]).expect("a lattice");
    (mesh, lattice)
}

fn built() -> BuiltTree {
    let (mesh, lattice) = heart();
    Builder::new().nodes(&lattice).build(&mesh).expect("held")
}

/// The defect of a tree whose section of nodes was changed.
fn defect(built: &BuiltTree, change: impl Fn(&mut [u8])) -> Option<NodesError> {
    let mut bytes = built.blob().to_vec();
    let (at, length) = section(&bytes, 11);
    change(&mut bytes[at..][..length]);
    reseal(&mut bytes);
    let tree = Tree::<u16>::from_bytes(&bytes).expect("the tree itself is well formed");
    Nodes::of(&tree).err()
}

fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    bytes[at..at + value.len()].copy_from_slice(value);
}

#[test]
fn damaged_nodes_are_refused() {
    let built = built();
    let nodes = 36;
    let elements = 32 + 12 * nodes as usize;
    let bindings = elements + 36 * 72;
    assert_eq!(defect(&built, |_| ()), None);
    let field = |offset: u8, value: u32| {
        let error = defect(&built, |bytes| put(bytes, offset.into(), &value.to_le_bytes()));
        assert_eq!(error, Some(NodesError::Field { offset, value }));
    };
    field(0, 3);
    field(0, 65_537);
    field(4, 0);
    field(4, 65_537);
    for wrong in [f32::NAN, f32::INFINITY, -1.0, 0.0] {
        field(8, wrong.to_bits());
        field(12, wrong.to_bits());
    }
    [16, 20, 24, 28].into_iter().for_each(|offset| field(offset, 1));
    let counts = [(0, nodes + 1), (4, 71_u32)];
    for (offset, count) in counts {
        let error = defect(&built, |bytes| put(bytes, offset, &count.to_le_bytes()));
        assert!(matches!(error, Some(NodesError::Length { .. })), "{error:?}");
    }
    let error = defect(&built, |bytes| put(bytes, 32 + 12 * 5 + 4, &f32::NAN.to_le_bytes()));
    assert_eq!(error, Some(NodesError::Node { node: 5 }));
    let error = defect(&built, |bytes| put(bytes, elements + 36 * 7 + 2, &36_u16.to_le_bytes()));
    assert_eq!(error, Some(NodesError::Corner { element: 7, node: 36, nodes }));
    for number in 0..7 {
        let at = elements + 36 * 7 + 8 + 4 * number;
        let error = defect(&built, |bytes| put(bytes, at, &f32::NAN.to_le_bytes()));
        assert_eq!(error, Some(NodesError::Element { element: 7 }), "{number}");
    }
    // The squares of its first and last edge.
    for (at, wrong) in [(8, 0.0_f32), (8, -1.0), (28, 0.0), (28, -1.0)] {
        let at = elements + 36 * 7 + at;
        let error = defect(&built, |bytes| put(bytes, at, &wrong.to_le_bytes()));
        assert_eq!(error, Some(NodesError::Element { element: 7 }), "{wrong}");
    }
    // The first and the last exchanged: the second has an earlier latest node than the one before it.
    let error = defect(&built, |bytes| {
        let (first, last) = (elements, elements + 36 * 71);
        (0..36).for_each(|at| bytes.swap(first + at, last + at));
    });
    assert_eq!(error, Some(NodesError::Element { element: 1 }));
    // Two of its nodes exchanged.
    let error = defect(&built, |bytes| {
        let at = elements + 36 * 7;
        bytes[at..at + 4].rotate_left(2);
    });
    assert_eq!(error, Some(NodesError::Inverted { element: 7 }));
    let error = defect(&built, |bytes| put(bytes, bindings + 8 * 9, &72_u16.to_le_bytes()));
    assert_eq!(error, Some(NodesError::Binding { vertex: 9, element: 72, elements: 72 }));
    let error = defect(&built, |bytes| put(bytes, bindings + 8 * 9 + 2, &[0xFF; 6]));
    assert_eq!(error, Some(NodesError::Weights { vertex: 9, sum: 6 * 65_535 - 65_536 }));
    // The marks of nodes that carry a vertex are the last two words.
    let end = |bytes: &[u8]| bytes.len();
    let error = defect(&built, |bytes| {
        let at = end(bytes) - 8;
        put(bytes, at, &[0; 8]);
    });
    assert!(matches!(error, Some(NodesError::Unmarked { vertex: 0, .. })), "{error:?}");
    let error = defect(&built, |bytes| {
        let at = end(bytes) - 1;
        put(bytes, at, &[0x80]);
    });
    assert_eq!(error, Some(NodesError::Marked { node: 63, nodes }));
    // A section shorter than its header.
    let bytes = built.blob();
    let short = with_words(bytes, &[(row_of_section(bytes, 11) + 8, 31)]);
    let tree = Tree::<u16>::from_bytes(&short).expect("the tree itself is well formed");
    assert_eq!(Nodes::of(&tree).err(), Some(NodesError::Length { expected: 32, found: 31 }));
}

/// Trees whose radii are lengths of paths through a volume must have nodes, and other trees must not; trees with nodes
/// have no metric.
#[test]
fn nodes_and_path_kind_go_together() {
    let built = built();
    let tree = built.tree::<u16>().expect("valid");
    assert_eq!(tree.paths(), PathKind::Volume);
    let rest: Vec<_> = (0..tree.vertex_count()).filter_map(|row| tree.rest_position(row)).collect();
    assert_eq!(measure_stretch(&tree, rest.as_slice()), Err(StretchError::NoMetric));
    let mut bytes = built.blob().to_vec();
    bytes[7] = 1;
    reseal(&mut bytes);
    let error = Tree::<u16>::from_bytes(&bytes).err();
    assert_eq!(error, Some(FormatError::Kind { kind: 11 }));
    let plain = Builder::new().build(&heart().0).expect("valid");
    assert_eq!(Nodes::of(&plain.tree::<u16>().expect("valid")).err(), Some(NodesError::Absent));
    let mut bytes = plain.blob().to_vec();
    bytes[7] = 2;
    reseal(&mut bytes);
    assert!(matches!(Tree::<u16>::from_bytes(&bytes), Err(FormatError::Section { .. })));
}

#[test]
fn volumes_that_cannot_carry_a_surface_are_refused() {
    let (mesh, lattice) = heart();
    let (nodes, tetrahedra) = (lattice.nodes().to_vec(), lattice.tetrahedra().to_vec());
    let with = |nodes: &[DVec3], tetrahedra: &[[u32; 4]]| {
        Volume::new(nodes.to_vec(), tetrahedra.to_vec()).err()
    };
    assert_eq!(with(&nodes, &tetrahedra), None);
    assert_eq!(with(&nodes, &[]), Some(VolumeError::Size { nodes: 36, tetrahedra: 0 }));
    let mut wrong = tetrahedra.clone();
    wrong[3][2] = 36;
    let error = VolumeError::Corner { tetrahedron: 3, node: 36, nodes: 36 };
    assert_eq!(with(&nodes, &wrong), Some(error));
    let mut wrong = tetrahedra.clone();
    wrong[3].swap(0, 1);
    wrong[5].swap(0, 1);
    assert_eq!(with(&nodes, &wrong), Some(VolumeError::Inverted { count: 2, first: 3 }));
    let mut wrong = nodes.clone();
    wrong[8].y = f64::NAN;
    assert_eq!(with(&wrong, &tetrahedra), Some(VolumeError::Coordinate { node: 8 }));
    let more: Vec<DVec3> = nodes.iter().copied().chain(nodes.iter().map(|&at| at * 2.0)).collect();
    let twice = tetrahedra.iter().copied().chain(tetrahedra.iter().map(|t| t.map(|n| n + 36)));
    let apart = with(&more, &twice.collect::<Vec<_>>());
    assert_eq!(apart, Some(VolumeError::Apart { parts: 2 }));
    for cells in [[0, 1, 1], [100, 100, 2], [u32::MAX; 3], [30_000, 1, 1]] {
        assert_eq!(Volume::lattice(&mesh, cells).err(), Some(VolumeError::Cells { cells }));
    }
    let build = |volume: &Volume| match Builder::new().nodes(volume).build(&mesh) {
        Err(BuildError::Volume(error)) => Some(error),
        Err(other) => panic!("{other}"),
        Ok(_) => None,
    };
    // A volume without the cell at a corner, and a surface that is elsewhere.
    let without: Vec<[u32; 4]> = tetrahedra[..66].to_vec();
    let part = Volume::new(nodes.clone(), without).expect("connected");
    let error = build(&part);
    let Some(VolumeError::Outside { count, distance, .. }) = error else { panic!("{error:?}") };
    assert!(count > 3 && count < 100 && distance > 1.0 && distance < 60.0, "{count} {distance}");
    let far: Vec<DVec3> = nodes.iter().map(|&at| at + DVec3::X * 1_000.0).collect();
    let error = build(&Volume::new(far, tetrahedra.clone()).expect("valid"));
    let Some(VolumeError::Outside { count, distance, .. }) = error else { panic!("{error:?}") };
    assert!(count == mesh.positions.len() && distance > 900.0, "{count} {distance}");
    // Flattened, and far too small.
    let flat: Vec<DVec3> = nodes.iter().map(|&at| at * DVec3::new(1.0, 1.0, 1e-9)).collect();
    let error = build(&Volume::new(flat, tetrahedra.clone()).expect("upright"));
    assert!(matches!(error, Some(VolumeError::Shape { .. } | VolumeError::Outside { .. })));
    let limits =
        Builder::new().limits(vec![1.5; mesh.triangles.len()]).nodes(&lattice).build(&mesh);
    let elements = tetrahedra.len();
    assert!(matches!(
        limits,
        Err(BuildError::Limits { limits: 320, elements: found, of: "tetrahedra" }) if found == elements
    ));
    let mut below = vec![1.5; elements];
    below[7] = 0.9;
    let below = Builder::new().limits(below).nodes(&lattice).build(&mesh);
    assert!(matches!(below, Err(BuildError::Limit { of: "tetrahedron", element: 7, .. })));
}

/// A vertex on a node, an edge or a face is bound exactly, and a volume whose boundary is the surface contains it.
#[test]
fn a_skin_is_in_its_volume() {
    let (_, lattice) = heart();
    let positions: Vec<_> = lattice.nodes().iter().map(|node| node.as_vec3()).collect();
    // Faces that belong to one tetrahedron only.
    let mut faces: Vec<([u32; 3], [u32; 3])> = Vec::new();
    for &[a, b, c, d] in lattice.tetrahedra() {
        for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
            let mut key = face;
            key.sort_unstable();
            match faces.iter().position(|(other, _)| *other == key) {
                Some(at) => drop(faces.swap_remove(at)),
                None => faces.push((key, face)),
            }
        }
    }
    let triangles = faces.into_iter().map(|(_, face)| face).collect();
    let mesh = Mesh { positions, triangles, origin: DVec3::ZERO };
    for stretch in [1.0, 1.5] {
        let built = Builder::new().stretch(stretch).nodes(&lattice).build(&mesh).expect("held");
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let rest: Vec<_> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
        // The rest shape is within the least limit.
        let sigma = nodes.measure(rest.as_slice()).expect("at rest").sigma();
        assert!((1.0..1.0001).contains(&sigma) && tree.stretch() < stretch + 1e-3, "{sigma}");
        assert!(tree.position_error() < 3e-3, "{}", tree.position_error());
    }
}
