//! glTF documents, each a small change of one.
//!
//! One file, because every test changes the same document.

use serde_json::{Value, json};

use super::{FACES, Folder, POINTS, is_tetrahedron, sorted, warnings};
use crate::program::{fails, json};
use dibs_build::glam::Vec3;
use dibs_build::{Import, ReadErrorKind, ReadOptions, Unit};

/// A document, and the bytes of its one buffer.
pub struct Document {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl Document {
    /// The tetrahedron in one node: positions in accessor 0, corners in accessor 1.
    pub fn new() -> Self {
        let mut document = Self { json: json!({}), bytes: Vec::new() };
        document.json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [], "bufferViews": [],
        });
        let points: Vec<u8> = POINTS.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        document.accessor(&points, 4, 5126, "VEC3");
        let corners: Vec<u8> =
            FACES.iter().flatten().flat_map(|&c| (c as u16).to_le_bytes()).collect();
        document.accessor(&corners, 12, 5123, "SCALAR");
        document
    }

    /// Adds bytes, and the view of them; returns its number.
    fn view(&mut self, bytes: &[u8]) -> usize {
        let at = self.bytes.len();
        self.bytes.extend(bytes);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 0, "byteOffset": at, "byteLength": bytes.len()}));
        views.len() - 1
    }

    /// Adds an accessor with bytes of its own; returns its number.
    fn accessor(&mut self, bytes: &[u8], count: usize, kind: u32, shape: &str) -> usize {
        let view = self.view(bytes);
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(
            json!({"bufferView": view, "componentType": kind, "count": count, "type": shape}),
        );
        accessors.len() - 1
    }

    /// Changes a part of the document.
    fn with(mut self, pointer: &str, value: Value) -> Self {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = self.json.pointer_mut(parent).unwrap();
        match parent {
            Value::Array(all) => all[key.parse::<usize>().unwrap()] = value,
            parent => parent[key] = value,
        }
        self
    }

    fn without(mut self, key: &str) -> Self {
        self.json.as_object_mut().unwrap().remove(key);
        self
    }

    /// With its bytes inside.
    pub fn text(&self) -> String {
        const DIGITS: &[u8; 64] =
            b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let mut bytes = self.bytes.clone();
        bytes.resize(bytes.len().next_multiple_of(3), 0);
        let encode = |three: &[u8]| {
            let word = three.iter().fold(0, |word, &byte| word << 8 | usize::from(byte));
            [18, 12, 6, 0].map(|shift| char::from(DIGITS[word >> shift & 63]))
        };
        let data: String = bytes.chunks(3).flat_map(encode).collect();
        self.beside(&format!("data:application/octet-stream;base64,{data}"), self.bytes.len())
    }

    /// With its bytes in a file.
    fn beside(&self, uri: &str, length: usize) -> String {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"uri": uri, "byteLength": length}]);
        json.to_string()
    }
}

#[test]
fn documents_are_in_metres_and_a_unit_counts_once() {
    let folder = Folder::new();
    let text = Document::new().text();
    let import = folder.read("a.gltf", &text);
    is_tetrahedron(&import, 1000.0, "a.gltf");
    assert_eq!(import.report.unit, Unit::Metre);
    assert_eq!(warnings(&import), [""; 0]);
    for (line, is_read) in
        [("", true), ("--unit m", true), ("--unit mm", false), ("--unit cm", false)]
    {
        let line = format!("build a.gltf -o a.dibs {line}");
        if is_read {
            json(folder.path(), &format!("{line} --json"));
        } else {
            let message = fails(folder.path(), &line);
            assert!(message.contains("its lengths are in metres, as glTF files say"), "{message}");
        }
    }
    let options = ReadOptions { unit: Some(Unit::Inch), ..Import::options() };
    let kind = options.read(folder.path().join("a.gltf")).unwrap_err().kind;
    assert!(matches!(kind, ReadErrorKind::OtherUnit { stated: Unit::Metre, .. }), "{kind}");
}

