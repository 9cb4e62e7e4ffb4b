//! The comparison of two firmwares.

// Requirement: P-12

use xtask::twice::loaded;

/// A header, one segment of four bytes, and debug information behind it.
fn program(segment: [u8; 4], debug: &[u8]) -> Vec<u8> {
    let mut file = vec![0; 84];
    file[..6].copy_from_slice(b"\x7fELF\x01\x01");
    (file[28], file[42], file[44]) = (52, 32, 1);
    (file[52], file[56], file[60], file[68]) = (1, 84, 0x40, 4);
    file.extend(segment);
    file.extend(debug);
    file
}

#[test]
fn what_is_loaded_counts() {
    let one = loaded(&program([1, 2, 3, 4], b"/one")).unwrap();
    assert_eq!(one, [0x40, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4]);
    assert_eq!(loaded(&program([1, 2, 3, 4], b"/another")).unwrap(), one);
    assert_ne!(loaded(&program([1, 2, 3, 5], b"/one")).unwrap(), one);
    assert!(loaded(b"\x7fELF\x01\x01").is_err() && loaded(&[0; 100]).is_err());
}
