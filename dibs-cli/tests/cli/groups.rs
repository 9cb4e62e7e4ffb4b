//! Labels from the groups of mesh files, as other programs write them.

// Requirement: A-12

use std::path::{Path, PathBuf};

use dibs_build::{Group, Groups, Import, ReadErrorKind, ReadOptions};

use crate::program::{dibs, fails, json, succeeds};

/// The triangles of the files that `tests/fixtures/make.py` writes, and their labels.
const LABELLED: [([u32; 3], u8); 8] = [
    ([0, 2, 4], 3),
    ([2, 1, 4], 3),
    ([1, 3, 4], 3),
    ([3, 0, 4], 7),
    ([2, 0, 5], 7),
    ([1, 2, 5], 0),
    ([3, 1, 5], 0),
    ([0, 3, 5], 255),
];

/// Two triangles and a square between, each of another group or material.
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 1\nv -1 0 1\n\
    f 1 4 6\nf 1 1 4\nf 1 1 6\ng wall\nf 1 2 3 4\nusemtl red\nf 2 5 3\n";

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../dibs-build/tests/fixtures").join(name)
}

fn options() -> ReadOptions {
    ReadOptions { groups: true, ..Import::options() }
}

/// The groups of a text's mesh.
fn groups(folder: &Path, name: &str, text: &str) -> Result<Groups, ReadErrorKind> {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    options().read(path).map(|import| import.groups.unwrap()).map_err(|error| error.kind)
}

#[test]
fn groups_of_other_programs_are_labels() {
    for name in [
        "labels_51.vtk",
        "labels_42.vtk",
        "labels_meshio.vtk",
        "labels.vtp",
        "labels_22.msh",
        "labels_22_binary.msh",
        "labels_41.msh",
        "labels_41_binary.msh",
    ] {
        let Import { mesh, groups, .. } = options().read(fixture(name)).unwrap();
        let groups = groups.unwrap();
        assert_eq!(groups.labels.len(), mesh.triangles.len(), "{name}");
        // Gmsh's older format leaves out what has no group.
        assert_eq!(mesh.triangles.len(), if name.contains("22") { 6 } else { 8 }, "{name}");
        for (triangle, label) in mesh.triangles.iter().zip(&groups.labels) {
            let (_, expected) = LABELLED.iter().find(|(other, _)| other == triangle).unwrap();
            assert_eq!(label, expected, "{name}: {triangle:?}");
        }
        let found: Vec<(u8, &str, usize)> =
            groups.groups.iter().map(|g| (g.label, g.name.as_str(), g.triangles)).collect();
        let named = name.ends_with("msh");
        let wall = if named { "left wall" } else { "" };
        let septum = if named { "septum" } else { "" };
        let none = [(0, "", 2)].into_iter().filter(|_| !name.contains("22"));
        let expected: Vec<_> = none.chain([(3, wall, 3), (7, septum, 2), (255, "", 1)]).collect();
        assert_eq!(found, expected, "{name}");
        // Groups that nobody asks for are not read.
        assert_eq!(dibs_build::read(fixture(name)).unwrap().groups, None);
    }
}

#[test]
fn names_of_groups_and_materials_are_numbered_by_their_first_face() {
    let folder = tempfile::tempdir().unwrap();
    let found = groups(folder.path(), "a.obj", OBJ).unwrap();
    // The faces without area are dropped, the square is cut, and no label moves.
    assert_eq!(found.labels, [0, 1, 1, 2]);
    let group = |label, name: &str, triangles| Group { label, name: name.to_owned(), triangles };
    let expected = [group(0, "", 1), group(1, "wall", 2), group(2, "wall / red", 1)];
    assert_eq!(found.groups, expected);
}

