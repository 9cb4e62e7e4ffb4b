//! Any bytes as a tree: refused, or a tree whose every record can be read. The checksum is made right, so
//! that it is not what refuses them.
#![no_main]

use dibs_nostd::format::{CHECKSUM_AT, CRC, Link};
use dibs_nostd::{Index, Tree};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    if let Some(length) = bytes.len().checked_sub(CHECKSUM_AT + 4) {
        let length = (length + CHECKSUM_AT + 4) as u32;
        bytes[52..56].copy_from_slice(&length.to_le_bytes());
        let mut digest = CRC.digest();
        digest.update(&bytes[..CHECKSUM_AT]);
        digest.update(&bytes[CHECKSUM_AT + 4..]);
        bytes[CHECKSUM_AT..CHECKSUM_AT + 4].copy_from_slice(&digest.finalize().to_le_bytes());
    }
    walk::<u16>(&bytes);
    walk::<u32>(&bytes);
});

/// A valid tree has every record that it says it has.
fn walk<I: Index>(bytes: &[u8]) {
    let Ok(tree) = Tree::<I>::from_bytes(bytes) else { return };
    let mut triangles = 0;
    let mut rows = vec![0];
    while let Some(row) = rows.pop() {
        let (pin, _, link) = tree.node(row).expect("a valid tree has its nodes");
        assert!(pin < tree.vertex_count());
        match link {
            Link::Children { first, count } => rows.extend(first..first + count),
            Link::Leaf { first, count } => {
                for row in first..first + count {
                    let corners = tree.triangle(row).expect("a valid tree has its triangles");
                    assert!(corners.iter().all(|&corner| corner < tree.vertex_count()));
                    triangles += 1;
                }
            }
        }
    }
    assert_eq!(triangles, tree.triangle_count());
}
