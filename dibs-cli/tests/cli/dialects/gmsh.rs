//! Gmsh's versions and elements.

use super::{Folder, is_tetrahedron, warnings};

const NODES: &str = "4\n1 0 0 0\n2 4 0 0\n3 0 5 0\n4 0 0 6\n";
const OLD: &str = "4\n1 2 2 3 1 1 3 2\n2 2 2 3 1 1 2 4\n3 2 2 4 1 2 3 4\n4 2 2 4 1 3 1 4\n";

fn old(nodes: &str, elements: &str) -> String {
    format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{nodes}$Elements\n{elements}$EndElements\n")
}

#[test]
fn every_version_is_read_or_named() {
    let folder = Folder::new();
    let plain = format!("$Nodes\n{NODES}$EndNodes\n");
    // A place on the model follows: nothing, one, two parameters.
    let parametric = "$ParametricNodes\n4\n1 0 0 0 0 1\n2 4 0 0 1 1 0.5\n3 0 5 0 2 1 0.5 0.25\n4 0 0 6 3 1\n$EndParametricNodes\n";
    let first = "4\n1 2 3 1 3 1 3 2\n2 2 3 1 3 1 2 4\n3 2 4 1 3 2 3 4\n4 2 4 1 3 3 1 4\n";
    for (name, text) in [
        ("2.2", old(&plain, OLD)),
        ("parametric", old(parametric, OLD)),
        ("1", format!("$NOD\n{NODES}$ENDNOD\n$ELM\n{first}$ENDELM\n")),
    ] {
        is_tetrahedron(&folder.read("a.msh", &text), 1.0, name);
        let labels = folder.read_labels("a.msh", &text).groups.unwrap().labels;
        assert_eq!(labels, [3, 3, 4, 4], "{name}");
    }
    let newer = "$MeshFormat\n4 0 8\n$EndMeshFormat\n";
    assert!(
        folder.says("a.msh", newer).contains("a Gmsh mesh of version 4; save it as version 4.1")
    );
}

#[test]
fn volumes_have_a_skin_and_curved_elements_a_name() {
    let folder = Folder::new();
    let nodes = format!("$Nodes\n{NODES}$EndNodes\n");
    for (name, elements) in [
        ("a volume", "1\n1 4 2 5 1 1 2 3 4\n"),
        ("inside out", "1\n1 4 2 5 1 1 3 2 4\n"),
        ("with a curve", "2\n1 1 2 0 1 1 2\n2 4 2 5 1 1 2 3 4\n"),
    ] {
        let import = folder.read_labels("a.msh", old(&nodes, elements));
        is_tetrahedron(&import, 1.0, name);
        assert_eq!(import.groups.clone().unwrap().labels, [5; 4], "{name}");
        assert_eq!(warnings(&import), ["1 volume cell and no triangles: the surface is its skin"]);
    }
    let both = format!("5\n5 4 2 5 1 1 2 3 4\n{}", &OLD[2..]);
    let import = folder.read("a.msh", old(&nodes, &both));
    is_tetrahedron(&import, 1.0, "both");
    assert!(warnings(&import)[0].starts_with("1 volume cell was left out"));
    let named = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 5 \"liver\"\n$EndPhysicalNames\n\
         {nodes}$Elements\n1\n1 4 2 5 1 1 2 3 4\n$EndElements\n"
    );
    assert_eq!(folder.read_labels("a.msh", named).groups.unwrap().groups[0].name, "liver");
    for (kind, says) in [
        (9, "curved triangles"),
        (21, "curved triangles"),
        (16, "curved quads"),
        (36, "curved quads"),
        (10, "curved quads"),
        (34, "elements of the type 34, which is not read"),
    ] {
        let message = folder.says("a.msh", old(&nodes, &format!("1\n1 {kind} 2 0 1 1 2 3\n")));
        assert!(message.contains(says) && message.contains("-2 -order 1"), "{kind}: {message}");
        assert!(!message.contains("not valid"), "{message}");
    }
    let ten = "1\n1 11 2 0 1 1 2 3 4 1 2 3 4 1 2\n";
    assert!(folder.says("a.msh", old(&nodes, ten)).contains("volume cells with curved faces"));
}
