//! Hill climbing towards a failure.

/// Climbs from a state by random changes: each that scores higher than the best so far is kept. An impossible state has
/// no score. Returns the last state that was kept, and its score.
pub fn climb<S>(
    start: S,
    steps: usize,
    mut change: impl FnMut(&S) -> S,
    mut score: impl FnMut(&S) -> Option<f64>,
) -> (S, f64) {
    let mut best = score(&start).unwrap_or(f64::NEG_INFINITY);
    let mut state = start;
    for _ in 0..steps {
        let next = change(&state);
        if let Some(found) = score(&next).filter(|found| *found > best) {
            (state, best) = (next, found);
        }
    }
    (state, best)
}
