//! The `dibs` program and motions of nodes: in each form of a file, and what it says about frames that do not fit.

// Requirements: F-07, P-08

use dibs_build::glam::DVec3;
use dibs_build::Motion;

use crate::nodes::{heart, msh, vtk, vtu};
use crate::program::{json, succeeds};

/// A frame of the motion as nodes of a volume's file.
fn nodes(motion: &Motion, frame: usize) -> Vec<DVec3> {
    motion.frames[frame].iter().map(|at| at.as_dvec3()).collect()
}

#[test]
fn a_series_of_volumes_is_a_motion_for_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let volume = heart(folder);
    let motion = Motion::read(folder.join("nodes.pc2")).unwrap();
    let tetrahedra = volume.tetrahedra();
    for frame in 0..motion.frames.len() {
        let nodes = nodes(&motion, frame);
        for (format, text) in [
            ("vtk", vtk(&nodes, tetrahedra)),
            ("msh", msh(&nodes, tetrahedra)),
            ("vtu", vtu(&nodes, tetrahedra)),
        ] {
            std::fs::write(folder.join(format!("n_{frame:02}.{format}")), text).unwrap();
        }
    }
    std::fs::write(folder.join("tools.csv"), "sphere:0,0,120,5\n".repeat(200)).unwrap();
    let stretch = |motion: &str| {
        let line = format!("stretch heart.ply --nodes volume.vtk --motion {motion} --json");
        let told = json(folder, &line);
        (told["percentiles"].clone(), told["worst"].clone(), told["uniform_limit"].clone())
    };
    let build = |motion: &str| {
        let line = format!("build heart.ply -o h.dibs --nodes volume.vtk --motion {motion} --json");
        json(folder, &line)["tree"].clone()
    };
    let (needed, built) = (stretch("nodes.pc2"), build("nodes.pc2"));
    let track = |motion: &str| {
        succeeds(
            folder,
            &format!("track h.dibs --motion {motion} --motion-rate 30 --path tools.csv"),
        )
    };
    let tracked = track("nodes.pc2");
    for format in ["vtk", "msh", "vtu"] {
        let series = format!("n_%02d.{format}");
        assert_eq!(stretch(&series), needed, "{format}");
        assert_eq!(build(&series), built, "{format}");
        assert_eq!(track(&series), tracked, "{format}");
    }
}
