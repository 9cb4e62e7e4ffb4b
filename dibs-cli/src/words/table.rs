//! The options of `dibs` and of `cargo xtask demo`: one name for each value.

use clap::{Arg, Command};
use std::collections::BTreeSet;

/// An option's name, the name of its value (a switch has none), its meaning, and the commands that have it.
type Row = (&'static str, &'static str, &'static str, &'static str);

#[rustfmt::skip]
pub const WORDS: &[Row] = &[
    ("tree", "TREE", "the tree's file", "inspect query track filter view stream"),
    ("mesh", "MESH", "the file of the rest shape", "build stretch demo"),
    ("motion", "MOTION", "the file of the surface's motion", "build stretch track filter view stream generate demo"),
    ("motion-rate", "HZ", "frames a second of the motion", "track filter view stream demo"),
    ("rate", "HZ", "ticks a second of the control loop", "track filter"),
    ("tool", "TOOL", "a tool", "query stream"),
    ("poses", "POSES", "a file of tools or chains, each asked by itself", "query"),
    ("path", "TOOLS", "a file of the tool at each tick", "track filter view"),
    ("ticks", "TICKS", "what a filter said of each tick", "view"),
    ("vertices", "VERTICES", "the file of the surface at one time", "query"),
    ("frame", "FRAME", "which frame of a motion", "query"),
    ("contacts", "MM", "the margin within which contacts are listed", "query track"),
    ("surface", "SURFACE", "the surface between frames", "track"),
    ("full", "", "remember nothing from tick to tick", "track"),
    ("budget", "N", "instructions of a tick", "track filter"),
    ("stand-off", "[LABEL=]MM", "least separation of tool and tissue", "filter"),
    ("tissue-speed", "MM/S", "largest speed of the tissue", "filter"),
    ("robot-speed", "MM/S", "largest speed of the robot", "filter"),
    ("age", "MS", "time by which the surface is behind", "filter"),
    ("approach", "MS", "time constant of the approach", "filter"),
    ("registration", "MM", "error of the registration", "filter"),
    ("stretch", "STRETCH", "the limit on stretch", "build query demo"),
    ("limits", "LIMITS", "the file of a limit for each triangle or tetrahedron", "build stretch"),
    ("margin", "MARGIN", "what limits leave above the recorded stretch", "stretch"),
    ("picture", "PICTURE", "the drawing of the stretch", "stretch"),
    ("construction", "CONSTRUCTION", "how the tree is built", "build stretch"),
    ("nodes", "VOLUME", "the volume whose nodes move the surface", "build stretch demo"),
    ("bind-within", "MM", "distance from which vertices outside are bound", "build"),
    ("labels", "LABELS", "the file of a label for each triangle", "build"),
    ("labels-from-groups", "", "labels from the mesh's file", "build"),
    ("index", "INDEX", "bits of an index", "build"),
    ("name", "NAME", "the Rust module", "build"),
    ("orient", "", "turn triangles outwards", "build"),
    ("modes", "COUNT", "displacement modes to add to the tree", "build"),
    ("unit", "UNIT", "the unit of files", "build stretch query track filter view stream"),
    ("strict", "", "fail on degenerate triangles", "build stretch"),
    ("weld", "TOLERANCE", "distance of vertices that are one", "build stretch"),
    ("largest-component", "", "keep the largest surface alone", "build stretch"),
    ("origin", "X,Y,Z", "the point that coordinates count from", "build stretch"),
    ("from", "SOURCE", "where frames come from as they are made", "stream"),
    ("format", "FORMAT", "what those frames are", "stream"),
    ("axes", "AXES", "the axes of those frames and of the tree", "stream"),
    ("device", "DEVICE", "the OpenIGTLink device whose frames are taken", "stream"),
    ("pose-device", "TRACKED", "the OpenIGTLink device whose pose the frames have", "stream"),
    ("tool-device", "INSTRUMENT", "the OpenIGTLink device whose poses are the tool's", "stream"),
    ("tool-age", "MS", "greatest age of a surface and a tool's pose that are answered about", "stream"),
    ("to", "TO", "the receiver's address", "stream"),
    ("quantise", "", "6 bytes a vertex", "stream"),
    ("partial", "TOLERANCE", "distance of vertices that stand still", "stream"),
    ("weights", "", "send the modes' weights", "stream"),
    ("key", "KEY", "the file of the key", "stream"),
    ("challenge", "NUMBER", "the receiver's challenge", "stream"),
    ("receiver", "NUMBER", "the receiver's id", "stream"),
    ("mtu", "BYTES", "the largest packet", "stream"),
    ("loop", "", "start over at the end", "stream"),
    ("frames", "FRAMES", "how many frames are sent", "stream"),
    ("at-once", "", "without pauses", "stream"),
    ("window", "WINDOW", "frames on their way", "stream"),
    ("retry", "SECONDS", "time to connect again", "stream"),
    ("page", "PAGE", "the page without data", "view"),
    ("triangles", "TRIANGLES", "triangles to make", "generate"),
    ("output", "OUTPUT", "what is written", "build query view generate man demo"),
    ("json", "", "results as JSON", "build stretch inspect query track filter view stream generate"),
    ("shell", "SHELL", "the shell", "completions"),
    ("script", "", "a script moves the instrument", "demo"),
    ("seconds", "SECONDS", "the controller's time", "demo"),
    ("host", "", "the controller on this computer", "demo"),
    ("c", "", "the controller in C", "demo"),
    ("serial", "", "a serial line for the bus", "demo"),
    ("bridge", "", "frames from OpenIGTLink", "demo"),
    ("faults", "", "faults on the bus", "demo"),
    ("seed", "SEED", "the faults' seed", "demo"),
];

/// The options of a command with the names of their values, from the table.
pub fn of_table(command: &str) -> BTreeSet<(String, String)> {
    let has = |row: &&Row| row.3.split(' ').any(|name| name == command);
    WORDS.iter().filter(has).map(|row| (row.0.to_owned(), row.1.to_owned())).collect()
}

/// The options of a command and its subcommands, from its help.
pub fn of_clap(command: &Command) -> BTreeSet<(String, String)> {
    let below = command.get_subcommands().flat_map(of_clap);
    let shown = command.get_arguments().filter(|arg| !arg.is_hide_set());
    shown.map(|arg| (word(arg), value(arg))).chain(below).collect()
}

/// The name of an option, or an argument's value name in lower case.
pub fn word(arg: &Arg) -> String {
    arg.get_long().map_or_else(|| value(arg).to_lowercase(), str::to_owned)
}

fn value(arg: &Arg) -> String {
    match arg.get_value_names() {
        Some([name, ..]) if arg.get_action().takes_values() => name.to_string(),
        _ => String::new(),
    }
}
