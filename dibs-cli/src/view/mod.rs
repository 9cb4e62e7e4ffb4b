//! `dibs view`: one HTML file that runs the actual query.

mod pack;
mod page;
mod ticks;

use crate::mesh_file::Lengths;
use crate::motion::{MotionFile, MotionRate};
use crate::query::{ALLOW, rows};
use crate::tree_file::{self, AnyTree};
use crate::{overwrite, tool};
use anyhow::{Result, bail};
use dibs_build::glam::Vec3;
use dibs_build::{SurfaceRows, write_atomically};
use dibs_nostd::{Index, Tree};
use page::Page;
use serde_json::json;
use std::path::{Path, PathBuf};
use ticks::Record;

#[derive(clap::Args)]
#[command(mut_arg("motion_rate", |rate| rate.requires("motion")), after_help = "\
Examples:
  dibs view heart.dibs --motion heart.pc2 -o heart.html
  dibs view heart.dibs --motion heart.pc2 --path tools.csv -o replay.html
  dibs filter heart.dibs --motion heart.pc2 --path commands.csv --stand-off 1 --json > ticks.jsonl
  dibs view heart.dibs --motion heart.pc2 --path commands.csv --ticks ticks.jsonl -o filtered.html

The file needs nothing else and no network: a browser opens it. The query in it is the one of this program, compiled
to WebAssembly.")]
pub struct Args {
    /// A tree file that `dibs build` wrote
    tree: PathBuf,
    #[command(flatten)]
    motion: MotionFile,
    /// The HTML file to write
    #[arg(short, long)]
    output: PathBuf,
    /// The instrument's pose at each millisecond, as for `dibs track`: `-` is standard input; by default the viewer
    /// moves it
    #[arg(long, value_name = "TOOLS")]
    path: Option<PathBuf>,
    /// The output of `dibs filter --json` for the path: the instrument moves as admitted, and the commanded one is
    /// drawn beside it. A line may also have `energy`, in mJ
    #[arg(long, value_name = "TICKS", requires = "path")]
    ticks: Option<PathBuf>,
    #[command(flatten)]
    motion_rate: MotionRate,
    /// The page without data; by default dibs-viewer.html beside this program. If it is missing, it is made
    /// in the checkout where the program was compiled, for which Node.js is needed
    #[arg(long, value_name = "PAGE")]
    page: Option<PathBuf>,
    #[command(flatten)]
    lengths: Lengths,
    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    let inputs =
        [&args.tree].into_iter().chain(args.motion.given()).chain(&args.path).chain(&args.ticks);
    let page = Page::new(args.page.as_deref())?;
    overwrite::check(inputs.chain([&page.path]), [&args.output])?;
    let bytes = tree_file::load(&args.tree)?;
    let data = match tree_file::validate(&bytes, &args.tree)? {
        AnyTree::Narrow(tree) => data(args, &tree, &bytes)?,
        AnyTree::Wide(tree) => data(args, &tree, &bytes)?,
    };
    // Last, because the page may have to be made first, which takes long: all errors of the inputs are reported before.
    let page = page.filled(&data)?;
    write_atomically(&args.output, |out| out.write_all(page.as_bytes()))?;
    let name = args.output.display();
    if args.json {
        println!("{}", json!({ "output": name.to_string(), "bytes": page.len() }));
    } else {
        println!("written  {name}: {} bytes", page.len());
    }
    Ok(())
}

/// The elements with the tree, the motion and their descriptions.
fn data<I: Index>(args: &Args, tree: &Tree<'_, I>, bytes: &[u8]) -> Result<String> {
    let (frames, rate) = match args.motion.given() {
        Some(path) => motion(args, tree, path)?,
        None => (Vec::new(), 1.0),
    };
    if args.motion.given().is_none() && tree.vertex_count() > 0 && tree.rest_position(0).is_none() {
        bail!("{}: the tree has no rest shape, give --motion", args.tree.display());
    }
    let origin = tree.origin().into();
    let path = match &args.path {
        Some(path) => tool::path(path, |tool| tool.numbers(origin))?,
        None => Vec::new(),
    };
    let record = match &args.ticks {
        Some(ticks) => Record::read(ticks, path.len(), origin)?,
        None => Record::default(),
    };
    let (path, commanded) =
        if record.admitted.is_empty() { (path, Vec::new()) } else { (record.admitted, path) };
    let name = args.tree.file_name().unwrap_or(args.tree.as_os_str()).to_string_lossy();
    let facts = json!({
        "name": name,
        "tree": args.tree.display().to_string(),
        "reasons": record.reasons,
        "rate": rate,
        "frames": frames.len().max(1),
    });
    let mut data = String::new();
    // A `<` in a name must not end the element.
    let facts = facts.to_string().replace('<', "\\u003c");
    data += &format!("<script type=\"application/json\" id=\"facts\">{facts}</script>\n");
    let elements = [
        ("tree", bytes),
        ("motion", &pack::words(&frames)),
        ("path", &pack::path(&path)),
        ("commanded", &pack::path(&commanded)),
        ("ticks", &pack::path(&record.ticks)),
    ];
    for (id, bytes) in elements {
        let text = pack::text(bytes)?;
        data += &format!("<script type=\"text/plain\" id=\"{id}\">{text}</script>\n");
    }
    Ok(data)
}

/// The frames of a motion: of vertices in the order of the tree's rows or of nodes, all within the stretch limit.
fn motion<I: Index>(args: &Args, tree: &Tree<'_, I>, path: &Path) -> Result<(Vec<Vec<Vec3>>, f64)> {
    let name = path.display();
    let motion = args.lengths.motion_of(tree, path)?;
    let rate = args.motion_rate.of(&motion, path)?;
    let mut frames = Vec::with_capacity(motion.frames.len());
    for (number, frame) in motion.frames.iter().enumerate() {
        let frame = rows(tree, path, number, frame)?;
        if let Err(error) = SurfaceRows::of(tree, frame.clone())?.stretch {
            bail!("{name}, frame {number}: {}", SurfaceRows::refusal(tree, error, ALLOW));
        }
        frames.push(frame);
    }
    Ok((frames, rate))
}
