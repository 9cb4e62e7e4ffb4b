//! VTK's legacy format and its XML.

use super::{FACES, Folder, is_tetrahedron, sorted, warnings};

const HEAD: &str = "DATASET POLYDATA\nPOINTS 4 float\n0 0 0 4 0 0 0 5 0 0 0 6\nPOLYGONS 4 16\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";

fn ascii(body: &str) -> String {
    format!("# vtk DataFile Version 3.0\nx\nASCII\n{body}")
}

/// A binary file of the tetrahedron, and what follows it.
fn binary(more: &[u8]) -> Vec<u8> {
    let mut bytes =
        b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 4 float\n".to_vec();
    bytes.extend(super::POINTS.iter().flatten().flat_map(|x| x.to_be_bytes()));
    bytes.extend(b"\nPOLYGONS 4 16\n");
    let cells = FACES.iter().flat_map(|&[a, b, c]| [3, a, b, c]);
    bytes.extend(cells.flat_map(u32::to_be_bytes));
    bytes.push(b'\n');
    bytes.extend(more);
    bytes
}

/// 7, 7, 2 and 2 as 32-bit numbers.
fn labels() -> Vec<u8> {
    [7, 7, 2, 2].into_iter().flat_map(u32::to_be_bytes).collect()
}

#[test]
fn keywords_have_any_case_and_arrays_any_values() {
    let folder = Folder::new();
    let text =
        "FIELD FieldData 2\nSPACE 1 1 string\nSPACE=LPS in mm\nnote%20s 1 2 utf8_string\n\nb\n";
    for (name, text) in [
        ("plain", ascii(HEAD)),
        ("lower case", ascii(HEAD).to_lowercase()),
        ("upper case", ascii(HEAD).to_uppercase()),
        ("texts", ascii(&format!("{text}{HEAD}"))),
        (
            "odd numbers",
            ascii(&format!(
                "{HEAD}POINT_DATA 4\nSCALARS p float 1\nLOOKUP_TABLE default\n1.#QNAN nan(ind) - x\n"
            )),
        ),
    ] {
        let import = folder.read("a.vtk", text);
        is_tetrahedron(&import, 1.0, name);
        assert_eq!(warnings(&import), [""; 0], "{name}");
    }
    // Short and long texts: their length takes one, two or four bytes.
    let mut field = b"FIELD FieldData 1\nSPACE 1 4 string\n\xc9SPACE=LPS\xc0".to_vec();
    field.extend([0x80, 200].into_iter().chain([b'x'; 200]));
    field.extend([0x40, 0, 0x40, 0].into_iter().chain([b'\n'; 0x4000]));
    field.push(b'\n');
    let whole = binary(&[]);
    let at = whole.windows(7).position(|window| window == b"DATASET").unwrap();
    let bytes = [&whole[..at], &field, &whole[at..]].concat();
    is_tetrahedron(&folder.read("a.vtk", bytes), 1.0, "binary texts");
}

#[test]
fn labels_stand_among_arrays_of_any_type() {
    let folder = Folder::new();
    let bits = "SCALARS flag bit 1\nLOOKUP_TABLE default\n1 0 1 1\n";
    let texts =
        "FIELD FieldData 2\nname 1 4 string\nleft\n\nthe right\nb\nlabel 1 4 int\n7 7 2 2\n";
    let ids = "scalars label vtkIdType\nlookup_table default\n7 7 2 2\n";
    for (name, bytes) in [
        ("bits and texts", ascii(&format!("{HEAD}CELL_DATA 4\n{bits}{texts}")).into_bytes()),
        ("vtkIdType", ascii(&format!("{HEAD}cell_data 4\n{ids}")).into_bytes()),
        ("binary vtkIdType", {
            let head = b"CELL_DATA 4\nSCALARS label vtkIdType 1\nLOOKUP_TABLE default\n";
            binary(&[&head[..], &labels(), b"\n"].concat())
        }),
        ("binary bits and texts", {
            let head = b"CELL_DATA 4\nSCALARS flag bit 1\nLOOKUP_TABLE default\n\xb0\nFIELD FieldData 2\nname 1 4 string\n";
            let texts = b"\xc4left\xc0\xc1\n\xc1b\nlabel 1 4 int\n";
            binary(&[&head[..], texts, &labels(), b"\n"].concat())
        }),
    ] {
        let import = folder.read_labels("a.vtk", bytes);
        assert_eq!(import.groups.unwrap().labels, [7, 7, 2, 2], "{name}");
    }
}