#[test]
fn every_way_to_write_positions_is_read() {
    let folder = Folder::new();
    let mut sparse = Document::new();
    let rows = sparse.view(&[3, 0]);
    let values: Vec<u8> = [0.0_f32, 0.0, 7.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let values = sparse.view(&values);
    let part = json!({"count": 1, "indices": {"bufferView": rows, "componentType": 5123},
        "values": {"bufferView": values}});
    let sparse = sparse.with("/accessors/0/sparse", part.clone());
    let import = folder.read("a.gltf", sparse.text());
    assert_eq!(import.mesh.positions[3], Vec3::new(0.0, 0.0, 7000.0));
    // Of nothing but its sparse part, all others are zero.
    let mut moves = Document { json: sparse.json.clone(), bytes: sparse.bytes.clone() };
    let all = moves.json["accessors"].as_array_mut().unwrap();
    all.push(json!({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": part}));
    all[0].as_object_mut().unwrap().remove("sparse");
    let morph = moves.with("/meshes/0/primitives/0/targets", json!([{"POSITION": 2}]));
    for (weights, height) in [
        (json!({}), 6.0),
        (json!({"mesh": [0.5]}), 9.5),
        (json!({"mesh": [0.5], "node": [-1.0]}), -1.0),
    ] {
        let mut text = Document { json: morph.json.clone(), bytes: morph.bytes.clone() };
        if let Some(own) = weights.get("mesh") {
            text = text.with("/meshes/0/weights", own.clone());
        }
        if let Some(own) = weights.get("node") {
            text = text.with("/nodes/0/weights", own.clone());
        }
        let import = folder.read("a.gltf", text.text());
        assert_eq!(import.mesh.positions[3].z, 1000.0 * height);
        assert!(warnings(&import)[0].starts_with("1 mesh has morph targets"));
    }
    // Interleaved with normals.
    let mut woven = Document::new();
    let bytes: Vec<u8> = POINTS
        .iter()
        .flat_map(|p| p.iter().chain(&[9.0; 3]))
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let view = woven.view(&bytes);
    let woven = woven.with("/accessors/0/bufferView", json!(view));
    let woven = woven.with(&format!("/bufferViews/{view}/byteStride"), json!(24));
    is_tetrahedron(&folder.read("a.gltf", woven.text()), 1000.0, "interleaved");
    // Quantised: bytes in steps of four, and shares of 32767.
    let mut packed = Document::new();
    let bytes: Vec<u8> =
        POINTS.iter().flat_map(|p| [p[0] as u8, p[1] as u8, p[2] as u8, 0]).collect();
    let view = packed.view(&bytes);
    let packed = packed.with("/accessors/0/bufferView", json!(view));
    let packed = packed.with("/accessors/0/componentType", json!(5121));
    let packed = packed.with(&format!("/bufferViews/{view}/byteStride"), json!(4));
    let packed = packed.with("/extensionsRequired", json!(["KHR_mesh_quantization"]));
    is_tetrahedron(&folder.read("a.gltf", packed.text()), 1000.0, "quantised");
    let mut shares = Document::new();
    let bytes: Vec<u8> = [[0; 3], [i16::MAX, 0, 0], [0, i16::MAX, 0], [0, 0, i16::MIN]]
        .iter()
        .flat_map(|p| p.iter().chain(&[0]))
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let view = shares.view(&bytes);
    let shares = shares.with("/accessors/0/bufferView", json!(view));
    let shares = shares.with("/accessors/0/componentType", json!(5122));
    let shares = shares.with("/accessors/0/normalized", json!(true));
    let shares = shares.with(&format!("/bufferViews/{view}/byteStride"), json!(8));
    let positions = folder.read("a.gltf", shares.text()).mesh.positions;
    assert_eq!(positions[1..], [Vec3::X, Vec3::Y, -Vec3::Z].map(|p| 1000.0 * p));
}

#[test]
fn scenes_nodes_and_files_may_be_written_in_every_way() {
    let folder = Folder::new();
    for (name, document) in [
        ("no scene", Document::new().without("scene").without("scenes")),
        ("no default scene", Document::new().without("scene")),
        ("no node", Document::new().without("scene").without("scenes").without("nodes")),
        (
            "no scene, and a parent",
            Document::new()
                .without("scenes")
                .without("scene")
                .with("/nodes", json!([{"mesh": 0}, {"children": [0]}])),
        ),
    ] {
        is_tetrahedron(&folder.read("a.gltf", document.text()), 1000.0, name);
    }
    let text = Document::new().text();
    for (name, text) in [
        ("a mark", format!("\u{feff}{text}")),
        ("space", format!(" \n{text}\n")),
        ("a final zero", format!("{text}\0")),
    ] {
        is_tetrahedron(&folder.read("a.gltf", text), 1000.0, name);
    }
    let document = Document::new();
    folder.put("left lung ä.bin", &document.bytes);
    folder.put("100%.bin", &document.bytes);
    for uri in ["left%20lung%20%C3%A4.bin", "left lung ä.bin", "100%.bin", "100%25.bin"] {
        let import = folder.read("a.gltf", document.beside(uri, document.bytes.len()));
        is_tetrahedron(&import, 1000.0, uri);
    }
    let placed = Document::new()
        .with("/nodes/0", json!({"children": [1], "translation": [1, 2, 3], "scale": [2, 2, 2]}));
    let mut placed = placed;
    placed.json["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0, "translation": [0, 0, 1]}));
    let positions = folder.read("a.gltf", placed.text()).mesh.positions;
    assert_eq!(positions[1], Vec3::new(9000.0, 2000.0, 5000.0));
}

#[test]
fn what_is_left_out_is_named() {
    let folder = Folder::new();
    let mut others = Document::new();
    others.json["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0}));
    let lines = json!([{"attributes": {"POSITION": 0}, "indices": 1},
        {"attributes": {"POSITION": 0}, "mode": 1}]);
    let unplaced = json!([{"attributes": {"POSITION": 0}, "indices": 1},
        {"attributes": {"NORMAL": 0}, "indices": 1}]);
    let mut cut = Document::new();
    let corners: Vec<u8> = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3, 0, 1].map(|c| [c, 0]).concat();
    let corners = cut.accessor(&corners, 14, 5123, "SCALAR");
    let cut = cut.with("/meshes/0/primitives/0/indices", json!(corners));
    let instanced = json!({"EXT_mesh_gpu_instancing": {"attributes": {}}});
    for (document, says) in [
        (others, "1 mesh was left out: it is not in the default scene"),
        (Document::new().with("/meshes/0/primitives", lines), "1 part of a mesh was left out"),
        (Document::new().with("/meshes/0/primitives", unplaced), "it has no positions"),
        (cut, "2 corners were left out: they make no whole triangle"),
        (Document::new().with("/animations", json!([{}, {}])), "2 animations were left out"),
        (Document::new().with("/nodes/0/extensions", instanced), "placed several times"),
    ] {
        let import = folder.read("a.gltf", document.text());
        is_tetrahedron(&import, 1000.0, says);
        let found = warnings(&import);
        assert!(found.len() == 1 && found[0].contains(says), "{found:?}");
    }
}

/// Readers differ on quaternions of another length and on matrices with a perspective, by the size of the surface.
#[test]
fn placements_that_are_none_are_refused() {
    let folder = Folder::new();
    let place = |key: &str, value: Value| Document::new().with(&format!("/nodes/0/{key}"), value);
    for rotation in [json!([0, 0, 1, 1]), json!([0, 0, 0, 0]), json!([0, 0, 0.5, 0.5])] {
        let message = folder.says("a.gltf", place("rotation", rotation).text());
        assert!(message.contains("node 0 has a rotation that is no unit quaternion"), "{message}");
    }
    let matrix = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 2]);
    let message = folder.says("a.gltf", place("matrix", matrix).text());
    assert!(message.contains("node 0 has a matrix whose last row is not"), "{message}");
    // A quaternion of a few digits turns, and does not scale.
    let turned = folder.read("a.gltf", place("rotation", json!([0, 0, 0.71, 0.71])).text());
    let [x, y] = [turned.mesh.positions[1], turned.mesh.positions[2]];
    assert!(x.distance(Vec3::new(0.0, 4000.0, 0.0)) < 1e-3, "{x}");
    assert!(y.distance(Vec3::new(-5000.0, 0.0, 0.0)) < 1e-3, "{y}");
}

/// A file may place a mesh often, but no file becomes more than ten of its size.
#[test]
fn copies_are_bounded_by_the_size_of_the_file() {
    let folder = Folder::new();
    let copies = |count: usize| {
        let nodes: Vec<Value> =
            (0..count).map(|n| json!({"mesh": 0, "translation": [9 * n, 0, 0]})).collect();
        let top: Vec<usize> = (0..count).collect();
        Document::new().with("/nodes", json!(nodes)).with("/scenes/0/nodes", json!(top))
    };
    assert_eq!(folder.read("a.gltf", copies(40).text()).mesh.triangles.len(), 160);
    let many = copies(40);
    let primitive = many.json["meshes"][0]["primitives"][0].clone();
    let many = many.with("/meshes/0/primitives", json!(vec![primitive; 100]));
    assert!(folder.says("a.gltf", many.text()).contains("too many copies of its meshes"));
}

#[test]
fn what_cannot_be_read_is_refused_by_name() {
    let folder = Folder::new();
    let required = |name: &str| Document::new().with("/extensionsRequired", json!([name])).text();
    let mut draco = Document::new().with(
        "/meshes/0/primitives/0/extensions",
        json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}),
    );
    draco.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let meshopt = json!({"EXT_meshopt_compression": {"buffer": 0}});
    let old = |version: u32| {
        let header = [u32::from_le_bytes(*b"glTF"), version, 24, 4, 0];
        header.iter().flat_map(|word| word.to_le_bytes()).chain(*b"{}  ").collect::<Vec<u8>>()
    };
    let packed = "export it without compression";
    for (bytes, says) in [
        (
            required("EXT_mesh_gpu_instancing").into_bytes(),
            "requires the extension EXT_mesh_gpu_instancing",
        ),
        (required("KHR_draco_mesh_compression").into_bytes(), packed),
        (draco.text().into_bytes(), packed),
        (Document::new().with("/bufferViews/0/extensions", meshopt).text().into_bytes(), packed),
        (
            br#"{"asset": {"version": "1.0"}, "scene": "s", "nodes": {}}"#.to_vec(),
            "glTF of version 1.0",
        ),
        (old(1), "glTF of version 1"),
        (Document::new().with("/scene", json!(3)).text().into_bytes(), "scene 3 is not there"),
        (
            Document::new().with("/accessors/0/count", json!(5)).text().into_bytes(),
            "beyond its buffer",
        ),
        (
            Document::new().with("/accessors/0/componentType", json!(5125)).text().into_bytes(),
            "type of numbers",
        ),
    ] {
        let message = folder.says("a.gltf", bytes);
        assert!(message.contains(says), "{message}");
    }
    // Textures and the like change no position.
    for name in ["KHR_materials_unlit", "KHR_texture_transform", "EXT_texture_webp"] {
        is_tetrahedron(&folder.read("a.gltf", required(name)), 1000.0, name);
    }
}

/// A document of a few hundred bytes takes no more memory than its files have.
#[test]
fn buffers_are_read_as_far_as_they_are_stated_and_there() {
    let folder = Folder::new();
    let document = Document::new();
    let length = document.bytes.len();
    let mut long = document.bytes.clone();
    long.resize(64 << 20, 1);
    folder.put("long.bin", &long);
    is_tetrahedron(&folder.read("a.gltf", document.beside("long.bin", length)), 1000.0, "long.bin");
    folder.put("short.bin", &document.bytes[..length - 1]);
    let message = folder.says("a.gltf", document.beside("short.bin", length));
    assert!(
        message.contains(&format!("{} bytes, and {length} are stated", length - 1)),
        "{message}"
    );
    let message = folder.says("a.gltf", document.beside("short.bin", usize::MAX));
    assert!(message.contains("are stated"), "{message}");
    // Many buffers of one file are read once.
    let mut many = document.json.clone();
    many["buffers"] =
        (0..10_000).map(|_| json!({"uri": "long.bin", "byteLength": 64 << 20})).collect();
    is_tetrahedron(&folder.read("a.gltf", many.to_string()), 1000.0, "many");
    // A number that no file holds.
    let mut zeros = Document::new().with("/accessors/0/count", json!(4_000_000_000_u32));
    zeros.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let message = folder.says("a.gltf", zeros.text());
    assert!(message.contains("claims 4000000000 elements in accessor 0"), "{message}");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("/dev/zero", folder.path().join("zero.bin")).unwrap();
        let made = std::process::Command::new("mkfifo")
            .arg(folder.path().join("pipe.bin"))
            .status()
            .unwrap();
        assert!(made.success());
        for name in ["zero.bin", "pipe.bin"] {
            let message = folder.says("a.gltf", document.beside(name, length));
            assert!(message.contains("pipe or a device"), "{message}");
        }
    }
    for elsewhere in
        ["%2e%2e/a.bin", "a/%2e%2e/%2e%2e/b.bin", "%2Fdev%2Fzero", "file:///dev/zero", ""]
    {
        let message = folder.says("a.gltf", document.beside(elsewhere, length));
        assert!(
            message.contains("no file beside it") || message.contains("cannot be read"),
            "{elsewhere}: {message}"
        );
    }
    assert_eq!(sorted(&FACES).len(), 4);
}

