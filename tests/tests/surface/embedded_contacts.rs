//! Contacts of surfaces that nodes move, beside tables of the same vertices: of the same tree and of another one.

// Requirements: F-07, S-04

use dibs_build::Builder;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{
    Capsule, Contact, Contacts, MeasuredStretch, Options, Proximity, Query, TriangleRow,
    VertexTable, measure_stretch,
};
use dibs_tests::deform::unit;
use dibs_tests::embedded::{Carried, NodeMotion, all, gradient, rest, rows};
use dibs_tests::sample;
use dibs_tests::surfaces::Inexact;
use fastrand::Rng;
use glam::Vec3;

const MARGIN: f32 = 6.0;
const RADIUS: f32 = 2.0;

/// A capsule beside a vertex of the surface, or with its axis through it.
fn tool(at: Vec3, rng: &mut Rng) -> Capsule {
    let away = unit(rng) * 8.0 * rng.f32();
    let span = unit(rng) * 25.0 * rng.f32();
    Capsule::new(at + away, at + away + span, RADIUS).expect("finite")
}

fn contacts(
    query: &mut Query<'_, u16, MAX_STACK>,
    surface: &impl VertexTable,
    (tool, stretch): (&Capsule, MeasuredStretch),
) -> (Proximity, Vec<Contact>) {
    let mut list = Contacts::<64, 2048>::new();
    let options = Options::cold().stretch(stretch);
    let closest = query.contacts(surface, tool, MARGIN, &options, &mut list).expect("sound");
    (closest, list.iter().copied().collect())
}

/// Whether the axis crosses or is inside, at this contact.
fn is_deep(contact: &Contact) -> bool {
    contact.separation < -RADIUS
}

/// To the bit, outside and where the axis crosses: a query does not see where a vertex comes from.
#[test]
fn contacts_on_nodes_are_those_of_a_table() {
    let mut rng = Rng::with_seed(41);
    let mut counts = [0; 2];
    for Carried { built, name, .. } in all(&mut rng) {
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        for trial in 0..sample(120) {
            let kind = NodeMotion::ALL[trial % NodeMotion::ALL.len()];
            let frame = kind.apply(&nodes, &mut rng);
            let Ok(stretch) = nodes.measure(frame.as_slice()) else { continue };
            let surface = nodes.surface(frame.as_slice());
            let table = rows(&surface);
            let tool = tool(table[rng.usize(..table.len())], &mut rng);
            let carried = contacts(&mut query, &surface, (&tool, stretch));
            let table = Inexact(&table, surface.position_error());
            assert_eq!(carried, contacts(&mut query, &table, (&tool, stretch)), "{name} {kind:?}");
            for contact in &carried.1 {
                counts[usize::from(is_deep(contact))] += 1;
            }
        }
    }
    println!("{counts:?} contacts outside and inside");
    assert!(counts.iter().all(|&count| count > 200), "{counts:?}");
}

/// Beside the mesh itself, moved as the nodes are, in a tree of its own: a contact outside differs by no more than the
/// accuracies, and by what 16 bits of weights move the vertices at rest.
#[test]
fn contacts_on_nodes_are_those_of_the_mesh() {
    let mut rng = Rng::with_seed(42);
    let (mut counts, mut largest, mut widest) = ([0; 3], 0.0_f32, 0.0_f32);
    for Carried { built, mesh, name, .. } in all(&mut rng) {
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let plain = Builder::new().stretch(2.0).build(&mesh).expect("valid");
        let of_mesh = plain.tree::<u16>().expect("valid");
        let has_neighbours =
            |row| (0..3).all(|edge| tree.neighbour(TriangleRow(row), edge).is_some());
        let is_closed = (0..tree.triangle_count()).all(has_neighbours);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut other = Query::<u16, MAX_STACK>::new(&of_mesh).expect("deep enough");
        for _ in 0..sample(120) {
            // Affine, so that an element's vertices move as the mesh does.
            let by = gradient(&mut rng, 0.02);
            let frame: Vec<Vec3> = rest(&nodes).iter().map(|&at| by * at).collect();
            let vertices: Vec<Vec3> = mesh.positions.iter().map(|&at| by * at).collect();
            let table = plain.to_rows(&vertices);
            let Ok(stretch) = nodes.measure(frame.as_slice()) else { continue };
            let Ok(of_table) = measure_stretch(&of_mesh, table.as_slice()) else { continue };
            let surface = nodes.surface(frame.as_slice());
            let at = rows(&surface);
            let apart = built.vertex_order().iter().zip(&at);
            let apart = apart.map(|(&vertex, at)| at.distance(vertices[vertex as usize]));
            let apart = apart.fold(0.0, f32::max);
            let tool = tool(at[rng.usize(..at.len())], &mut rng);
            let (one, ours) = contacts(&mut query, &surface, (&tool, stretch));
            let (two, theirs) = contacts(&mut other, &table.as_slice(), (&tool, of_table));
            let limit = apart + one.accuracy + two.accuracy;
            // The sign of an open surface may change without contact.
            let [first, second] = [one.interval(), two.interval()];
            let meet = first.lower <= second.upper + apart && second.lower <= first.upper + apart;
            assert!(meet || !is_closed, "{name}: {one:?} {two:?}");
            // One that hardly is a minimum, or hardly within the margin, may be in one list alone.
            counts[2] += usize::from(ours.len() != theirs.len());
            if ours.len() != theirs.len() {
                continue;
            }
            for (one, two) in ours.iter().zip(&theirs) {
                counts[usize::from(is_deep(one))] += 1;
                let off = (one.separation - two.separation).abs();
                if !is_deep(one) && !is_deep(two) {
                    assert!(off <= limit, "{name}: {off} {limit} {one:?} {two:?}");
                    largest = largest.max(off);
                }
            }
            widest = widest.max(apart);
        }
    }
    println!("{counts:?}: {largest} mm of {widest} mm between vertices");
    assert!(counts[0] > 200 && counts[1] > 100 && counts[2] < 20, "{counts:?}");
    assert!(largest > 1e-5, "{largest}");
}
