//! `dibs build`: a mesh file becomes a blob or Rust source.

use crate::{modes, tree_file};
use anyhow::{Result, bail};
use clap::ValueEnum;
use dibs_build::{Builder, BuiltTree, Construction, Import, IndexWidth, Mesh, ReadOptions};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs build heart.ply -o heart.dibs --stretch 1.5
  dibs build heart.stl -o heart.rs --name HEART --weld 0.001
  dibs build scan.obj -o scan.dibs --largest-component --json
  dibs build heart.ply -o heart.dibs --motion heart.pc2 --modes 16")]
pub struct Args {
    /// The rest shape: OBJ, STL, PLY or OFF, told apart by content
    mesh: PathBuf,
    /// What to write: NAME.dibs, a blob, or NAME.rs, Rust source to be included
    #[arg(short, long)]
    output: PathBuf,
    /// The largest stretch that the tree must cover: a factor of at least 1
    #[arg(long, default_value_t = 1.5)]
    stretch: f32,
    /// How sections are pinned, measured and split
    #[arg(long, value_enum, default_value = "default")]
    construction: ConstructionName,
    /// Bits of an index; by default 16 up to 65,536 vertices, else 32
    #[arg(long, value_enum)]
    index: Option<Bits>,
    /// Name of the Rust static; by default the output file's name in capitals
    #[arg(long)]
    name: Option<String>,
    /// Fail on degenerate and duplicate triangles, instead of dropping them
    #[arg(long)]
    strict: bool,
    /// Weld vertices at most this far apart (0: equal ones); by default only soup is welded, exactly
    #[arg(long, value_name = "TOLERANCE")]
    weld: Option<f32>,
    /// Keep the largest of several separate surfaces
    #[arg(long)]
    largest_component: bool,
    /// Add displacement modes fitted to the motion, so that as many weights drive the surface
    #[arg(long, value_name = "COUNT", requires = "motion")]
    modes: Option<usize>,
    /// The recorded motion of the mesh, a .pc2 file
    #[arg(long, requires = "modes")]
    motion: Option<PathBuf>,
    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum ConstructionName {
    /// Geodesic split
    Default,
    /// As published: mid-range pin, section-restricted paths, split by a plane
    Paper,
}

#[derive(Clone, Copy, ValueEnum)]
enum Bits {
    #[value(name = "16")]
    Bits16,
    #[value(name = "32")]
    Bits32,
}

pub fn run(args: &Args) -> Result<()> {
    // Before the work, not after it.
    let is_source = match args.output.extension().and_then(|e| e.to_str()) {
        Some("rs") => true,
        Some("dibs") => false,
        _ => bail!("{}: the output's name must end in .dibs or .rs", args.output.display()),
    };
    let options = ReadOptions {
        weld_tolerance: args.weld,
        strict: args.strict,
        largest_component: args.largest_component,
    };
    let Import { mesh, report } = options.read(&args.mesh)?;
    let name = args.mesh.display();
    for warning in report.warnings() {
        eprintln!("warning: {name}: {warning}");
    }
    // A motion that does not fit is found before the work, too.
    let fit = args.motion.as_deref().map(|path| modes::fit(&mesh, path)).transpose()?;
    let mut tree = build(args, &mesh)
        .map_err(|error| anyhow::anyhow!("{name}: no tree can be built: {error}"))?;
    if let (Some(fit), Some(count)) = (&fit, args.modes) {
        tree = fit.add(&tree, count)?;
    }
    if is_source {
        tree.write_rust(&args.output, &static_name(args))?;
    } else {
        tree.write_blob(&args.output)?;
    }
    let summary = tree.summary();
    if args.json {
        let warnings: Vec<String> = report.warnings().collect();
        let output = args.output.display().to_string();
        println!(
            "{:#}",
            serde_json::json!({
                "output": output, "mesh": report, "warnings": warnings, "tree": summary,
                "mode_errors": fit.as_ref().map(|fit| fit.errors()),
            })
        );
    } else {
        println!("read     {name}: {report}");
        if let Some(fit) = &fit {
            fit.print(summary.modes.map_or(0, |modes| modes.count));
        }
        tree_file::print(&summary);
        println!("written  {}", args.output.display());
    }
    Ok(())
}

fn build(args: &Args, mesh: &Mesh) -> Result<BuiltTree, dibs_build::BuildError> {
    let bar = ProgressBar::new(mesh.triangles.len() as u64);
    if let Ok(style) = ProgressStyle::with_template("building {bar:40} {percent}% {elapsed}") {
        bar.set_style(style);
    }
    let progress = |done: usize| bar.set_position(done as u64);
    let tree = Builder::new()
        .stretch(args.stretch)
        .construction(match args.construction {
            ConstructionName::Default => Construction::Geodesic,
            ConstructionName::Paper => Construction::Paper,
        })
        .index(match args.index {
            None => IndexWidth::Fitting,
            Some(Bits::Bits16) => IndexWidth::Bits16,
            Some(Bits::Bits32) => IndexWidth::Bits32,
        })
        .progress(&progress)
        .build(mesh);
    bar.finish_and_clear();
    tree
}

/// The name asked for, or the output file's, made fit for a Rust static.
fn static_name(args: &Args) -> String {
    args.name.clone().unwrap_or_else(|| {
        let stem = args.output.file_stem().unwrap_or_else(|| Path::new("tree").as_os_str());
        let name: String = stem
            .to_string_lossy()
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' })
            .collect();
        if name.starts_with(|c: char| c.is_ascii_uppercase()) { name } else { format!("T{name}") }
    })
}
