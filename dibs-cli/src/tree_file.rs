//! Tree files of either index width.

use anyhow::{Result, anyhow};
use dibs_build::glam::DVec3;
use dibs_build::{ReadErrorKind, Summary};
use dibs_nostd::{FormatError, Tree, TriangleRow};
use std::path::Path;

/// A validated tree of either width.
#[derive(Clone, Copy)]
pub enum AnyTree<'a> {
    Narrow(Tree<'a, u16>),
    Wide(Tree<'a, u32>),
}

impl AnyTree<'_> {
    /// The point that the tree's coordinates are relative to.
    pub fn origin(&self) -> DVec3 {
        match self {
            Self::Narrow(tree) => tree.origin(),
            Self::Wide(tree) => tree.origin(),
        }
        .into()
    }

    /// The label of a triangle, if the tree has labels.
    pub fn label(&self, triangle: TriangleRow) -> Option<u8> {
        match self {
            Self::Narrow(tree) => tree.label(triangle),
            Self::Wide(tree) => tree.label(triangle),
        }
    }
}

pub fn load(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|e| anyhow!("{}: cannot be read ({e})", path.display()))
}

pub fn validate<'a>(bytes: &'a [u8], path: &Path) -> Result<AnyTree<'a>> {
    match Tree::<u16>::from_bytes(bytes) {
        Err(FormatError::Width { .. }) => Tree::<u32>::from_bytes(bytes).map(AnyTree::Wide),
        narrow => narrow.map(AnyTree::Narrow),
    }
    .map_err(|error| {
        let name = path.display();
        match dibs_build::Format::of(bytes, path) {
            _ if bytes.starts_with(b"DIBS") => {
                anyhow!("{name}: not a valid tree: {error}; build it again")
            }
            Ok(format) => {
                let tree = path.with_extension("dibs");
                anyhow!(
                    "{name}: not a tree: this is a mesh file ({format}); make its tree first: `dibs build {name} -o {}`",
                    tree.display()
                )
            }
            Err(ReadErrorKind::Foreign { what, .. }) => {
                anyhow!("{name}: not a tree: this is {what}; give the file that `dibs build` wrote")
            }
            Err(ReadErrorKind::Empty) => anyhow!("{name}: not a tree: the file is empty; build it again"),
            Err(_) => anyhow!("{name}: not a valid tree: {error}; build it again"),
        }
    })
}

pub fn print(summary: &Summary) {
    let s = summary;
    println!(
        "tree     triangles {}, vertices {}, nodes {}, stack {}, {}-bit indices",
        s.triangles, s.vertices, s.nodes, s.stack, s.index_bits
    );
    let paths = match s.volume {
        Some(_) => "of tetrahedra",
        None if s.surface_paths => "of triangles",
        None => "of edges",
    };
    let limit = if s.least_stretch_limit < s.stretch {
        format!("limits {} to {}", s.least_stretch_limit, s.stretch)
    } else {
        format!("limit {}", s.stretch)
    };
    println!("stretch  {limit} {paths}, root radius {}", s.root_radius);
    if s.roots > 1 {
        println!("roots    {}, of surfaces that share no vertex", s.roots);
    }
    if let (Some([low, high]), Some(edge)) = (s.bounding_box, s.mean_edge) {
        let size: [f32; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
        println!("box      {low:.4?} to {high:.4?}: {size:.4?}; mean edge {edge:.4}");
    }
    if s.origin != [0.0; 3] {
        let [x, y, z] = s.origin;
        println!("origin   {x},{y},{z}: coordinates of the tree count from there");
    }
    if s.labels > 0 {
        println!("labels   {} different", s.labels);
    }
    let unit = s.unit.map_or_else(String::new, |unit| format!(" in {unit}"));
    let plural = if s.file_triangles == 1 { "" } else { "s" };
    println!("file     {} vertices, {} triangle{plural}{unit}", s.file_vertices, s.file_triangles);
    println!("mesh id  {:08x}", s.mesh_id);
    println!(
        "flash    {} bytes; of these a query reads {} ({:.1} a triangle)",
        s.flash_bytes, s.query_bytes, s.query_bytes_per_triangle
    );
    let rows = s.volume.map_or(s.ram_bytes, |volume| volume.ram_bytes);
    println!(
        "RAM      {rows} bytes for two buffers of positions, {} for a query's stack",
        s.stack_bytes
    );
    if let Some(v) = s.volume {
        println!(
            "nodes    {} of {} tetrahedra, {} bytes of the flash; a frame is their positions",
            v.nodes, v.tetrahedra, v.flash_bytes
        );
        if v.amplification > 1.0 {
            println!(
                "outside  vertices move up to {:.2} times as far as nodes, and so do their errors",
                v.amplification
            );
        }
    }
    if let Some(m) = s.modes {
        println!(
            "modes    {}, within {} of the motion (rms {}); {} bytes of the flash ({:.1} a vertex), \
             {} a frame; {} anchors of the stretch bound",
            m.count,
            m.position_error,
            m.rms_error,
            m.flash_bytes,
            m.flash_bytes_per_vertex,
            4 * m.count,
            m.anchors
        );
    }
}
