//! Reads any bytes as a mesh file. It is refused with a message, or its triangles name vertices that exist, at finite
//! positions, and the builder does not panic. With its groups as labels there is one for each triangle.
//!
//! As the target `formats` it has the readers of VTK's XML, glTF and 3MF, too, which compile for long.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use dibs_build::{Builder, Import, ReadOptions};
use libfuzzer_sys::fuzz_target;

/// The file's path, in memory where the system has a folder for that.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("dibs-fuzz-{}", std::process::id()))
});

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(&*FILE, bytes).expect("a writable folder");
    let labelled = ReadOptions { groups: true, ..Import::options() };
    if let Ok(import) = labelled.read(&*FILE) {
        let labels = import.groups.expect("groups were asked for").labels;
        assert_eq!(labels.len(), import.mesh.triangles.len());
    }
    match dibs_build::read(&*FILE) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(import) => {
            let mesh = import.mesh;
            let rows = mesh.positions.len() as u32;
            assert!(mesh.triangles.iter().flatten().all(|&corner| corner < rows));
            assert!(mesh.positions.iter().all(|position| position.is_finite()));
            if mesh.triangles.len() <= 64 {
                // The builder may refuse the mesh: its lengths can be too large for f32.
                let _ = Builder::new().build(&mesh);
            }
        }
    }
});
