//! Finds the one isomorphism between two lists of triangles, if it is unique.
//!
//! Vertices get colours that describe their neighbourhoods, larger ones in each round (Weisfeiler and Leman). Once
//! every vertex has its own colour, an isomorphism can only pair vertices of equal colour, so there is at most one. The
//! pairs are then compared triangle by triangle, so a hash collision of two colours never gives a wrong pair.

// Requirement: B-10

/// Rounds until colours must distinguish all vertices: organs take fewer than ten, a regular grid up to its length.
const ROUNDS: usize = 64;

/// The result of comparing two lists of triangles.
#[derive(Debug, PartialEq)]
pub enum MatchResult {
    /// Isomorphic in one way: pairs of a vertex of the first list and the corresponding vertex of the second.
    One(Vec<[u32; 2]>),
    /// Isomorphic in several ways, or in one that the colours do not distinguish.
    Several,
    None,
}

/// Compares with the triangles' winding, and if that fails without it: a builder may have flipped triangles outwards.
pub fn matched(ours: &[[u32; 3]], theirs: &[[u32; 3]]) -> MatchResult {
    if ours.len() != theirs.len() {
        return MatchResult::None;
    }
    let any = turned(ours, theirs, false);
    match turned(ours, theirs, true) {
        // A mesh that is its own mirror image, from a source that may flip all triangles.
        MatchResult::One(_) if any == MatchResult::Several => MatchResult::Several,
        MatchResult::None => any,
        found => found,
    }
}

fn turned(ours: &[[u32; 3]], theirs: &[[u32; 3]], is_oriented: bool) -> MatchResult {
    let mut both = [Colours::new(ours, is_oriented), Colours::new(theirs, is_oriented)];
    let mut last = 0;
    for _ in 0..ROUNDS {
        let [first, second] = both.each_ref().map(Colours::sorted);
        if !first.iter().map(|one| one.0).eq(second.iter().map(|one| one.0)) {
            return MatchResult::None;
        }
        let colours = first.chunk_by(|one, next| one.0 == next.0).count();
        if colours == first.len() {
            let pairs: Vec<[u32; 2]> =
                first.iter().zip(&second).map(|(one, other)| [one.1, other.1]).collect();
            let is_same = is_same(ours, theirs, &pairs, is_oriented);
            return if is_same { MatchResult::One(pairs) } else { MatchResult::None };
        }
        if colours == last {
            return MatchResult::Several;
        }
        last = colours;
        both.iter_mut().for_each(Colours::refine);
    }
    MatchResult::Several
}

struct Colours<'a> {
    triangles: &'a [[u32; 3]],
    is_oriented: bool,
    /// Vertices that a triangle uses.
    used: Vec<u32>,
    of: Vec<u64>,
}

impl<'a> Colours<'a> {
    fn new(triangles: &'a [[u32; 3]], is_oriented: bool) -> Self {
        let mut used: Vec<u32> = triangles.concat();
        used.sort_unstable();
        used.dedup();
        let count = used.last().map_or(0, |&last| last as usize + 1);
        Self { triangles, is_oriented, used, of: vec![0; count] }
    }

    /// Colours with their vertices, sorted by colour.
    fn sorted(&self) -> Vec<(u64, u32)> {
        let mut sorted: Vec<_> =
            self.used.iter().map(|&vertex| (self.of[vertex as usize], vertex)).collect();
        sorted.sort_unstable();
        sorted
    }

    /// Gives each vertex a new colour from its old one and its neighbours', whatever the order of the triangles.
    fn refine(&mut self) {
        let mut next: Vec<u64> = self.of.iter().map(|&colour| mixed(colour)).collect();
        for &[a, b, c] in self.triangles {
            for [one, left, right] in [[a, b, c], [b, c, a], [c, a, b]] {
                let [left, right] = [left, right].map(|vertex| mixed(self.of[vertex as usize] ^ 1));
                let right = if self.is_oriented { right.rotate_left(17) } else { right };
                let next = &mut next[one as usize];
                *next = next.wrapping_add(mixed(left.wrapping_add(right)));
            }
        }
        self.of = next;
    }
}

/// The output function of `SplitMix64`.
fn mixed(bits: u64) -> u64 {
    let bits = bits.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let bits = (bits ^ bits >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let bits = (bits ^ bits >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^ bits >> 31
}

fn is_same(ours: &[[u32; 3]], theirs: &[[u32; 3]], pairs: &[[u32; 2]], is_oriented: bool) -> bool {
    let count = pairs.iter().map(|pair| pair[0] as usize + 1).max().unwrap_or(0);
    let mut theirs_of = vec![0; count];
    pairs.iter().for_each(|&[one, other]| theirs_of[one as usize] = other);
    let normal = |mut triangle: [u32; 3]| {
        if is_oriented {
            let least = (0..3).min_by_key(|&at| triangle[at]).unwrap_or(0);
            triangle.rotate_left(least);
        } else {
            triangle.sort_unstable();
        }
        triangle
    };
    let sorted = |triangles: &mut dyn Iterator<Item = [u32; 3]>| {
        let mut triangles: Vec<_> = triangles.map(normal).collect();
        triangles.sort_unstable();
        triangles
    };
    let mut ours = ours.iter().map(|triangle| triangle.map(|vertex| theirs_of[vertex as usize]));
    sorted(&mut ours) == sorted(&mut theirs.iter().copied())
}
