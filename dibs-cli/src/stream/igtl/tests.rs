//! No message assigns a position to the wrong vertex. `DIBS_FRAMES` sets the number of messages, and `DIBS_WRITE` writes
//! their record into the repository's `docs/evidence/bridge.md`.

// Requirement: B-10

use super::content::Kind;
use super::matching::{MatchResult, matched};
use super::message::{HEADER, Header, pack};
use super::topology::{FEW, Topology};
use dibs_build::generate::{brain, heart};
use dibs_build::glam::Vec3;
use dibs_build::{Builder, Mesh};
use dibs_stream::SurfaceOrder;
use fastrand::Rng;
use xtask::workspace;

/// Messages between two changes of the topology.
const RUN: u64 = 50;

fn order(mesh: &Mesh) -> SurfaceOrder {
    let built = Builder::new().build(mesh).expect("a tree");
    SurfaceOrder::of(&built.tree::<u16>().expect("a tree"))
}

/// Faces with their points in random order, and randomly rotated and listed, some triangles in strips. Returns the
/// polygons, the strips, and the point of each vertex.
fn renumbered(
    faces: &[Vec<u32>],
    vertices: usize,
    random: &mut Rng,
) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
    let mut point_of: Vec<u32> = (0..vertices as u32).collect();
    random.shuffle(&mut point_of);
    let point = |corner: &u32| point_of[*corner as usize];
    let mut faces: Vec<Vec<u32>> =
        faces.iter().map(|corners| corners.iter().map(point).collect()).collect();
    random.shuffle(&mut faces);
    let (mut polygons, mut strips) = (Vec::new(), Vec::new());
    for mut corners in faces {
        let turn = random.usize(..corners.len());
        corners.rotate_left(turn);
        let is_strip = corners.len() == 3 && random.u8(..8) == 0;
        let list = if is_strip { &mut strips } else { &mut polygons };
        list.push(corners.len() as u32);
        list.extend(corners);
    }
    (polygons, strips, point_of)
}

/// Another mesh with the same number of points.
fn changed(triangles: &[[u32; 3]], vertices: usize, random: &mut Rng) -> Vec<Vec<u32>> {
    let mut changed = triangles.to_vec();
    match random.u8(..4) {
        // The other diagonal of two triangles.
        0 => {
            let at = random.usize(..changed.len());
            let [a, b, c] = changed[at];
            let beside =
                |other: &[u32; 3]| *other != [a, b, c] && other.contains(&a) && other.contains(&b);
            let other = changed.iter().position(beside).expect("a closed surface");
            let far = changed[other].into_iter().find(|corner| *corner != a && *corner != b);
            let far = far.expect("a third corner");
            (changed[at], changed[other]) = ([far, b, c], [a, far, c]);
        }
        // One corner replaced by a vertex elsewhere.
        1 => {
            let at = random.usize(..changed.len());
            let elsewhere =
                (changed[at][0] + 1 + random.u32(..vertices as u32 - 1)) % vertices as u32;
            changed[at][0] = elsewhere;
        }
        // One polygon of all points, which contains the corners of every triangle.
        2 => return vec![(0..vertices as u32).collect()],
        // One vertex in place of another.
        _ => {
            let (from, to) = (random.usize(..changed.len()), random.usize(1..changed.len()));
            changed[from] = changed[(from + to) % triangles.len()];
        }
    }
    faces(&changed)
}

fn faces(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    triangles.iter().map(|corners| corners.to_vec()).collect()
}

fn poly_data(positions: &[[f32; 3]], polygons: &[u32], strips: &[u32]) -> Vec<u8> {
    let sizes = [polygons, strips].map(|cells| 4 * cells.len() as u32);
    let head =
        [positions.len() as u32, 0, 0, 0, 0, sizes[0] / 16, sizes[0], sizes[1] / 16, sizes[1], 0];
    let words = [polygons, strips].concat();
    let positions = positions.iter().flatten().flat_map(|x| x.to_be_bytes());
    let head = head.iter().flat_map(|word| word.to_be_bytes());
    head.chain(positions).chain(words.iter().flat_map(|word| word.to_be_bytes())).collect()
}

