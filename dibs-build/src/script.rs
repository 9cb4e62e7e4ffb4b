//! A tree from one line of a build script.

use std::env;
use std::path::{Path, PathBuf};

use crate::{
    Builder, BuiltTree, Mesh, ReadOptions, RestSurface, Unit, orient, read_labels, read_limits,
};

/// Starts the tree of a build script, from a mesh file or a [`Mesh`]; [`TreeScript::emit`] builds it.
///
/// The `main` of a `build.rs`:
///
/// ```no_run
/// dibs_build::tree("heart.ply").stretch(1.5).emit("heart");
/// ```
///
/// Paths are relative to the package, as everywhere in build scripts.
#[must_use = "nothing is built before `emit`"]
pub fn tree(mesh: impl Into<MeshSource>) -> TreeScript {
    TreeScript {
        mesh: mesh.into(),
        reading: ReadOptions::default(),
        orients: false,
        limits: None,
        labels: None,
        #[cfg(feature = "modes")]
        modes: None,
        builder: Builder::new(),
    }
}

/// Where the mesh of a build script comes from.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum MeshSource {
    /// A file in one of the formats of [`read`](crate::read()).
    File(PathBuf),
    /// A mesh made by the script.
    Mesh(Mesh),
}

impl<P: AsRef<Path> + ?Sized> From<&P> for MeshSource {
    fn from(path: &P) -> Self {
        Self::File(path.as_ref().to_path_buf())
    }
}

impl From<PathBuf> for MeshSource {
    fn from(path: PathBuf) -> Self {
        Self::File(path)
    }
}

impl From<Mesh> for MeshSource {
    fn from(mesh: Mesh) -> Self {
        Self::Mesh(mesh)
    }
}

/// The tree of a build script, from [`tree`].
#[derive(Clone, Debug)]
#[must_use = "nothing is built before `emit`"]
pub struct TreeScript {
    mesh: MeshSource,
    reading: ReadOptions,
    orients: bool,
    limits: Option<PathBuf>,
    labels: Option<PathBuf>,
    #[cfg(feature = "modes")]
    modes: Option<(PathBuf, usize)>,
    builder: Builder<'static>,
}

impl TreeScript {
    /// The largest stretch that the tree must cover: a factor of at least 1; by default 1.5.
    pub fn stretch(mut self, limit: f32) -> Self {
        self.builder = self.builder.stretch(limit);
        self
    }

    /// A label for each triangle, from a file with one number from 0 to 255 a line.
    pub fn labels(mut self, file: impl Into<PathBuf>) -> Self {
        self.labels = Some(file.into());
        self
    }

    /// Uses the mesh file's own groups as labels: [`ReadOptions::groups`].
    pub fn labels_from_groups(mut self) -> Self {
        self.reading.groups = true;
        self
    }

    /// A limit for each triangle instead, from a file that `dibs stretch --limits` has written.
    pub fn limits(mut self, file: impl Into<PathBuf>) -> Self {
        self.limits = Some(file.into());
        self
    }

    /// Adds displacement modes fitted to a recorded motion in a format of [`Motion::read`](crate::Motion::read).
    #[cfg(feature = "modes")]
    pub fn modes(mut self, motion: impl Into<PathBuf>, count: usize) -> Self {
        self.modes = Some((motion.into(), count));
        self
    }

    /// The unit of the lengths in the mesh file, which are converted to millimetres: [`ReadOptions::unit`].
    ///
    /// ```no_run
    /// dibs_build::tree("heart.stl").unit(dibs_build::Unit::Metre).emit("heart");
    /// ```
    pub fn unit(mut self, unit: Unit) -> Self {
        self.reading.unit = Some(unit);
        self
    }

    /// Flips triangles until the surface faces outwards, as [`orient`](crate::orient()) does. Without it, inside and outside
    /// of a mesh that faces inwards are exchanged.
    pub fn orient(mut self) -> Self {
        self.orients = true;
        self
    }

    /// How the mesh file is read.
    pub fn reading(mut self, options: ReadOptions) -> Self {
        let (groups, unit) =
            (options.groups || self.reading.groups, options.unit.or(self.reading.unit));
        self.reading = ReadOptions { groups, unit, ..options };
        self
    }