fn grid(cells: &[&[u32]], types: &[u32]) -> String {
    let size: usize = cells.iter().map(|cell| cell.len() + 1).sum();
    let line = |cell: &&[u32]| {
        let numbers: Vec<String> = cell.iter().map(u32::to_string).collect();
        format!("{} {}\n", cell.len(), numbers.join(" "))
    };
    let cells: String = cells.iter().map(line).collect();
    let types: String = types.iter().map(|kind| format!("{kind}\n")).collect();
    let count = types.lines().count();
    // A cube.
    ascii(&format!(
        "DATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1\n\
         CELLS {count} {size}\n{cells}CELL_TYPES {count}\n{types}"
    ))
}

#[test]
fn cells_of_grids_are_faces_or_have_a_skin() {
    let folder = Folder::new();
    // Six sides of a cube, however its cells are made.
    for (name, cells, types) in [
        ("hexahedron", &[&[0, 1, 2, 3, 4, 5, 6, 7][..]][..], &[12][..]),
        ("inside out", &[&[4, 5, 6, 7, 0, 1, 2, 3]], &[12]),
        ("voxel", &[&[0, 1, 3, 2, 4, 5, 7, 6]], &[11]),
        ("wedges", &[&[0, 1, 2, 4, 5, 6], &[0, 3, 2, 4, 7, 6]], &[13, 13]),
        (
            "tetrahedra",
            &[&[0, 1, 3, 4], &[1, 2, 3, 6], &[1, 4, 5, 6], &[3, 4, 6, 7], &[1, 3, 4, 6]],
            &[10, 10, 10, 10, 10],
        ),
    ] {
        let import = folder.read("a.vtk", grid(cells, types));
        assert_eq!(import.mesh.triangles.len(), 12, "{name}");
        let report = &import.report;
        assert_eq!((report.border_edges, report.inconsistent_edges), (0, 0), "{name}");
        let corner = |vertex: u32| import.mesh.positions[vertex as usize].as_dvec3();
        let six_volumes: f64 = import
            .mesh
            .triangles
            .iter()
            .map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))))
            .sum();
        assert_eq!(six_volumes, 6.0, "{name}");
        assert!(warnings(&import)[0].contains("the surface is"), "{name}");
    }
    let flat = grid(&[&[0, 1, 3, 2], &[4, 5, 6, 7], &[0, 1, 4, 5], &[0, 1]], &[8, 9, 6, 3]);
    let import = folder.read("a.vtk", flat);
    assert_eq!(import.report.polygons_not_simple, 0);
    assert_eq!(import.mesh.triangles.len(), 6);
    assert!(warnings(&import)[0].contains("points and lines"), "{:?}", warnings(&import));
    // A surface of its own is the surface.
    let both = grid(&[&[0, 1, 2], &[0, 1, 2, 4], &[0; 10]], &[5, 10, 24]);
    let import = folder.read("a.vtk", both);
    assert_eq!(import.mesh.triangles, [[0, 1, 2]]);
    assert!(warnings(&import)[0].starts_with("2 volume cells were left out"));
    for (cells, kind, says) in [
        (&[0, 1, 2, 3, 4, 5][..], 22, "curved cells of the type 22"),
        (&[0; 10], 24, "volume cells with curved faces"),
        (&[0, 1, 2, 3], 42, "polyhedra of the type 42"),
        (&[0, 1, 2], 99, "cells of the type 99"),
        (&[0, 1, 2, 3], 5, "a cell of the type 5 with 4 points"),
        (&[0, 1, 2], 10, "a cell of the type 10 with 3 points"),
    ] {
        let message = folder.says("a.vtk", grid(&[cells], &[kind]));
        assert!(message.contains(says), "{message}");
    }
}

