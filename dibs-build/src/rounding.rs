//! Rounding to f32 in one direction.

/// The nearest f32 that is not below `x`.
pub(crate) fn round_up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x { near.next_up() } else { near }
}

/// The nearest f32 that is not above `x`.
pub(crate) fn round_down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}
