//! The paper's baselines, written to be fast: flat arrays in f32, SAH splits, one tight loop to refit, SIMD boxes, near
//! child first, and the triangle kernels of the library under test.

mod aabb_tree;
mod blend;
pub mod bounds;
pub mod boxes;
mod exhaustive;
mod hybrid;
mod lazy;
mod paper;
mod refit;
mod swept;

pub use aabb_tree::AabbTree;
pub use blend::Blend;
pub use exhaustive::Exhaustive;
pub use hybrid::Hybrid;
pub use lazy::Lazy;
pub use paper::Paper;
pub use refit::Refit;
pub use swept::Swept;
