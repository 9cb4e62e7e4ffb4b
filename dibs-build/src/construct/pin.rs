//! The pin of a section's sphere: the vertex with the smallest radius around the section.

use super::section::{Searches, Section, Surface};

/// A pin and the geodesic radius of the section around it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pin {
    pub vertex: u32,
    pub radius: f64,
}

/// In sections of at most this many vertices each vertex is tried as the pin.
const TRY_ALL: usize = 12;

/// Most iterations that improve the centre.
const ROUNDS: usize = 4;

/// The geodesic centre, approximately. Two sweeps find two far seeds; the centre is the vertex whose larger distance to
/// them is smallest; it is then improved with the vertices farthest from it. Any vertex of the mesh may be the pin.
/// `start` is a vertex of the section, preferably at its border.
///
/// Leaves the distances from the two seeds in `searches.seeds`.
pub(crate) fn geodesic_centre(
    surface: &Surface<'_>,
    section: &Section,
    searches: &mut Searches,
    start: u32,
) -> Pin {
    let first = searches.search_other(surface, section, start);
    if first.reached < section.vertices.len() {
        searches.stay();
    }
    let second = searches.search_seed(0, surface, section, first.vertex);
    searches.search_seed(1, surface, section, second.vertex);
    let first = first.vertex;
    if second.reached < section.vertices.len() {
        // The section's parts are not connected nearby: it gets no sphere of its own.
        return Pin { vertex: first, radius: f64::INFINITY };
    }
    if section.vertices.len() <= TRY_ALL {
        return best_of_all(surface, section, searches);
    }
    let mut candidates = between_seeds(searches);
    let Some(mut centre) = nearest(&candidates) else {
        return evaluate(surface, section, searches, first);
    };
    let mut best = evaluate(surface, section, searches, centre);
    for _ in 0..ROUNDS {
        let far = searches.search_other(surface, section, centre).vertex;
        searches.search_other(surface, section, far);
        for (vertex, worst) in &mut candidates {
            *worst = worst.max(searches.other.get(*vertex));
        }
        match nearest(&candidates) {
            Some(next) if next != centre => centre = next,
            _ => break,
        }
        let found = evaluate(surface, section, searches, centre);
        if found.radius < best.radius {
            best = found;
        }
    }
    best
}

/// The vertices about midway between the two seeds, each with its larger distance to them.
fn between_seeds(searches: &Searches) -> Vec<(u32, f64)> {
    let settled = searches.seeds[0].settled();
    let larger = |v: u32| (v, to_seeds(searches, v));
    let least = settled.iter().map(|&v| larger(v).1).fold(f64::INFINITY, f64::min);
    let near = settled.iter().map(|&v| larger(v));
    near.filter(|&(_, distance)| distance <= 1.5 * least).collect()
}

/// The candidate whose worst distance is least.
fn nearest(candidates: &[(u32, f64)]) -> Option<u32> {
    let order = |a: &&(u32, f64), b: &&(u32, f64)| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0));
    candidates.iter().min_by(order).map(|&(vertex, _)| vertex)
}

/// The larger distance of a vertex to the seeds: a lower bound on the radius around it.
fn to_seeds(searches: &Searches, vertex: u32) -> f64 {
    let [first, second] = &searches.seeds;
    first.get(vertex).max(second.get(vertex))
}

/// The pin with the smallest radius among all vertices of the section.
fn best_of_all(surface: &Surface<'_>, section: &Section, searches: &mut Searches) -> Pin {
    let least = |&v: &u32| (v, to_seeds(searches, v));
    let mut candidates: Vec<(u32, f64)> = section.vertices.iter().map(least).collect();
    candidates.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let mut best = Pin { vertex: section.vertices[0], radius: f64::INFINITY };
    for (vertex, least) in candidates {
        if least >= best.radius {
            break;
        }
        let found = evaluate(surface, section, searches, vertex);
        if found.radius < best.radius {
            best = found;
        }
    }
    best
}

/// The radius of the section around a vertex.
pub(crate) fn evaluate(
    surface: &Surface<'_>,
    section: &Section,
    searches: &mut Searches,
    vertex: u32,
) -> Pin {
    let farthest = searches.search_other(surface, section, vertex);
    let complete = farthest.reached == section.vertices.len();
    Pin { vertex, radius: if complete { farthest.distance } else { f64::INFINITY } }
}
