//! The README's programs compile, and its first one gives the right answer.

// Requirements: P-06, P-11

use std::path::Path;
use std::process::Command;
use std::{env, fs};

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Index, Interval, Options, Query, Sphere, Tree, measure_stretch};

use crate::programs::{include, library, library_with, run, tool};

/// In place of the loop over the rest shape: moved vertices of a file, in its order.
const MOVED: &str = r#"
    static float positions[3 * 65536];
    FILE *moved = fopen("moved", "rb");
    const uint32_t vertices = (uint32_t)fread(positions, 12, 65536, moved);
    dibs_tree_facts facts;
    TRY(dibs_tree_to_rows(tree, positions, vertices, &rows->x, 65536));
    TRY(dibs_tree_get_facts(tree, &facts));
    count = facts.vertices;
"#;

/// The same in C++.
const MOVED_CPP: &str = r#"
    (void)at;
    std::ifstream other("moved", std::ios::binary);
    const std::vector<char> moved{std::istreambuf_iterator<char>(other), {}};
    std::vector<float> room(moved.size() / 4);
    dibs::Span<float> span;
    const dibs::Span<const float> positions(reinterpret_cast<const float *>(moved.data()), room.size());
    if (code == DIBS_CODE_OK) code = tree.to_rows(positions, room, span);
    rows.assign(span.data(), span.data() + span.size());
"#;

/// The README's programs in a language.
fn programs(language: &str) -> Vec<String> {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let readme = fs::read_to_string(readme).expect("the README");
    let fence = format!("```{language}\n");
    let blocks = readme.split(&fence).skip(1).filter_map(|block| block.split("```").next());
    blocks.map(str::to_owned).collect()
}

/// The README's first program prints the Rust library's answers about a sphere, at rest and with moved vertices.
fn first_answers<I: Index>(mesh: &Mesh, library: &Path, language: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let built = Builder::new().stretch(1.5).build(mesh).expect("a tree");
    fs::write(folder.path().join("heart.dibs"), built.blob()).expect("writable");
    let first = programs(language)[0].replace("65536", "99999");
    let start = first.find("    while (dibs_tree_rest_position").expect("the loop");
    let end = start + first[start..].find('\n').expect("a line");
    let moved = if language == "c" { MOVED } else { MOVED_CPP }.replace("65536", "99999");
    let moved = format!("{}{moved}{}", &first[..start], &first[end..]);
    let [at_rest, moved] = [("rest", first), ("moving", moved)]
        .map(|(name, source)| compiled(folder.path(), name, &source, library, language));
    assert_eq!(at_rest(), expected::<I>(&built, &mesh.positions), "{language}");

    let write = |positions: &[Vec3]| {
        let floats = positions.iter().flat_map(Vec3::to_array);
        let bytes = floats.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
        fs::write(folder.path().join("moved"), bytes).expect("writable");
    };
    let mut positions: Vec<Vec3> = mesh.positions.iter().map(|&at| at * 1.1).collect();
    write(&positions);
    assert_eq!(moved(), expected::<I>(&built, &positions), "{language}");
    write(&positions[1..]);
    assert_eq!(moved(), "the surface has another number of vertices than the tree\n", "{language}");
    // An order that is not the file's.
    positions.rotate_left(1);
    write(&positions);
    assert_eq!(moved(), "a triangle or tetrahedron is stretched beyond its limit\n", "{language}");
}

/// A program, which says something about the files in its folder.
fn compiled(
    folder: &Path,
    name: &str,
    source: &str,
    library: &Path,
    language: &str,
) -> impl Fn() -> String + use<> {
    let (compiler, standard) =
        if language == "c" { ("gcc", "-std=c11") } else { ("g++", "-std=c++17") };
    let program = folder.join(name);
    let file = program.with_extension(language);
    fs::write(&file, source).expect("writable");
    let mut gcc = tool(compiler, compiler);
    gcc.args([standard, "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    run(gcc.arg(&file).arg(library).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    let folder = folder.to_owned();
    move || {
        let mut command = Command::new(&program);
        let output = command.current_dir(&folder).output().expect("it starts");
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(error, "");
        String::from_utf8(output.stdout).expect("text")
    }
}

/// What the library in Rust answers about the program's sphere.
fn expected<I: Index>(built: &BuiltTree, positions: &[Vec3]) -> String {
    let tree = Tree::<I>::from_bytes(built.blob()).expect("a tree");
    let rows = built.to_rows(positions);
    let stretch = measure_stretch(&tree, rows.as_slice()).expect("within the limit");
    let mut query = Query::<I, 512>::new(&tree).expect("a stack");
    let sphere = Sphere::new(Vec3::new(90.0, 10.0, 20.0), 5.0).expect("a tool");
    let options = Options::new().stretch(stretch);
    let found = query.closest(rows.as_slice(), &sphere, &options).expect("an answer");
    let Interval { lower, upper, .. } = found.interval();
    let separation = found.separation;
    format!("{separation:.4} mm from the tool's surface, in truth {lower:.4} to {upper:.4}\n")
}

/// A generated heart whose vertices are in another order, with one of no triangle.
pub fn shuffled(triangles: u32) -> Mesh {
    let heart = generate::heart(triangles).expect("a size").mesh;
    let count = heart.positions.len() as u32;
    let turned = |vertex: u32| (vertex * 7 + 3) % count;
    assert_ne!(count % 7, 0, "each number once");
    let mut mesh = heart.clone();
    for (vertex, at) in (0..).zip(&heart.positions) {
        mesh.positions[turned(vertex) as usize] = *at;
    }
    mesh.triangles = heart.triangles.iter().map(|corners| corners.map(turned)).collect();
    mesh.positions.push(heart.positions[0]);
    mesh
}

#[test]
fn the_first_program_gives_the_right_answer() {
    for language in ["c", "cpp"] {
        first_answers::<u16>(&shuffled(1_000), &library(), language);
    }
}

/// The library of another feature is compiled for this alone.
#[test]
fn a_large_tree_is_answered_by_the_library_for_large_trees() {
    if env::var_os("DIBS_WHOLE").is_none() {
        println!("skipped: on request, `cargo xtask test --whole`");
        return;
    }
    first_answers::<u32>(&shuffled(140_000), &library_with("large"), "c");
}

/// One after the other, without a warning.
#[test]
fn the_readme_compiles() {
    let folder = tempfile::tempdir().expect("a folder");
    let blocks = programs("c");
    assert!(blocks.len() >= 3, "{} programs", blocks.len());
    let source = folder.path().join("readme.c");
    fs::write(&source, blocks.concat()).expect("writable");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I"]).arg(include());
    run(gcc.arg(source));
}
