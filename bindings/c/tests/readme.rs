//! The README's programs compile, and its first one gives the right answer.

// Requirements: P-06, P-11

use std::path::Path;
use std::process::Command;
use std::{env, fs};

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Index, Interval, Options, Query, Sphere, Tree, measure_stretch};

use crate::programs::{include, library, library_with, run, tool};

/// Reads a tree and positions in the file's order, and asks the README's function about a sphere.
const MAIN: &str = r#"
#include "expect.h"
int main(int argc, char **argv) {
    size_t length, size;
    const unsigned char *tree = read_file(argv[argc - 2], &length);
    float *positions = (float *)(void *)read_file(argv[argc - 1], &size);
    const dibs_tool sphere = {{90, 10, 20}, {90, 10, 20}, 5};
    EXPECT(OK, distance(tree, length, positions, size / 12, &sphere));
    EXPECT(VERTEX_COUNT, distance(tree, length, positions, size / 12 - 1, &sphere));
    /* Positions in an order that is not the rows'. */
    float *other = malloc(size);
    for (size_t at = 0; at < size / 4; at++) other[at] = positions[(at + 3) % (size / 4)];
    EXPECT(STRETCH_EXCEEDED, distance(tree, length, other, size / 12, &sphere));
    free(other);
    free(positions);
    return summary();
}
"#;

/// The same for the function in C++.
const MAIN_CPP: &str = r#"
#include <fstream>
#include <iterator>
static std::vector<char> read_file(const char *name) {
    std::ifstream file(name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}
int main(int argc, char **argv) {
    const auto tree = read_file(argv[argc - 2]), positions = read_file(argv[argc - 1]);
    const dibs::Span<const uint8_t> bytes(reinterpret_cast<const uint8_t *>(tree.data()), tree.size());
    const auto floats = reinterpret_cast<const float *>(positions.data());
    const size_t size = positions.size() / 4;
    std::vector<float> all(floats, floats + size), other(all);
    const dibs_tool sphere = {{90, 10, 20}, {90, 10, 20}, 5};
    std::printf("%d ", distance(bytes, all, sphere) == DIBS_CODE_OK);
    std::printf("%d ", distance(bytes, {all.data(), size - 3}, sphere) == DIBS_CODE_VERTEX_COUNT);
    for (size_t at = 0; at < size; at++) other[at] = all[(at + 3) % size];
    std::printf("%d\n", distance(bytes, other, sphere) == DIBS_CODE_STRETCH_EXCEEDED);
}
"#;

/// The README's programs in a language.
fn programs(language: &str) -> Vec<String> {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let readme = fs::read_to_string(readme).expect("the README");
    let fence = format!("```{language}\n");
    let blocks = readme.split(&fence).skip(1).filter_map(|block| block.split("```").next());
    blocks.map(str::to_owned).collect()
}

/// What the README's first program says of a sphere near a mesh that grew by a tenth, and what the library in Rust does.
fn first_answer<I: Index>(mesh: &Mesh, library: &Path, language: &str) -> [String; 2] {
    let folder = tempfile::tempdir().expect("a folder");
    let built = Builder::new().stretch(1.5).build(mesh).expect("a tree");
    let moved: Vec<Vec3> = mesh.positions.iter().map(|&at| at * 1.1).collect();

    let tree = Tree::<I>::from_bytes(built.blob()).expect("a tree");
    let rows = built.to_rows(&moved);
    let stretch = measure_stretch(&tree, rows.as_slice()).expect("within the limit");
    let mut query = Query::<I, 512>::new(&tree).expect("a stack");
    let sphere = Sphere::new(Vec3::new(90.0, 10.0, 20.0), 5.0).expect("a tool");
    let options = Options::new().stretch(stretch);
    let found = query.closest(rows.as_slice(), &sphere, &options).expect("an answer");
    let Interval { lower, upper, .. } = found.interval();
    let separation = found.separation;
    let expected =
        format!("{separation:.4} mm from the tool's surface, in truth {lower:.4} to {upper:.4}");

    let [tree, positions, program] =
        ["tree", "positions", "first"].map(|name| folder.path().join(name));
    let source = program.with_extension(language);
    fs::write(&tree, built.blob()).expect("writable");
    let floats = moved.iter().flat_map(Vec3::to_array);
    fs::write(&positions, floats.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
        .expect("writable");
    let (main, compiler, standard, after) = match language {
        "c" => (MAIN, "gcc", "-std=c11", "3 checks, 0 failures\n"),
        _ => (MAIN_CPP, "g++", "-std=c++17", "1 1 1\n"),
    };
    let first = programs(language)[0].replace("65536", "99999");
    fs::write(&source, first + main).expect("writable");
    let mut gcc = tool(compiler, compiler);
    gcc.args([standard, "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    gcc.arg("-I").arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs")).arg(&source);
    run(gcc.arg(library).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    let said = run(Command::new(program).arg(tree).arg(positions));
    [said, format!("{expected}\n{after}")]
}

/// A generated heart whose vertices are in another order, with one of no triangle.
fn shuffled(triangles: u32) -> Mesh {
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
        let [said, expected] = first_answer::<u16>(&shuffled(1_000), &library(), language);
        assert_eq!(said, expected, "{language}");
    }
}

/// The library of another feature is compiled for this alone.
#[test]
fn a_large_tree_is_answered_by_the_library_for_large_trees() {
    if env::var_os("DIBS_WHOLE").is_none() {
        println!("skipped: on request, `cargo xtask test --whole`");
        return;
    }
    let library = library_with("large");
    let [said, expected] = first_answer::<u32>(&shuffled(140_000), &library, "c");
    assert_eq!(said, expected);
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
