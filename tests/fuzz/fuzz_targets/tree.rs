//! Reads any bytes as a tree. It is refused, or every one of its records can be read. Length and checksum are made
//! right, so that the bytes reach the checks behind them.
#![no_main]

use dibs_nostd::format::{HEADER_BYTES, NodeLink, field};
use dibs_nostd::{Index, Tree, TriangleRow};
use dibs_tests::tree_bytes::reseal;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    if bytes.len() >= HEADER_BYTES {
        let length = bytes.len() as u32;
        bytes[field::LENGTH..][..4].copy_from_slice(&length.to_le_bytes());
        reseal(&mut bytes);
    }
    walk::<u16>(&bytes);
    walk::<u32>(&bytes);
});

/// Reads every node and triangle of a valid tree.
fn walk<I: Index>(bytes: &[u8]) {
    let Ok(tree) = Tree::<I>::from_bytes(bytes) else { return };
    let mut triangles = 0;
    let mut rows = vec![0];
    while let Some(row) = rows.pop() {
        let (pin, _, link) = tree.node(row).expect("a valid tree has its nodes");
        assert!(pin < tree.vertex_count());
        match link {
            NodeLink::Children { first, count } => rows.extend(first..first + count),
            NodeLink::Leaf { first, count } => {
                for row in first..first + count {
                    let corners = tree.corners(TriangleRow(row)).expect("a valid tree has its triangles");
                    assert!(corners.iter().all(|&corner| corner < tree.vertex_count()));
                    triangles += 1;
                }
            }
        }
    }
    assert_eq!(triangles, tree.triangle_count());
}
