//! Instruments, as rows of numbers.

use dibs_build::glam::DVec3;
use dibs_nostd::{Capsule, Sphere};

use crate::bytes;

/// A tool in the coordinates of a mesh's file, which may be too large for f32: four numbers of a sphere, or seven of a
/// capsule.
pub type Numbers<'a> = &'a [f64];

/// A tool in the coordinates of a tree.
pub enum AnyTool {
    Sphere(Sphere),
    Capsule(Capsule),
}

impl AnyTool {
    /// Converts a tool to the coordinates of a tree with this origin, which is subtracted in f64.
    pub fn of(numbers: Numbers<'_>, origin: DVec3) -> Result<Self, String> {
        let local = |at: usize| (DVec3::from_slice(&numbers[at..]) - origin).as_vec3();
        let tool = match numbers.len() {
            4 => Sphere::new(local(0), numbers[3] as f32).map(Self::Sphere),
            7 => Capsule::new(local(0), local(3), numbers[6] as f32).map(Self::Capsule),
            count => return Err(format!("{count} numbers are no tool")),
        };
        tool.map_err(|error| error.to_string())
    }
}

/// The tools of consecutive poses, each a chain.
pub struct Poses {
    numbers: Vec<f64>,
    /// Numbers per tool.
    width: usize,
    /// Tools per pose.
    chain: usize,
    /// The number of the first pose.
    pub first: usize,
}

impl Poses {
    pub fn new(bytes: &[u8], width: usize, chain: usize, first: usize) -> Self {
        Self { numbers: bytes::doubles(bytes), width, chain, first }
    }

    /// Chunks of this many poses.
    pub fn chunks(&self, poses: usize) -> Vec<Chunk<'_>> {
        let pose = self.width * self.chain;
        let chunks = self.numbers.chunks(pose * poses).enumerate();
        let chunk = |(number, numbers)| Chunk {
            numbers,
            width: self.width,
            chain: self.chain,
            first: self.first + number * poses,
        };
        chunks.map(chunk).collect()
    }
}

/// Poses that one query object answers.
#[derive(Clone, Copy)]
pub struct Chunk<'a> {
    numbers: &'a [f64],
    width: usize,
    chain: usize,
    first: usize,
}

impl<'a> Chunk<'a> {
    /// The number of poses.
    pub fn len(&self) -> usize {
        self.numbers.len() / (self.width * self.chain)
    }

    /// The number of the first pose.
    pub fn first(&self) -> usize {
        self.first
    }

    /// Each tool, with its pose within the chunk and its index within its chain.
    pub fn tools(self) -> impl Iterator<Item = (usize, usize, Numbers<'a>)> {
        let tools = self.numbers.chunks_exact(self.width).enumerate();
        tools.map(move |(number, tool)| (number / self.chain, number % self.chain, tool))
    }

    /// The error of a tool.
    pub fn wrong(&self, pose: usize, tool: usize, error: impl std::fmt::Display) -> String {
        let row = self.first + pose;
        if self.chain == 1 {
            return format!("tools: row {row}: {error}");
        }
        format!("tools: row {row}, tool {tool}: {error}")
    }
}
