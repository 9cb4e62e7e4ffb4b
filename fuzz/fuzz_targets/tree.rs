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
    let mut links = vec![tree.root().2];
    while let Some(link) = links.pop() {
        match link {
            Link::Node(row) => {
                let children = tree.children(row).expect("a valid tree has its nodes");
                for (pin, _, link) in children {
                    assert!(pin < tree.vertex_count());
                    links.push(link);
                }
            }
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
