//! `dibs build`: a mesh file becomes a blob or Rust source.

use crate::construction::ConstructionArgs;
use crate::mesh_file::{self, MeshArgs};
use crate::nodes::{self, VolumeSpec};
use crate::{modes, overwrite, stretch, tree_file};
use anyhow::{Result, anyhow, bail};
use clap::ValueEnum;
use dibs_build::{
    BuildError, Builder, BuiltTree, Group, Import, IndexWidth, LimitExcess, Mesh, PeakStretch,
    Volume, orient, read_labels, read_limits,
};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs build heart.ply -o heart.dibs --stretch 1.5
  dibs build heart.stl -o heart.rs --name heart --weld 0.001
  dibs build scan.obj -o scan.dibs --largest-component --json
  dibs build heart.ply -o heart.dibs --limits heart.limits --motion heart.pc2
  dibs build scan.obj -o scan.dibs --orient
  dibs build scan.obj -o scan.dibs --labels tissues.txt
  dibs build organs.msh -o organs.dibs --labels-from-groups
  dibs build heart.ply -o heart.dibs --motion heart.pc2 --modes 16
  dibs build heart.ply -o heart.dibs --nodes heart-fem.msh --motion nodes.npy
  dibs build heart.ply -o heart.dibs --nodes heart-fem.vtu --bind-within 2
  dibs build heart.ply -o heart.dibs --nodes lattice:14,12,10")]
