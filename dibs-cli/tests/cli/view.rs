//! The page that `dibs view` writes. Its contents are tested where they are read: `viewer/test/`.

// Requirement: P-09

use std::fs;
use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use crate::program::{fails, succeeds};

#[test]
fn a_page_is_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o <i>.dibs --stretch 2");
    fs::write(folder.join("page.html"), "<p>before</p><!--data--><p>after</p>").unwrap();
    fs::write(folder.join("tools.csv"), "sphere:-0,0.1,90,2\ncapsule:0,0,90,0,0,120,2.5\n")
        .unwrap();

    let view = "view <i>.dibs --motion heart.pc2 --page page.html -o out.html";
    assert!(succeeds(folder, &format!("{view} --path tools.csv")).starts_with("written  out.html"));
    let page = fs::read_to_string(folder.join("out.html")).unwrap();
    assert!(page.starts_with("<p>before</p><script") && page.ends_with("</script>\n<p>after</p>"));
    let sphere = [4.0, -0.0, 0.1, 90.0, 2.0];
    let capsule = [7.0, 0.0, 0.0, 90.0, 0.0, 0.0, 120.0, 2.5];
    let packed = [&sphere[..], &capsule].concat();
    assert_eq!(
        element(&page, "path"),
        packed.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>()
    );
    assert!(page.contains(r#""frames":25"#) && page.contains(r#""rate":30.0"#));
    assert!(page.contains("\\u003ci>.dibs") && !page.contains("<i>"), "a name ends no element");

    assert!(page.contains(r#""name":"\u003ci>.dibs""#), "the title is the file's name");
    assert!(element(&page, "commanded").is_empty() && element(&page, "ticks").is_empty());

    fs::remove_file(folder.join("out.html")).unwrap();
    let error = fails(folder, "view <i>.dibs --page absent.html -o out.html");
    assert!(error.contains("absent.html") && error.contains("cargo xtask viewer"), "{error}");
    let error = fails(folder, "view <i>.dibs --page tools.csv -o out.html");
    assert!(error.contains("tools.csv") && error.contains("cargo xtask viewer"), "{error}");
    let error = fails(folder, &format!("{view} --motion-rate 0"));
    assert!(error.contains("--motion-rate"), "{error}");
    fs::write(folder.join("tools.csv"), "sphere:0,0,90,2\nsphere:0,0\n").unwrap();
    let error = fails(folder, &format!("{view} --path tools.csv"));
    assert!(error.contains("tools.csv, line 2"), "{error}");
    succeeds(folder, "build heart.ply -o tight.dibs --stretch 1.01");
    let error = fails(folder, "view tight.dibs --motion heart.pc2 --page page.html -o out.html");
    assert!(error.contains("frame ") && error.contains("--stretch"), "{error}");
    assert!(!folder.join("out.html").exists());
}

/// What a filter printed: the instrument goes where it was admitted.
#[test]
fn a_record_of_ticks_is_beside_the_path() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs --stretch 2");
    fs::write(folder.join("page.html"), "<!--data-->").unwrap();
    fs::write(folder.join("tools.csv"), "sphere:0,0,140,2\nsphere:0,0,139,2\nsphere:0,0,0,2\n")
        .unwrap();
    let filter = "filter heart.dibs --motion heart.pc2 --path tools.csv --stand-off 1 --json";
    let ticks = succeeds(folder, filter);
    fs::write(folder.join("ticks.jsonl"), &ticks).unwrap();
    let view = "view heart.dibs --motion heart.pc2 --page page.html --path tools.csv --ticks ticks.jsonl -o out.html";
    succeeds(folder, view);
    let page = fs::read_to_string(folder.join("out.html")).unwrap();
    let numbers = |id: &str| -> Vec<f32> {
        let bytes = element(&page, id);
        bytes.chunks(4).map(|word| f32::from_le_bytes(word.try_into().unwrap())).collect()
    };
    assert_eq!(numbers("commanded")[10..], [4.0, 0.0, 0.0, 0.0, 2.0]);
    let (path, ticks_shown) = (numbers("path"), numbers("ticks"));
    assert!(path[..5] == [4.0, 0.0, 0.0, 140.0, 2.0] && path[11..14] != [0.0; 3], "{path:?}");
    // The count of a tick's numbers, its reason, its least separation, and no energy.
    assert!(
        ticks_shown[0] == 3.0 && ticks_shown[1] == 0.0 && ticks_shown[2] > 1.0,
        "{ticks_shown:?}"
    );
    assert!(ticks_shown[9] == 1.0 && ticks_shown[3].is_nan(), "{ticks_shown:?}");
    assert!(page.contains(r#""reasons":["commanded","#), "{page}");

    fs::remove_file(folder.join("out.html")).unwrap();
    let lines: Vec<&str> = ticks.lines().collect();
    for (wrong, said) in [
        (lines[..2].join("\n"), "2 ticks, but --path has 3"),
        (lines[1..].join("\n"), "line 1: tick 1 in the place of tick 0"),
        (lines.join("\n").replacen("capsule", "cone", 1).replacen("sphere", "cone", 1), "line 1: "),
        (format!("{{}}\n{}\n{}", lines[1], lines[2]), "2 of 3 ticks have an admitted pose"),
        ("0 1.5 commanded".to_owned(), "`dibs filter --json`"),
    ] {
        fs::write(folder.join("ticks.jsonl"), wrong).unwrap();
        let error = fails(folder, view);
        assert!(error.contains("ticks.jsonl") && error.contains(said), "{said}: {error}");
    }
    assert!(!folder.join("out.html").exists());
}

/// The bytes in a page's element.
fn element(page: &str, id: &str) -> Vec<u8> {
    let (_, rest) = page.split_once(&format!("id=\"{id}\">")).unwrap();
    let (text, _) = rest.split_once('<').unwrap();
    let mut bytes = Vec::new();
    ZlibDecoder::new(STANDARD.decode(text).unwrap().as_slice()).read_to_end(&mut bytes).unwrap();
    bytes
}