/// The joints place a mesh with a skin, by their weights and from their places at its binding; its node does not.
#[test]
fn skins_have_their_default_pose() {
    let folder = Folder::new();
    let mut document = Document::new();
    let of = document.accessor(&[[0, 1, 0, 0]; 4].concat(), 4, 5121, "VEC4");
    // The last point goes halfway with the second joint; shares of 255 need not add up to one.
    let weights = [[255, 0, 0, 0], [255, 0, 0, 0], [255, 0, 0, 0], [100, 100, 0, 0]].concat();
    let weights = document.accessor(&weights, 4, 5121, "VEC4");
    let unit =
        |x: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, 0.0, 0.0, 1.0];
    let bind: Vec<u8> =
        [unit(-5.0), unit(0.0)].as_flattened().iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
    let bind = document.accessor(&bind, 2, 5126, "MAT4");
    let attributes = json!({"POSITION": 0, "JOINTS_0": of, "WEIGHTS_0": weights});
    let document = document
        .with(&format!("/accessors/{weights}/normalized"), json!(true))
        .with("/meshes/0/primitives/0/attributes", attributes)
        .with("/skins", json!([{"joints": [1, 2], "inverseBindMatrices": bind}]))
        .with("/scenes/0/nodes", json!([0, 1]))
        .with(
            "/nodes",
            json!([
                {"mesh": 0, "skin": 0, "translation": [9, 9, 9]},
                {"children": [2], "translation": [5, 0, 1]},
                {"translation": [-5, 0, 2]},
            ]),
        );
    let import = folder.read("a.gltf", document.text());
    // The first joint moved by 1 along z from its binding, the second by 3.
    let expected = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 5.0, 1.0], [0.0, 0.0, 8.0]];
    assert_eq!(import.mesh.positions, expected.map(|p| 1000.0 * Vec3::from(p)));
    assert!(warnings(&import)[0].starts_with("1 mesh has a skin: it was read in the default pose"));
    let message = folder.says("a.gltf", document.with("/skins/0/joints", json!([1])).text());
    assert!(message.contains("joint 1 is not there"), "{message}");
}
