//! Scripts of queries with side, on surfaces that have the properties of their bound.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};
use dibs_build::BuiltTree;
use dibs_nostd::{Capsule, Options, Query, Side, TriangleRow};
use dibs_tests::deform::Deformation;
use dibs_tests::oracle::Instrument;
use dibs_tests::poses::pose;
use dibs_tests::surfaces;
use fastrand::Rng;
use glam::Vec3;
use probe::{command, how};

use super::{Draw, Script, Subject, about, build};

/// Square of the sine of a corner below which a normal takes f64, with a margin for rounding.
const FLAT: f32 = 2.0 / 1_048_576.0;
/// Squares of twice a triangle's area (mm^4) are within these.
const AREAS: std::ops::Range<f32> = 1e-28..1e30;
const STACK: usize = 512;

impl Script {
    /// Spheres anywhere, and capsules whose axis is outside, on closed surfaces of one root with at most `ring` triangles
    /// around a vertex, in the deformations that leave no triangle flat.
    pub fn sided(
        subjects: &[Subject],
        ring: u32,
        queries: usize,
        draw: Draw,
        seed: u64,
    ) -> Result<Self> {
        let mut rng = Rng::with_seed(seed);
        let mut script = Self { how: how::SIGNED, ..Self::default() };
        let of_each = queries.div_ceil(subjects.len());
        let of_frame = (of_each / (2 * Deformation::ALL.len())).max(1);
        for Subject { name, mesh, leaf } in subjects {
            let built = build(mesh, *leaf);
            let tree = built.tree::<u16>()?;
            let triangles = bounded(name, &built, ring)?;
            script.tree(&built);
            let end = script.queries() + of_each;
            for deformation in Deformation::ALL.into_iter().cycle() {
                let left = end.saturating_sub(script.queries()).min(of_frame);
                if left == 0 {
                    break;
                }
                let moved = deformation.apply(mesh, tree.paths(), tree.stretch(), &mut rng);
                let rows = built.to_rows(&moved);
                if are_clear(&triangles, &rows) {
                    script.rows(&rows, tree.triangle_count());
                    script.asked_outside(&built, &rows, &triangles, left, draw, &mut rng)?;
                }
            }
        }
        script.words.push(command::END);
        Ok(script)
    }

    fn asked_outside(
        &mut self,
        built: &BuiltTree,
        rows: &[Vec3],
        triangles: &[[u32; 3]],
        queries: usize,
        draw: Draw,
        rng: &mut Rng,
    ) -> Result<()> {
        let tree = built.tree::<u16>()?;
        let mut query = Query::<_, STACK>::new(&tree)?;
        for number in 0..queries {
            let tool = match rng.u32(..3) {
                0 => about(rows, triangles, number, rng),
                1 => pose(rows, triangles, rng),
                _ => above(rows, triangles, number, rng),
            };
            let is_capsule = tool.start != tool.end;
            let warm = Draw::warm(tree.triangle_count(), rng);
            let (budget, deadline) = draw.budget(is_capsule, rng);
            let first = Some(TriangleRow(warm)).filter(|_| warm != u32::MAX);
            let options = Options::cold().budget(budget).warm_start(first);
            if !is_capsule || is_outside(&mut query, rows, &tool, &options)? {
                self.query(&tool, is_capsule, false, warm, budget, deadline);
            }
        }
        Ok(())
    }
}

/// A tool that stands on a vertex, from 1e-5 to 10 mm above it: alternately a sphere and a capsule.
fn above(rows: &[Vec3], triangles: &[[u32; 3]], number: usize, rng: &mut Rng) -> Instrument {
    let [at, ..] = triangles[rng.usize(..triangles.len())].map(|row| rows[row as usize]);
    let middle = rows.iter().sum::<Vec3>() / rows.len() as f32;
    let away = (at - middle).normalize_or(Vec3::Z);
    let start = at + away * 10_f32.powf(6.0 * rng.f32() - 5.0);
    match number % 2 {
        0 => Instrument::sphere(start, 2.5),
        _ => Instrument::capsule(start, start + away * 40.0, 2.5),
    }
}

/// Whether the query answers that the capsule's axis is outside: then it has searched no depth.
fn is_outside(
    query: &mut Query<'_, u16, STACK>,
    rows: &[Vec3],
    tool: &Instrument,
    options: &Options,
) -> Result<bool> {
    let capsule = Capsule::new(tool.start, tool.end, tool.radius)?;
    Ok(query.closest(rows, &capsule, options)?.side == Side::Outside)
}

/// The triangles of a surface whose queries with side have a bound: closed, of one root, with at most `ring` triangles around a
/// vertex.
pub fn bounded(name: &str, built: &BuiltTree, ring: u32) -> Result<Vec<[u32; 3]>> {
    let tree = built.tree::<u16>()?;
    let triangles = surfaces::triangles(&tree);
    ensure!(is_closed(&triangles), "{name} is not closed");
    ensure!(
        most_around(&triangles) <= ring,
        "{name} has more than {ring} triangles around a vertex"
    );
    ensure!(tree.roots() == 1, "{name} has several roots");
    Ok(triangles)
}

/// Whether no triangle of a frame is flat.
pub fn are_clear(triangles: &[[u32; 3]], rows: &[Vec3]) -> bool {
    triangles.iter().all(|corners| is_clear(corners.map(|row| rows[row as usize])))
}

/// Whether every edge has a triangle on each side.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let edges: std::collections::BTreeSet<_> =
        triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    edges.iter().all(|&(from, to)| edges.contains(&(to, from)))
}

/// The largest number of triangles around a vertex.
fn most_around(triangles: &[[u32; 3]]) -> u32 {
    let mut around: BTreeMap<u32, u32> = BTreeMap::new();
    for &row in triangles.as_flattened() {
        *around.entry(row).or_default() += 1;
    }
    around.into_values().max().unwrap_or_default()
}

/// Whether the core computes the triangle's normal in f32, from each of its corners.
fn is_clear([a, b, c]: [Vec3; 3]) -> bool {
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().all(|[a, b, c]| {
        let (ab, ac) = (b - a, c - a);
        let square = ab.cross(ac).length_squared();
        AREAS.contains(&square) && square > FLAT * ab.length_squared() * ac.length_squared()
    })
}
