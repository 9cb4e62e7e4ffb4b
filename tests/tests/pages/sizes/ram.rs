//! The RAM of a query, a tracker, a list of contacts and a surface.

use dibs_nostd::{Assembler, Contacts, FrameReader, Frames, Query, StretchMonitor, Tracker};

use crate::page::thousands;

/// Vertices of the human heart.
const VERTICES: usize = 5_138;

const SURFACE: usize = size_of::<Frames<VERTICES>>()
    + size_of::<FrameReader<'static>>()
    + size_of::<Assembler<'static, StretchMonitor<'static, u16>>>();

/// Names, bytes at commit 354e5ea on a host of 64 bits, and bytes here.
const ROWS: [(&str, usize, usize); 4] = [
    ("`Query<u16, 64>`", 872, size_of::<Query<'static, u16, 64>>()),
    ("`Tracker<u16, 64, 256>`", 13_008, size_of::<Tracker<'static, u16, 64, 256>>()),
    ("`Contacts<8>`", 15_296, size_of::<Contacts<8>>()),
    ("surface of 5,138 vertices, with its ends, assembler and monitor", 124_408, SURFACE),
];

pub fn table() -> String {
    let mut text = "## RAM

Bytes on a host of 64 bits; a controller's references are half as long.

| | 354e5ea | today |
|---|---:|---:|
"
    .to_owned();
    for (name, start, now) in ROWS {
        let [start, now] = [start, now].map(|bytes| thousands(bytes as u32));
        text += &format!("| {name} | {start} | {now} |\n");
    }
    text + "
A list of contacts no longer holds a tracker's memory. Query and tracker collect the triangles that tie, a tracker also
remembers the last separation and what a budget left to search, and a monitor watches the body's volume.
"
}