fn vtu(kind: &str, cells: &str, offsets: &str, types: &str, data: &str) -> String {
    format!(
        "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\"><{kind}>\
         <FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">82 65 83 0</Array></FieldData>\
         <Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\
         <CellData><Array type=\"String\" Name=\"name\" format=\"ascii\">82 0</Array>{data}</CellData>\
         <Points><DataArray type=\"Float64\" Name=\"p\" NumberOfComponents=\"3\" format=\"ascii\">\
         0 0 0 4 0 0 0 5 0 0 0 6</DataArray></Points><Cells>\
         <DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">{cells}</DataArray>\
         <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">{offsets}</DataArray>\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">{types}</DataArray></Cells></Piece></{kind}></VTKFile>"
    )
}

#[test]
fn grids_in_xml_are_read_as_in_the_legacy_format() {
    let folder = Folder::new();
    let kind = "UnstructuredGrid";
    let data = "<DataArray type=\"Int32\" Name=\"label\" format=\"ascii\">7 7 2 2</DataArray>";
    let faces = vtu(kind, "0 2 1 0 1 3 1 2 3 2 0 3", "3 6 9 12", "5 5 5 5", data);
    is_tetrahedron(&folder.read("a.vtu", &faces), 1.0, "faces");
    assert_eq!(folder.read_labels("a.vtu", &faces).groups.unwrap().labels, [7, 7, 2, 2]);
    let one = "<DataArray type=\"Int32\" Name=\"label\" format=\"ascii\">9</DataArray>";
    let solid = vtu(kind, "0 1 2 3", "4", "10", one);
    let import = folder.read_labels("a.vtu", &solid);
    is_tetrahedron(&import, 1.0, "volume");
    assert_eq!(import.groups.unwrap().labels, [9; 4]);
    for (text, says) in [
        (vtu(kind, "0 1 2 3", "4", "10 10", ""), "1 cells and 2 cell types"),
        (vtu("PUnstructuredGrid", "", "", "", ""), "which names other files"),
        (vtu("vtkMultiBlockDataSet", "", "", "", ""), "which names other files"),
        (vtu("ImageData", "", "", "", ""), "which is no surface"),
    ] {
        assert!(folder.says("a.vtu", &text).contains(says), "{}", folder.says("a.vtu", &text));
    }
    // Points of other numbers, and several times, would move the surface.
    let points = "NumberOfComponents=\"3\" format=\"ascii\">0 0 0 4 0 0 0 5 0 0 0 6</DataArray>";
    let again = points.replace("0 0 0 4", "1 1 1 4");
    let twice = format!("{points}<DataArray type=\"Float64\" TimeStep=\"1\" {again}");
    for (new, says) in [
        (&twice[..], "a piece of 4 points, with the arrays of 8"),
        (&points.replace("\"3\"", "\"2\""), "points of 2 coordinates"),
        (&points.replace("0 0 6", "0 0 6 9 9 9"), "a piece of 4 points, with the arrays of 5"),
        (&points.replace("0 0 6", "0 &z; 6"), "the entity 'z' among numbers"),
    ] {
        let message = folder.says("a.vtu", faces.replace(points, new));
        assert!(message.contains(says), "{message}");
    }
    let quoted = points.replace("0 0 0 4", "<![CDATA[0 0 0 4").replace("0 6<", "0 6]]><");
    is_tetrahedron(&folder.read("a.vtu", faces.replace(points, &quoted)), 1.0, "CDATA");
    // Labels that are no numbers are none, and no reason to refuse the surface.
    let text = "<DataArray type=\"String\" Name=\"label\" format=\"ascii\">x</DataArray>";
    let named = vtu(kind, "0 1 2 3", "4", "10", text);
    is_tetrahedron(&folder.read("a.vtu", &named), 1.0, "text labels");
    let pieces = solid.replace("</Piece>", "</Piece><Piece/>");
    let message = folder.says("a.vtu", pieces);
    assert!(message.contains("in several pieces") && message.contains("Extract Surface"));
    assert_eq!(sorted(&FACES), sorted(&folder.read("a.vtu", solid).mesh.triangles));
}