    /// The builder's other options: `with(|builder| builder.with_rest_shape(false))`.
    pub fn with(mut self, change: impl FnOnce(Builder<'static>) -> Builder<'static>) -> Self {
        self.builder = change(self.builder);
        self
    }

    /// Builds the tree and writes it where `dibs_nostd::include_tree!(name)` finds it.
    ///
    /// Cargo then runs the script again only when the script or a file that it read has changed. The import's warnings
    /// become cargo's warnings. On failure the script ends with one sentence as cargo's error: the file, the element,
    /// the remedy.
    pub fn emit(self, name: &str) {
        if let Err(error) = self.try_emit(name) {
            println!("cargo::error={error}");
            std::process::exit(1);
        }
    }

    /// As [`emit`](Self::emit), for a script that continues after an error.
    ///
    /// # Errors
    /// Errors of reading, building or writing.
    pub fn try_emit(self, name: &str) -> Result<BuiltTree, Box<dyn std::error::Error>> {
        println!("cargo::rerun-if-changed=build.rs");
        for file in self.files() {
            println!("cargo::rerun-if-changed={}", file.display());
        }
        let out =
            env::var_os("OUT_DIR").ok_or("OUT_DIR is not set: call this from a build script")?;
        let label = match &self.mesh {
            MeshSource::File(path) => path.display().to_string(),
            MeshSource::Mesh(_) => name.to_owned(),
        };
        let built = self.build(&label).map_err(|error| of_script(error.to_string()))?;
        built.write_rust(Path::new(&out).join(name).with_extension("rs"), name)?;
        Ok(built)
    }

    /// Every file that the script reads.
    fn files(&self) -> impl Iterator<Item = &Path> {
        let mesh = match &self.mesh {
            MeshSource::File(path) => Some(path.as_path()),
            MeshSource::Mesh(_) => None,
        };
        #[cfg(feature = "modes")]
        let motion = self.modes.as_ref().map(|(path, _)| path.as_path());
        #[cfg(not(feature = "modes"))]
        let motion = None;
        [mesh, self.limits.as_deref(), self.labels.as_deref(), motion].into_iter().flatten()
    }

    fn build(self, label: &str) -> Result<BuiltTree, Box<dyn std::error::Error>> {
        let mut builder = self.builder;
        let surface: Box<dyn RestSurface> = match self.mesh {
            MeshSource::File(path) => {
                let mut import = self.reading.read(path)?;
                warn(label, import.report.warnings());
                if self.orients {
                    orient(&mut import.mesh).map_err(|error| format!("{label}: {error}"))?;
                }
                if let Some(groups) = import.groups.take() {
                    builder = builder.labels(groups.labels);
                }
                Box::new(import)
            }
            MeshSource::Mesh(mut mesh) => {
                if self.orients {
                    orient(&mut mesh).map_err(|error| format!("{label}: {error}"))?;
                }
                Box::new(mesh)
            }
        };
        warn(label, surface.mesh().warnings().into_iter());
        let builder = match &self.limits {
            Some(path) => {
                let limits = match builder.volume() {
                    Some(volume) => volume.read_limits(path)?,
                    None => read_limits(path, surface.mesh())?,
                };
                builder.limits(limits)
            }
            None => builder,
        };
        let builder = match &self.labels {
            Some(path) => builder.labels(read_labels(path, &*surface)?),
            None => builder,
        };
        let built = builder.build(&*surface).map_err(|error| format!("{label}: {error}"))?;
        warn(label, built.summary().warnings());
        #[cfg(feature = "modes")]
        if let Some((path, count)) = self.modes {
            let origin = surface.mesh().origin;
            let motion = crate::Motion::read_around(&path, self.reading.unit, origin)?;
            let failed = |error| format!("{}: {error}", path.display());
            let fit = crate::modes::ModalFit::new(surface.mesh(), &motion).map_err(failed)?;
            return built.with_modes(&fit, count).map_err(|error| failed(error).into());
        }
        Ok(built)
    }
}

fn warn(label: &str, warnings: impl Iterator<Item = String>) {
    for warning in warnings {
        println!("cargo::warning={label}: {}", of_script(warning));
    }
}

/// The command line's options in the library's sentences, and what a script calls instead.
const CALLS: [(&str, &str); 13] = [
    ("`dibs build --orient`", "`.orient()`"),
    ("--orient", "`.orient()`"),
    ("without --strict", "without `strict` in `.reading(..)`"),
    ("--strict", "`strict` in `.reading(..)`"),
    ("--weld 0", "`weld_tolerance: Some(0.0)` in `.reading(..)`"),
    ("--largest-component", "`largest_component` in `.reading(..)`"),
    ("--unit mm", "`.unit(Unit::Millimetre)`"),
    ("--unit cm", "`.unit(Unit::Centimetre)`"),
    ("--unit in", "`.unit(Unit::Inch)`"),
    ("--unit um", "`.unit(Unit::Micrometre)`"),
    ("--unit m", "`.unit(Unit::Metre)`"),
    ("--unit", "`.unit(..)`"),
    ("(--bind-within)", "(`Volume::bind_within`)"),
];

/// A sentence of the library, with a script's calls.
fn of_script(mut sentence: String) -> String {
    for (option, call) in CALLS {
        sentence = sentence.replace(option, call);
    }
    sentence
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four triangles of two groups.
    const OBJ: &str = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\n\
        g base\nf 1 3 2\ng walls\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

    /// Each triangle's corners, as numbers of the file's vertices, and its label.
    fn labels(script: TreeScript) -> Vec<([u32; 3], Option<u8>)> {
        let built = script.build("tetra").unwrap();
        let tree = built.tree::<u16>().unwrap();
        let rows = (0..tree.triangle_count()).map(dibs_nostd::TriangleRow);
        let mut labels: Vec<_> = rows
            .map(|row| {
                let corners = tree.corners(row).unwrap();
                let mut corners = corners.map(|corner| tree.vertex_number(corner).unwrap().0);
                corners.sort_unstable();
                (corners, tree.label(row))
            })
            .collect();
        labels.sort_unstable();
        labels
    }

    #[test]
    fn a_mesh_that_faces_inwards_is_warned_of_and_turned() {
        let mut mesh = crate::generate::heart(320).unwrap().mesh;
        assert!(mesh.warnings().is_empty());
        for corners in &mut mesh.triangles {
            corners.swap(0, 1);
        }
        let warned: Vec<String> = mesh.warnings().into_iter().map(of_script).collect();
        let is_it = |one: &str| one.contains("faces inwards") && one.contains("`.orient()`");
        assert!(matches!(&warned[..], [one] if is_it(one)), "{warned:?}");
        let side = |script: TreeScript| {
            let built = script.build("heart").unwrap();
            let tree = built.tree::<u16>().unwrap();
            let rest: Vec<_> = (0..).map_while(|row| tree.rest_position(row)).collect();
            let mut query = dibs_nostd::Query::<u16, 64>::new(&tree).unwrap();
            let far = dibs_nostd::Sphere::new(glam::Vec3::new(200.0, 0.0, 0.0), 1.0).unwrap();
            query.closest(rest.as_slice(), &far, &dibs_nostd::Options::new()).unwrap().side
        };
        assert_eq!(side(tree(mesh.clone())), dibs_nostd::Side::Inside);
        assert_eq!(side(tree(mesh).orient()), dibs_nostd::Side::Outside);
    }

    /// The text of a call, which compiles as it stands.
    macro_rules! compiled {
        (.$call:ident($($given:expr)?)) => {{
            let _: fn(TreeScript) -> TreeScript = |script| script.$call($($given)?);
            concat!("`.", stringify!($call), "(", $(stringify!($given),)? ")`").to_owned()
        }};
        ($field:ident: $given:expr) => {{
            let _ = ReadOptions { $field: $given, ..ReadOptions::default() };
            concat!("`", stringify!($field), ": ", stringify!($given), "`").to_owned()
        }};
    }

    #[test]
    fn each_option_in_a_sentence_becomes_a_call_that_compiles() {
        let mut compiled = vec![
            compiled!(.orient()),
            compiled!(.reading(ReadOptions::default())),
            compiled!(weld_tolerance: Some(0.0)),
            compiled!(strict: true),
            compiled!(largest_component: true),
            compiled!(.unit(Unit::Millimetre)),
            compiled!(.unit(Unit::Centimetre)),
            compiled!(.unit(Unit::Metre)),
            compiled!(.unit(Unit::Inch)),
            compiled!(.unit(Unit::Micrometre)),
        ];
        let _: fn(crate::Volume, f64) -> crate::Volume = crate::Volume::bind_within;
        compiled.push("`Volume::bind_within`".to_owned());
        // A sentence may name a call or a field without its argument or value.
        for end in ["(", ": "] {
            let short = |text: &String| text.split_once(end).map(|(name, _)| name.to_owned());
            let shorts: Vec<String> = compiled.iter().filter_map(short).collect();
            let left_out = if end == "(" { "(..)`" } else { "`" };
            compiled.extend(shorts.into_iter().map(|name| name + left_out));
        }
        let crates = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut sentences = String::new();
        for folder in ["src", "../dibs-nostd/src"] {
            read_all(&crates.join(folder), &mut sentences);
        }
        assert!(sentences.contains("--unit {"));
        for unit in Unit::ALL {
            sentences += &format!(" --unit {unit} ");
            let call = of_script(format!("--unit {unit}"));
            assert_eq!(call, format!("`.unit(Unit::{unit:?})`"));
        }
        for (option, call) in CALLS {
            assert!(sentences.contains(option), "no sentence has {option}");
            assert_eq!(of_script(option.to_owned()), call, "an earlier row takes it");
            for piece in call.split('`').skip(1).step_by(2) {
                assert!(compiled.contains(&format!("`{piece}`")), "{option}: `{piece}`");
            }
        }
    }

    /// The text of all sources in a folder but this one.
    fn read_all(folder: &Path, text: &mut String) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                read_all(&path, text);
            } else if !path.ends_with("script.rs") {
                *text += &std::fs::read_to_string(path).unwrap();
            }
        }
    }

    #[test]
    fn a_files_groups_are_labels_if_the_script_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tetra.obj");
        std::fs::write(&path, OBJ).unwrap();
        let corners = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
        let with = |of: [Option<u8>; 4]| corners.into_iter().zip(of).collect::<Vec<_>>();
        let grouped = with([Some(0), Some(1), Some(1), Some(1)]);
        assert_eq!(labels(tree(&path).labels_from_groups()), grouped);
        assert_eq!(labels(tree(&path)), with([None; 4]));
        // Reading options that are set later do not clear this switch.
        let options = ReadOptions { weld_tolerance: Some(0.0), ..ReadOptions::default() };
        assert_eq!(labels(tree(&path).labels_from_groups().reading(options)), grouped);
    }
}