#[test]
fn files_without_groups_and_numbers_that_are_no_labels_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let says = |name: &str, text: &str| groups(folder, name, text).unwrap_err().to_string();
    let plain: String =
        OBJ.lines().filter(|l| !l.starts_with(['g', 'u'])).map(|l| l.to_owned() + "\n").collect();
    assert!(says("a.obj", &plain).contains("statements `g` or `usemtl`"));
    let off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert!(says("a.off", off).contains("they are read of OBJ, VTK and Gmsh"));
    let many: String = (0..256).map(|n| format!("g {n}\nf 1 2 3\n")).collect();
    assert!(says("a.obj", &(plain + &many)).starts_with("257 groups, and there are 256 labels"));

    let vtk = |data: &str| {
        format!(
            "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n\
             POLYGONS 2 8\n3 0 1 2\n3 1 3 2\n{data}"
        )
    };
    let found = groups(folder, "a.vtk", &vtk("CELL_DATA 2\nSCALARS label int 1\n4 9\n")).unwrap();
    assert_eq!(found.labels, [4, 9]);
    for (data, part) in [
        ("", "cell data named label, labels or RegionId"),
        ("CELL_DATA 2\nSCALARS tissue int 1\nLOOKUP_TABLE default\n4 9\n", "cell data named label"),
        (
            "CELL_DATA 2\nSCALARS label int 3\nLOOKUP_TABLE default\n4 9 1 1 1 1\n",
            "cell data named label",
        ),
        (
            "POINT_DATA 4\nSCALARS label int 1\nLOOKUP_TABLE default\n4 9 4 9\n",
            "cell data named label",
        ),
        (
            "CELL_DATA 2\nSCALARS label int 1\nLOOKUP_TABLE default\n4 256\n",
            "face 2 has the group 256",
        ),
        (
            "CELL_DATA 2\nSCALARS label float 1\nLOOKUP_TABLE default\n-1 2\n",
            "face 1 has the group -1",
        ),
        (
            "CELL_DATA 2\nSCALARS label float 1\nLOOKUP_TABLE default\n1.5 2\n",
            "face 1 has the group 1.5",
        ),
        ("CELL_DATA 1\nSCALARS label int 1\nLOOKUP_TABLE default\n4\n", "1 labels for 2 cells"),
        ("CELL_DATA 2\nSCALARS label int 1\nLOOKUP_TABLE default\n4\n", "ends early"),
        ("CELL_DATA 2\nSURPRISE label\n", "'SURPRISE' was not expected"),
    ] {
        let error = says("a.vtk", &vtk(data));
        assert!(error.contains(part), "{data}: {error}");
    }

    let msh = std::fs::read_to_string(fixture("labels_41.msh")).unwrap();
    let several = msh.replace("1 3 0 \n", "2 3 7 0 \n");
    assert!(says("a.msh", &several).contains("surface 43 is in several physical groups"));
    let none = msh
        .replace("1 3 0 \n", "0 0 \n")
        .replace("1 7 0 \n", "0 0 \n")
        .replace("1 255 0 \n", "0 0 \n");
    assert!(says("a.msh", &none).contains("physical groups of surfaces"));
    let large = msh.replace("1 7 0 \n", "1 256 0 \n");
    assert!(says("a.msh", &large).contains("has the group 256"));
    let parted = "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfVerts=\"0\"><CellData>\
        <DataArray type=\"Int32\" Name=\"label\" format=\"ascii\">1 2</DataArray></CellData><Points>\
        <DataArray type=\"Float32\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points><Strips>\
        <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>\
        <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray></Strips><Polys>\
        <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>\
        <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray></Polys></Piece></PolyData></VTKFile>";
    assert!(says("a.vtp", parted).contains("labels of polygons and strips together"));
}

#[test]
fn the_program_labels_by_groups() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::copy(fixture("labels_41_binary.msh"), folder.join("organs.msh")).unwrap();
    let said = succeeds(folder, "build organs.msh -o organs.dibs --labels-from-groups");
    assert!(said.contains("label    3: 3 triangles left wall\n"), "{said}");
    assert!(said.contains("labels   4 different"), "{said}");
    let built = json(folder, "build organs.msh -o organs.dibs --labels-from-groups --json");
    assert_eq!(built["groups"][2]["name"], "septum");
    assert_eq!(built["groups"][2]["label"], 7);
    let answer = json(folder, "query organs.dibs --tool sphere:9,9,9,1 --json");
    assert_eq!((&answer["triangle"].as_array().unwrap().len(), &answer["label"]), (&3, &3.into()));
    // Without the option a tree has no labels.
    let plain = json(folder, "build organs.msh -o plain.dibs --json");
    assert_eq!((&plain["tree"]["labels"], &plain["groups"]), (&0.into(), &serde_json::Value::Null));

    std::fs::write(folder.join("plain.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").unwrap();
    let error = fails(folder, "build plain.off -o no.dibs --labels-from-groups");
    assert!(error.starts_with("plain.off: no groups of triangles"), "{error}");
    let both = dibs(folder, "build organs.msh -o no.dibs --labels-from-groups --labels a.txt");
    assert!(!both.status.success() && !folder.join("no.dibs").exists());
}
