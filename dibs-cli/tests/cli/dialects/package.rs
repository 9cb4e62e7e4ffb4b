//! 3MF packages: of one model, and of several.

use super::{Folder, is_tetrahedron, warnings};
use crate::program::fails;
use dibs_build::Unit;
use dibs_build::glam::Vec3;

/// An archive whose files are stored as they are.
fn archive(files: &[(&str, &str)]) -> Vec<u8> {
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, text) in files {
        let at = bytes.len() as u32;
        let size = (text.len() as u32).to_le_bytes();
        let common = [
            &[20, 0, 0, 0, 0, 0, 0, 0, 0, 0][..],
            &sum.checksum(text.as_bytes()).to_le_bytes(),
            &size,
            &size,
            &(name.len() as u16).to_le_bytes(),
            &[0, 0],
        ]
        .concat();
        bytes.extend([b"PK\x03\x04", &common[..], name.as_bytes(), text.as_bytes()].concat());
        directory.extend(
            [b"PK\x01\x02\x14\0", &common[..], &[0; 10], &at.to_le_bytes(), name.as_bytes()]
                .concat(),
        );
    }
    let count = (files.len() as u16).to_le_bytes();
    let (size, at) = ((directory.len() as u32).to_le_bytes(), (bytes.len() as u32).to_le_bytes());
    bytes.extend(directory);
    bytes.extend([b"PK\x05\x06\0\0\0\0", &count[..], &count, &size, &at, &[0, 0]].concat());
    bytes
}

const MESH: &str = "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"4\" y=\"0\" z=\"0\"/>\
    <vertex x=\"0\" y=\"5\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"6\"/></vertices><triangles>\
    <triangle v1=\"0\" v2=\"2\" v3=\"1\"/><triangle v1=\"0\" v2=\"1\" v3=\"3\"/>\
    <triangle v1=\"1\" v2=\"2\" v3=\"3\"/><triangle v1=\"2\" v2=\"0\" v3=\"3\"/></triangles></mesh>";

fn model(attributes: &str, resources: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?><model {attributes} xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" \
         xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" \
         xmlns:b=\"http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02\">\
         <resources>{resources}</resources><build>{build}</build></model>"
    )
}

const RELATIONS: &str = "<Relationships><Relationship Target=\"/Metadata/thumbnail.png\" Id=\"r0\" Type=\"http://x/thumbnail\"/>\
    <Relationship Target=\"/3D/first.model\" Id=\"r1\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>\
    </Relationships>";

#[test]
fn objects_may_be_in_models_of_their_own() {
    let folder = Folder::new();
    let part = model("unit=\"millimeter\"", &format!("<object id=\"1\">{MESH}</object>"), "");
    let first = |component: &str, build: &str| {
        let resources = format!("<object id=\"8\"><components>{component}</components></object>");
        model("unit=\"millimeter\" requiredextensions=\"p\"", &resources, build)
    };
    let component = "<component p:path=\"/3D/Objects/part.model\" objectid=\"1\"/>";
    let item = "<item objectid=\"8\"/>";
    for (name, root) in [
        ("a component", first(component, item)),
        ("an item", first("", "<item objectid=\"1\" p:path=\"/3D/Objects/part.model\"/>")),
        ("another prefix", first(component, item).replace("p:path", "q:path")),
    ] {
        let bytes = archive(&[
            ("3D/Objects/part.model", &part),
            ("_rels/.rels", RELATIONS),
            ("3D/first.model", &root),
        ]);
        let import = folder.read("a.3mf", bytes);
        is_tetrahedron(&import, 1.0, name);
        assert_eq!(warnings(&import), [""; 0], "{name}");
    }
    // Each model has its unit, and a place counts in that of the model that states it.
    let mixed = archive(&[
        ("_rels/.rels", RELATIONS),
        (
            "3D/first.model",
            &first(&component.replace("/>", " transform=\"1 0 0 0 1 0 0 0 1 1 2 3\"/>"), item)
                .replace("millimeter", "inch"),
        ),
        ("3D/Objects/part.model", &part.replace("millimeter", "centimeter")),
    ]);
    let import = folder.read("a.3mf", mixed);
    let moved = Vec3::new(25.4 + 40.0, 50.8, 76.2);
    assert!(import.mesh.positions[1].distance(moved) < 1e-4, "{}", import.mesh.positions[1]);
    let message = fails(folder.path(), "build a.3mf -o a.dibs --unit m");
    assert!(message.contains("its lengths are in inches, as 3MF files say"), "{message}");
    for (root, says) in [
        (
            first("<component p:path=\"/3D/none.model\" objectid=\"1\"/>", item),
            "the part '3D/none.model' is not in the package",
        ),
        (first(&component.replace("\"1\"", "\"2\""), item), "object 2 is not there"),
        (first("<component objectid=\"8\"/>", item), "or one in itself"),
        (first(component, ""), "its build names no object"),
    ] {
        let bytes = archive(&[
            ("_rels/.rels", RELATIONS),
            ("3D/first.model", &root),
            ("3D/Objects/part.model", &part),
        ]);
        let message = folder.says("a.3mf", bytes);
        assert!(message.contains(says), "{message}");
    }
    let message = folder.says("a.3mf", archive(&[("3D/a.model", &part), ("3D/b.model", &part)]));
    assert!(message.contains("2 models, of which no relation names the first"), "{message}");
}

