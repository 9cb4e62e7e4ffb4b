//! Reads any bytes as a mesh file. It is refused with a message, or its triangles name vertices that exist, at finite
//! positions, and the builder does not panic.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use dibs_build::Builder;
use libfuzzer_sys::fuzz_target;

/// The file's path, in memory where the system has a folder for that.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("dibs-fuzz-{}", std::process::id()))
});

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(&*FILE, bytes).expect("a writable folder");
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
