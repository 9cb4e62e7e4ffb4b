//! Motions: NumPy's types, PC2 of other programs, and numbered series.

use super::{FACES, Folder, POINTS};
use crate::program::fails;
use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{Mesh, Motion, ReadErrorKind, Unit};

fn npy(descr: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (1, 4, 3), }}\n");
    let length = u16::try_from(header.len()).unwrap().to_le_bytes();
    [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), data].concat()
}

#[test]
fn every_type_of_real_numbers_is_read() {
    let folder = Folder::new();
    let numbers = || POINTS.iter().flatten().map(|&x| x as u8);
    // Halves of these whole numbers.
    let half = |x: u8| [0, 0x3c00, 0x4000, 0x4200, 0x4400, 0x4500, 0x4600][usize::from(x)];
    let points = POINTS.map(Vec3::from);
    for (descr, data) in [
        ("<f2", numbers().flat_map(|x| u16::to_le_bytes(half(x))).collect::<Vec<u8>>()),
        (">f2", numbers().flat_map(|x| u16::to_be_bytes(half(x))).collect()),
        ("|u1", numbers().collect()),
        ("|i1", numbers().collect()),
        ("<u2", numbers().flat_map(|x| u16::from(x).to_le_bytes()).collect()),
        (">u4", numbers().flat_map(|x| u32::from(x).to_be_bytes()).collect()),
        ("<u8", numbers().flat_map(|x| u64::from(x).to_le_bytes()).collect()),
    ] {
        let motion = Motion::read(folder.put("a.npy", npy(descr, &data))).unwrap();
        assert_eq!(motion.frames, [points.to_vec()], "{descr}");
    }
    let says = |name: &str, bytes: &[u8]| {
        Motion::read(folder.put(name, bytes)).unwrap_err().kind.to_string()
    };
    for descr in ["|b1", "<c8", "|O", "<f16", "<U4"] {
        assert!(says("a.npy", &npy(descr, &[])).contains("astype('float32')"), "{descr}");
    }
    assert!(says("a.npz", b"PK\x03\x04").contains("an archive (.npz)"));
    assert!(says("a.npy", b"nonsense").contains("does not begin as a NumPy array"));
    assert!(says("a.pc2", b"nonsense").contains("not a PC2 file"));
}

/// As animation tools write it: the fifth field is frames per sample.
fn pc2(sampling: f32, after: &[u8]) -> Vec<u8> {
    let mut bytes = b"POINTCACHE2\0\x01\0\0\0\x04\0\0\0\0\0\0\0".to_vec();
    bytes.extend(sampling.to_le_bytes());
    bytes.extend(2_u32.to_le_bytes());
    for _ in 0..2 {
        bytes.extend(POINTS.iter().flatten().flat_map(|x| x.to_le_bytes()));
    }
    bytes.extend(after);
    bytes
}

#[test]
fn pc2_states_no_rate_and_may_have_bytes_after_its_frames() {
    let folder = Folder::new();
    for sampling in [1.0, 0.5, 25.0] {
        for after in [&b""[..], b"\0\0", b"DIBSRATE", b"DIBSRATE\0\0\0\0", &[7; 47]] {
            let motion = Motion::read(folder.put("a.pc2", pc2(sampling, after))).unwrap();
            assert_eq!((motion.frames.len(), motion.rate), (2, 0.0));
        }
    }
    let kind = Motion::read(folder.put("a.pc2", pc2(1.0, &[7; 48]))).unwrap_err().kind;
    assert!(matches!(kind, ReadErrorKind::Count { claimed: 2, found: 3, .. }), "{kind}");
    let mesh = Mesh {
        positions: POINTS.map(Vec3::from).to_vec(),
        triangles: FACES.to_vec(),
        ..Mesh::default()
    };
    mesh.write_ply(folder.path().join("m.ply")).unwrap();
    folder.put("path.csv", "sphere:0,0,9,1\n");
    crate::program::succeeds(folder.path(), "build m.ply -o m.dibs");
    let message = fails(folder.path(), "track m.dibs --motion a.pc2 --path path.csv");
    assert!(message.contains("a.pc2"), "{message}");
    folder.put("a.pc2", pc2(1.0, b""));
    let message = fails(folder.path(), "track m.dibs --motion a.pc2 --path path.csv");
    assert!(message.contains("give --motion-rate"), "{message}");
    // This crate's own files say it, and other programs find each frame sampled.
    let motion = Motion { frames: vec![mesh.positions.clone()], rate: 30.0, ..Motion::default() };
    motion.write_pc2(folder.path().join("b.pc2")).unwrap();
    assert_eq!(Motion::read(folder.path().join("b.pc2")).unwrap(), motion);
    let bytes = std::fs::read(folder.path().join("b.pc2")).unwrap();
    assert_eq!(bytes[24..28], 1_f32.to_le_bytes());
}

#[test]
fn numbers_of_a_series_may_be_filled_with_zeros() {
    let folder = Folder::new();
    let frame = |name: &str, scale: f32| {
        let positions = POINTS.map(|p| scale * Vec3::from(p)).to_vec();
        let mesh = Mesh { positions, triangles: FACES.to_vec(), ..Mesh::default() };
        mesh.write_ply(folder.path().join(name)).unwrap();
    };
    for number in 8..12 {
        frame(&format!("a{number:04}.ply"), number as f32);
    }
    let series = |name: &str| Motion::read(folder.path().join(name));
    for name in ["a%d.ply", "a%04d.ply"] {
        let frames = series(name).unwrap().frames;
        let thirds: Vec<f32> = frames.iter().map(|frame| frame[3].z).collect();
        assert_eq!(thirds, [48.0, 54.0, 60.0, 66.0], "{name}");
    }
    for name in ["a%03d.ply", "a%05d.ply"] {
        assert!(matches!(series(name).unwrap_err().kind, ReadErrorKind::NoSeries), "{name}");
    }
    std::fs::remove_file(folder.path().join("a0010.ply")).unwrap();
    let message = series("a%d.ply").unwrap_err().to_string();
    assert!(message.contains("a0010.ply: missing in its series"), "{message}");
    frame("a10.ply", 10.0);
    assert_eq!(series("a%d.ply").unwrap().frames.len(), 4);
    frame("a9.ply", 9.0);
    let kind = series("a%d.ply").unwrap_err().kind;
    assert!(matches!(kind, ReadErrorKind::Twice), "{kind}");
}

/// A series of files that state their unit is converted once.
#[test]
fn a_series_has_the_unit_of_its_files() {
    let folder = Folder::new();
    for number in 1..3 {
        folder.put(&format!("a{number}.gltf"), super::gltf::Document::new().text());
    }
    let path = folder.path().join("a%d.gltf");
    for unit in [None, Some(Unit::Metre)] {
        let frames = Motion::read_around(&path, unit, DVec3::ZERO).unwrap().frames;
        assert_eq!(frames[1][1], Vec3::new(4000.0, 0.0, 0.0));
    }
    let kind = Motion::read_around(&path, Unit::Inch, DVec3::ZERO).unwrap_err().kind;
    assert!(matches!(kind, ReadErrorKind::OtherUnit { .. }), "{kind}");
}