#[test]
fn units_are_stated_and_what_is_left_out_is_named() {
    let folder = Folder::new();
    let one = |attributes: &str, more: &str| {
        let resources = format!("<object id=\"1\">{MESH}</object>{more}");
        archive(&[("3D/3dmodel.model", &model(attributes, &resources, "<item objectid=\"1\"/>"))])
    };
    for (name, unit, scale) in [
        ("micron", Unit::Micrometre, 0.001),
        ("millimeter", Unit::Millimetre, 1.0),
        ("centimeter", Unit::Centimetre, 10.0),
        ("inch", Unit::Inch, 25.4),
        ("foot", Unit::Inch, 304.8),
        ("meter", Unit::Metre, 1000.0),
    ] {
        let import = folder.read("a.3mf", one(&format!("unit=\"{name}\""), ""));
        is_tetrahedron(&import, scale, name);
        assert_eq!(import.report.unit, unit, "{name}");
    }
    let lattice = "<object id=\"2\"><mesh><vertices/><b:beamlattice/></mesh></object>";
    let found = warnings(&folder.read("a.3mf", one("", lattice)));
    assert!(found[0].starts_with("1 element of an extension was left out"), "{found:?}");
    let spare = format!("<object id=\"2\">{MESH}</object>");
    let found = warnings(&folder.read("a.3mf", one("", &spare)));
    assert!(found[0].contains("not in the build"), "{found:?}");
    let message = folder.says("a.3mf", one("requiredextensions=\"p b\"", ""));
    assert!(message.contains("beamlattice") && message.contains("as PLY"), "{message}");
    assert!(folder.says("a.3mf", one("unit=\"furlong\"", "")).contains("the unit 'furlong'"));
    let support = format!("<object id=\"2\" type=\"support\">{MESH}</object>");
    let resources = format!("<object id=\"1\">{MESH}</object>{support}");
    let build = "<item objectid=\"1\"/><item objectid=\"2\"/>";
    let import = folder.read("a.3mf", archive(&[("3D/a.model", &model("", &resources, build))]));
    is_tetrahedron(&import, 1.0, "support");
    assert!(warnings(&import)[0].contains("type for supports"));
}

/// Slicers note in files of their own which parts are no surface.
#[test]
fn parts_for_a_slicer_are_named() {
    let folder = Folder::new();
    let resources = format!("<object id=\"1\">{MESH}</object>");
    let model = model("", &resources, "<item objectid=\"1\"/>");
    let noted = |path: &str, config: &str| {
        let bytes = archive(&[("3D/3dmodel.model", &model), (path, config)]);
        let import = folder.read("a.3mf", bytes);
        is_tetrahedron(&import, 1.0, path);
        warnings(&import)
    };
    let bambu = "Metadata/model_settings.config";
    let part = |kind: &str| {
        format!(
            "<config><object id=\"1\"><part id=\"1\" subtype=\"{kind}\"></part></object></config>"
        )
    };
    assert_eq!(noted(bambu, &part("normal_part")), [""; 0]);
    for kind in ["negative_part", "modifier_part", "support_blocker"] {
        assert!(noted(bambu, &part(kind))[0].starts_with("1 part was read as surface"), "{kind}");
    }
    let prusa = "Metadata/Slic3r_PE_model.config";
    let volume =
        |kind: &str| format!("<config><metadata key=\"volume_type\" value=\"{kind}\"/></config>");
    assert_eq!(noted(prusa, &volume("ModelPart")), [""; 0]);
    assert!(noted(prusa, &volume("NegativeVolume"))[0].contains("a slicer takes it away"));
}

/// A build may place an object often, but no file becomes more than ten of its size.
#[test]
fn copies_are_bounded_by_the_size_of_the_file() {
    let folder = Folder::new();
    let copies = |count: usize, object: &str| {
        let item =
            |n| format!("<item objectid=\"{object}\" transform=\"1 0 0 0 1 0 0 0 1 {n} 0 0\"/>");
        let items: String = (0..count).map(|n| item(9 * n)).collect();
        let parts = |of: &str| format!("<component objectid=\"{of}\"/>").repeat(10);
        let resources = format!(
            "<object id=\"1\">{MESH}</object><object id=\"2\"><components>{}</components></object>\
             <object id=\"3\"><components>{}</components></object>",
            parts("1"),
            parts("2")
        );
        archive(&[("3D/a.model", &model("", &resources, &items))])
    };
    assert_eq!(folder.read("a.3mf", copies(20, "1")).mesh.triangles.len(), 80);
    assert!(folder.says("a.3mf", copies(40, "3")).contains("too many copies of its objects"));
}