/// Sends messages of one mesh, whose positions encode the vertex and the message, with points in the file's order and
/// in others, and messages of other meshes among them.
fn wrong_correspondences(mesh: &Mesh, messages: u64, seed: u64) -> (u64, u64) {
    let (order, vertices) = (order(mesh), mesh.positions.len());
    let triangles = order.triangles();
    assert_eq!((order.positions(), triangles.len()), (vertices, mesh.triangles.len()));
    let mut topology = Topology::new(order.clone());
    let mut random = Rng::with_seed(seed);
    let (mut wrong, mut refused) = (0, 0);
    let (mut polygons, mut strips, mut point_of, mut is_ours) = Default::default();
    for number in 0..messages {
        if number % RUN == 0 {
            is_ours = random.u8(..3) > 0;
            let shown =
                if is_ours { faces(triangles) } else { changed(triangles, vertices, &mut random) };
            (polygons, strips, point_of) = renumbered(&shown, vertices, &mut random);
            if random.u8(..3) == 0 {
                (strips, point_of) = (Vec::new(), (0..vertices as u32).collect());
                let runs = shown.iter().map(|face| [&[face.len() as u32], &face[..]].concat());
                polygons = runs.flatten().collect();
            }
        }
        let mut positions = vec![[0.0; 3]; vertices];
        for (vertex, &point) in point_of.iter().enumerate() {
            positions[point as usize] = [vertex as f32, (number % (1 << 24)) as f32, 0.5];
        }
        let message = pack("POLYDATA", "mesh", 1.0, &poly_data(&positions, &polygons, &strips));
        let (header, body) = message.split_first_chunk::<HEADER>().expect("a header");
        let content = Header::parse(header).expect("a header").content(body).expect("a content");
        let content = Kind::PolyData.read(content).expect("a list");
        match topology.numbering(content.positions.len(), content.cells.expect("cells")) {
            Ok(numbering) if is_ours => {
                let found = numbering.apply(content.positions);
                let time = (number % (1 << 24)) as f64;
                let is_at =
                    |(vertex, found): (usize, &[f64; 3])| *found == [vertex as f64, time, 0.5];
                wrong +=
                    u64::from(!(found.len() == vertices && found.iter().enumerate().all(is_at)));
            }
            Err(_) if !is_ours => refused += 1,
            _ => wrong += 1,
        }
    }
    (wrong, refused)
}

/// The record's beginning.
const HEAD: &str = "
## Correspondences

Messages POLYDATA whose positions say which vertex they are of. After 50 messages each time, other points, faces or another
mesh with as many points. Written by
`DIBS_FRAMES=1000000 DIBS_WRITE=1 cargo test --release -p dibs-cli no_vertex_is_taken_for_another`.

| triangles | messages | changes | of the mesh, every vertex in its place | of another mesh, refused | wrong |
|---|---|---|---|---|---|
";

#[test]
fn no_vertex_is_taken_for_another() {
    let messages =
        std::env::var("DIBS_FRAMES").map_or(4000, |count| count.parse().expect("a number"));
    let organs = [heart(1000).expect("a size").mesh, brain(2000).expect("a size")];
    let mut table = String::new();
    for (seed, mesh) in (1..).zip(&organs) {
        let (wrong, refused) = wrong_correspondences(mesh, messages / 2, seed);
        let (triangles, each) = (mesh.triangles.len(), messages / 2);
        let ours = each - refused - wrong;
        table +=
            &format!("| {triangles} | {each} | {} | {ours} | {refused} | {wrong} |\n", each / RUN);
        assert_eq!(wrong, 0);
        assert!((messages / 10..messages / 4).contains(&refused), "{refused}");
    }
    println!("{HEAD}{table}");
    if std::env::var_os("DIBS_WRITE").is_some() {
        let page = workspace::evidence().join("bridge.md");
        let old = std::fs::read_to_string(&page).expect("the page");
        let before = old.split("\n## Correspondences").next().unwrap_or_default();
        std::fs::write(page, format!("{before}{HEAD}{table}")).expect("writable");
    }
}

