//! The methods' names.

pub const PAPER: &str = "dibs-paper";
/// The paper's construction, searched as the paper does.
pub const PAPER_SEARCH: &str = "dibs-paper-search";
pub const DIBS: &str = "dibs";
pub const MEASURED: &str = "dibs-measured";
pub const WARM: &str = "dibs-warm";
pub const MEASURED_WARM: &str = "dibs-measured-warm";
pub const TRACKER: &str = "dibs-tracker";
/// The tracker without measured stretch.
pub const TRACKER_AT_LIMIT: &str = "dibs-tracker-limit";
/// A tree with nodes, asked by a tracker, or by a whole query.
pub const NODES_TRACKER: &str = "dibs-nodes-tracker";
pub const NODES_QUERY: &str = "dibs-nodes-query";
/// Boxes over the elements, whose vertices are moved when a query reads them.
pub const LAZY: &str = "aabb-lazy";
pub const REFIT: &str = "aabb-refit";
pub const HYBRID: &str = "aabb-hybrid";
/// Boxes over two frames, for a surface that moves between them.
pub const SWEPT: &str = "aabb-swept";
pub const EXHAUSTIVE: &str = "exhaustive";
pub const OBVHS: &str = "obvhs";
pub const PARRY_TRIMESH: &str = "parry-trimesh";
pub const PARRY_BVH: &str = "parry-bvh";

/// Methods that refit, with which DIBS is compared.
pub const OTHERS: [&str; 6] = [REFIT, HYBRID, OBVHS, PARRY_BVH, PARRY_TRIMESH, EXHAUSTIVE];

/// A name for people.
pub fn title(method: &str) -> &str {
    match method {
        PAPER => "DIBS, the paper's construction",
        PAPER_SEARCH => "DIBS, the paper's construction and search",
        DIBS => "DIBS",
        MEASURED => "DIBS, measured stretch",
        WARM => "DIBS, warm start",
        MEASURED_WARM => "DIBS, measured stretch, warm start",
        TRACKER => "DIBS, measured stretch, tracker",
        TRACKER_AT_LIMIT => "DIBS, tracker",
        NODES_TRACKER => "DIBS, nodes, measured stretch, tracker",
        NODES_QUERY => "DIBS, nodes, measured stretch, warm start",
        LAZY => "AABB over the elements, moved and refitted below when entered",
        SWEPT => "AABB, boxes over both frames",
        REFIT => "AABB, bottom-up refit",
        HYBRID => "AABB, hybrid refit",
        EXHAUSTIVE => "exhaustive",
        OBVHS => "obvhs 0.4",
        PARRY_TRIMESH => "parry3d 0.31 `TriMesh`",
        PARRY_BVH => "parry3d 0.31 `Bvh`, by hand",
        other => other,
    }
}
