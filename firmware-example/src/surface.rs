//! The surface: its tree in flash, as `build.rs` generated it.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{Assembler, FrameReader, Frames, Query, StretchMonitor};

include!(concat!(env!("OUT_DIR"), "/surface.rs"));

/// The two vertex buffers in RAM.
pub type SurfaceFrames = Frames<SURFACE_VERTICES>;

/// The control tick's end of the buffers.
pub type SurfaceReader = FrameReader<'static, SURFACE_VERTICES>;

/// The bus's end: publishes frames that are complete and within the tree's stretch limit.
pub type SurfaceAssembler =
    Assembler<'static, StretchMonitor<'static, SurfaceIndex>, SURFACE_VERTICES>;

/// A query with the stack that this tree needs.
pub type SurfaceQuery = Query<'static, SurfaceIndex, SURFACE_STACK>;