/// Where the triangles are symmetric they do not determine the points, and no guess is made. In the order of the mesh's
/// file this does not matter.
#[test]
fn symmetric_meshes_are_not_guessed() {
    const CORNERS: [[u32; 3]; 8] =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let at = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z].map(|way| 20.0 * way);
    let octahedron =
        Mesh { origin: Default::default(), positions: at.to_vec(), triangles: CORNERS.to_vec() };
    let mut topology = Topology::new(order(&octahedron));
    let mut answer = |turn: u32| {
        let words: Vec<u32> = CORNERS
            .iter()
            .flat_map(|corners| {
                [3, (corners[0] + turn) % 6, (corners[1] + turn) % 6, (corners[2] + turn) % 6]
            })
            .collect();
        let body = poly_data(&[[0.0; 3]; 6], &words, &[]);
        let content = Kind::PolyData.read(&body).expect("a list");
        topology
            .numbering(6, content.cells.expect("cells"))
            .map(|_| ())
            .map_err(|why| why.contains("symmetric"))
    };
    assert_eq!([0, 1, 0, 1].map(&mut answer), [Ok(()), Err(true), Ok(()), Err(true)]);
    // Two equal parts.
    let one = [[0, 1, 2], [0, 2, 3], [0, 3, 4]];
    let two = [&one[..], &one.map(|corners| corners.map(|corner| corner + 5))].concat();
    assert_eq!(matched(&two, &two), MatchResult::Several);
    // A strip that is its own mirror image: only the winding tells its sides apart, and a source may flip that.
    assert_eq!(matched(&one[..2], &[[4, 5, 6], [4, 6, 7]]), MatchResult::Several);
    assert!(matches!(matched(&one[..2], &one[..1]), MatchResult::None));
}

/// A quad covers two triangles of the tree. A polygon of all points has room for half of them, and its mesh is refused.
#[test]
fn faces_have_no_more_triangles_than_their_corners_make() {
    let mesh = heart(1000).expect("a size").mesh;
    let (order, vertices) = (order(&mesh), mesh.positions.len() as u32);
    let [a, b, c] = mesh.triangles[0];
    let is_beside = |t: &[u32; 3]| *t != [a, b, c] && t.contains(&a) && t.contains(&b);
    let beside = mesh.triangles.iter().position(is_beside).expect("a closed surface");
    let far = mesh.triangles[beside].into_iter().find(|v| *v != a && *v != b).expect("a corner");
    let mut quads = faces(&mesh.triangles);
    quads.swap_remove(beside.max(1));
    quads[0] = vec![a, far, b, c];
    assert!(order.check_faces(&quads).is_ok(), "two triangles of a quad");
    quads.push((0..vertices).collect());
    assert!(order.check_faces(&quads).is_ok(), "a part that the tree left out");
    assert!(order.check_faces(&[(0..vertices).collect()]).is_err(), "one face of all corners");
    quads[0] = vec![a, b, b, c, a];
    quads.pop();
    assert!(order.check_faces(&quads).is_err(), "three corners, one of two triangles");
}

/// A source may send twice as many faces as the tree has, and a thousand more; beyond that no memory is used.
#[test]
fn there_is_a_most_of_faces() {
    let mesh = heart(1000).expect("a size").mesh;
    let order = order(&mesh);
    let (points, most) = (order.positions(), 2 * order.triangles().len() + FEW);
    let answer = |polygons: usize, strips: usize| {
        let mut topology = Topology::new(order.clone());
        let faces = order.triangles().iter().cycle().take(polygons);
        let words: Vec<u32> = faces.flat_map(|&[a, b, c]| [3, a, b, c]).collect();
        // One strip of so many triangles.
        let corners = (0..strips as u32 + 2).map(|at| at % 3);
        let strip: Vec<u32> = match strips {
            0 => Vec::new(),
            _ => [strips as u32 + 2].into_iter().chain(corners).collect(),
        };
        let body = poly_data(&vec![[0.0; 3]; points], &words, &strip);
        let content = Kind::PolyData.read(&body).expect("a list");
        topology.numbering(points, content.cells.expect("cells")).map(|_| ())
    };
    assert_eq!(answer(most, 0), Ok(()));
    assert_eq!(answer(most - 10, 10), Ok(()));
    for (polygons, strips) in [(most + 1, 0), (most - 10, 11)] {
        let error = answer(polygons, strips).expect_err("more");
        assert!(error.contains("far more than"), "{error}");
    }
}

/// Triangles that a builder flipped still match those of the source.
#[test]
fn turned_triangles_are_the_same() {
    let mesh = heart(1000).expect("a size").mesh;
    let mut theirs = mesh.triangles.clone();
    theirs.iter_mut().step_by(3).for_each(|corners| corners.swap(0, 1));
    let MatchResult::One(pairs) = matched(&mesh.triangles, &theirs) else { panic!("not the same") };
    assert!(pairs.iter().all(|[one, other]| one == other));
}