pub struct Args {
    /// The rest shape: OBJ, STL, PLY, OFF, VTK (.vtk, .vtp, .vtu), glTF (.gltf, .glb), Gmsh (.msh) or 3MF, told apart by content
    mesh: PathBuf,
    /// What to write: NAME.dibs, a blob, or NAME.rs, a Rust module that includes NAME.dibs beside it
    #[arg(short, long)]
    output: PathBuf,
    /// The largest stretch that the tree must cover: a factor of at least 1
    #[arg(long, default_value_t = 1.5)]
    stretch: f32,
    /// A limit for each triangle or tetrahedron instead, from a file that `dibs stretch` wrote
    #[arg(long, value_name = "LIMITS", conflicts_with = "stretch")]
    limits: Option<PathBuf>,
    /// A volume whose nodes move the surface: a file of tetrahedra around it (.msh, .vtk, .vtu), or lattice:NX,NY,NZ, a
    /// box of so many cells. Frames then hold the nodes' positions, and --stretch limits each tetrahedron
    #[arg(long, value_name = "VOLUME", value_parser = nodes::parse, conflicts_with = "modes")]
    nodes: Option<VolumeSpec>,
    /// Bind vertices outside of the volume to the nearest tetrahedron, within this distance (mm)
    #[arg(long, value_name = "MM", value_parser = nodes::parse_distance, requires = "nodes", default_value_t = 0.0)]
    bind_within: f64,
    /// A label for each face of the file or triangle of the mesh, say of its tissue: text, one number from 0 to 255 a
    /// line, in the file's order
    #[arg(long, value_name = "LABELS")]
    labels: Option<PathBuf>,
    /// Take labels from the file's own groups: OBJ's g and usemtl, numbered from 0; Gmsh's physical groups by their
    /// numbers; VTK's cell data `label`, `labels` or `RegionId`
    #[arg(long, conflicts_with = "labels")]
    labels_from_groups: bool,
    #[command(flatten)]
    construction: ConstructionArgs,
    /// Bits of an index; by default 16 up to 65,536 vertices, else 32
    #[arg(long, value_enum)]
    index: Option<Bits>,
    /// Name of the Rust module; by default the output file's
    #[arg(long)]
    name: Option<String>,
    #[command(flatten)]
    reading: MeshArgs,
    /// Flip triangles until the surface has an outer side, and closed parts face outwards
    #[arg(long)]
    orient: bool,
    /// Add displacement modes fitted to the motion, so that as many weights drive the surface
    #[arg(long, value_name = "COUNT", requires = "motion")]
    modes: Option<usize>,
    /// A recorded motion of the surface, or of the nodes that move it (.pc2, .npy or a series heart_%03d.vtp): fail if
    /// it stretches the surface beyond the limits
    #[arg(long)]
    motion: Option<PathBuf>,
    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Bits {
    #[value(name = "16")]
    Bits16,
    #[value(name = "32")]
    Bits32,
}

pub fn run(args: &Args) -> Result<()> {
    // Checked before the work starts.
    let is_source = match args.output.extension().and_then(|e| e.to_str()) {
        Some("rs") => true,
        Some("dibs") => false,
        _ => bail!("{}: the output's name must end in .dibs or .rs", args.output.display()),
    };
    // A Rust module has its blob beside it.
    let blob = is_source.then(|| args.output.with_extension("dibs"));
    let volume = args.nodes.as_ref().and_then(VolumeSpec::file);
    let inputs = [
        Some(&args.mesh),
        args.limits.as_ref(),
        args.labels.as_ref(),
        args.motion.as_ref(),
        volume,
    ];
    overwrite::check(inputs.into_iter().flatten(), [&args.output].into_iter().chain(&blob))?;
    let mut import = mesh_file::read(&args.mesh, &args.reading, args.labels_from_groups)?;
    let name = args.mesh.display();
    let turned = if args.orient {
        Some(orient(&mut import.mesh).map_err(|error| anyhow!("{name}: {error}"))?)
    } else {
        None
    };
    let Import { mesh, report, groups, .. } = &import;
    let of_mesh = mesh.warnings();
    let nodes = args.nodes.as_ref();
    let volume = nodes.map(|nodes| nodes.volume(mesh, &args.reading.lengths)).transpose()?;
    let volume = volume.map(|volume| volume.bind_within(args.bind_within));
    let limits = args.limits.as_ref().map(|path| match &volume {
        Some(volume) => volume.read_limits(path),
        None => read_limits(path, mesh),
    });
    let limits = limits.transpose()?;
    let labels = match (&args.labels, groups) {
        (Some(path), _) => Some(read_labels(path, &import)?),
        (None, Some(groups)) => Some(groups.labels.clone()),
        (None, None) => None,
    };
    let groups = groups.as_ref().map(|groups| &groups.groups);
    if let (Some(path), None) = (&args.motion, &args.nodes) {
        let uniform = || vec![args.stretch; mesh.triangles.len()];
        check_covered(args, mesh, path, &limits.clone().unwrap_or_else(uniform))?;
    }
    // A motion that does not fit the mesh fails before the work as well.
    let fit = match (&args.motion, args.modes) {
        (Some(path), Some(_)) => Some(modes::fit(mesh, path, &args.reading.lengths)?),
        _ => None,
    };
    let mut tree =
        build(args, &import, limits, labels, volume.as_ref()).map_err(|error| {
            match (&error, nodes) {
                (BuildError::Volume(_), Some(volume)) => {
                    anyhow!("{volume}: no tree can be built: {error}")
                }
                _ => anyhow!("{name}: no tree can be built: {error}"),
            }
        })?;
    if let (Some(path), Some(_)) = (&args.motion, nodes) {
        nodes::check_covered(&tree, path, &args.reading.lengths)?;
    }
    if let (Some(fit), Some(count)) = (&fit, args.modes) {
        tree = fit.add(&tree, count)?;
    }
    if is_source {
        tree.write_rust(&args.output, &module_name(args))?;
    } else {
        tree.write_blob(&args.output)?;
    }
    let summary = tree.summary();
    let warnings = || of_mesh.iter().cloned().chain(summary.warnings());
    for warning in warnings() {
        eprintln!("warning: {name}: {warning}");
    }
    if args.json {
        let warnings: Vec<String> = report.warnings().chain(warnings()).collect();
        let output = args.output.display().to_string();
        println!(
            "{:#}",
            serde_json::json!({
                "output": output, "mesh": report, "turned": turned, "warnings": warnings, "tree": summary,
                "mode_errors": fit.as_ref().map(modes::Fit::errors), "groups": groups,
            })
        );
    } else {
        println!("read     {name}: {report}");
        for Group { label, name, triangles } in groups.into_iter().flatten() {
            println!("label    {label}: {triangles} triangles {name}");
        }
        if let Some(turned) = turned {
            println!("turned   {turned} triangles");
        }
        if let Some(fit) = &fit {
            fit.print(summary.modes.map_or(0, |modes| modes.count));
        }
        tree_file::print(&summary);
        println!("written  {}", args.output.display());
    }
    Ok(())
}

/// An error unless the limits cover a recorded motion: the controller would reject its frames.
fn check_covered(args: &Args, mesh: &Mesh, path: &Path, limits: &[f32]) -> Result<()> {
    let motion = args.reading.lengths.motion(path, mesh.origin)?;
    let needed = stretch::measure(mesh, &motion, path, args.construction.paths())?;
    let Some(LimitExcess { needed: worst, limit, .. }) = needed.beyond(limits) else {
        return Ok(());
    };
    let is_beyond = |(n, limit): &(&PeakStretch, &f32)| n.stretch > f64::from(**limit);
    let beyond = needed.triangles().iter().zip(limits).filter(is_beyond);
    bail!(
        "{}: the motion stretches {} triangles beyond their limits, most of all triangle {} in frame {}, \
         by {:.4} where {limit} is allowed; let `dibs stretch --limits FILE` learn limits from it, or \
         build with --stretch {:.2}",
        path.display(),
        beyond.count(),
        worst.triangle,
        worst.frame,
        worst.stretch,
        needed.worst().stretch * 1.1,
    )
}

fn build(
    args: &Args,
    import: &Import,
    limits: Option<Vec<f32>>,
    labels: Option<Vec<u8>>,
    volume: Option<&Volume>,
) -> Result<BuiltTree, BuildError> {
    let bar = mesh_file::progress_bar("building", import.mesh.triangles.len());
    let progress = |done: usize| bar.set_position(done as u64);
    let builder = match limits {
        Some(limits) => Builder::new().limits(limits),
        None => Builder::new().stretch(args.stretch),
    };
    let builder = match labels {
        Some(labels) => builder.labels(labels),
        None => builder,
    };
    let builder = match volume {
        Some(volume) => builder.nodes(volume),
        None => builder,
    };
    let tree = builder
        .construction(args.construction.construction())
        .index(match args.index {
            None => IndexWidth::Fitting,
            Some(Bits::Bits16) => IndexWidth::Bits16,
            Some(Bits::Bits32) => IndexWidth::Bits32,
        })
        .progress(&progress)
        .build(import);
    bar.finish_and_clear();
    tree
}

/// The given name, or the output file's with invalid characters replaced.
fn module_name(args: &Args) -> String {
    args.name.clone().unwrap_or_else(|| {
        let stem = args.output.file_stem().unwrap_or_else(|| Path::new("tree").as_os_str());
        let name: String = stem
            .to_string_lossy()
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' })
            .collect();
        if name.starts_with(|c: char| c.is_ascii_lowercase()) { name } else { format!("t{name}") }
    })
}
