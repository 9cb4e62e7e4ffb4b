//! `dibs stream`: sends a recorded or live motion to a controller.

mod coordinates;
mod igtl;
mod interrupt;
mod key;
mod live;
mod memory;
mod parse;
mod part;
mod player;
mod report;
mod timing;

use crate::mesh_file::Lengths;
use crate::motion::{MotionFile, MotionRate};
use crate::tool::ToolSpec;
use crate::tree_file::{self, AnyTree};
use crate::{modes, nodes, overwrite, tool};
use anyhow::{Context, Result, anyhow, bail};
use coordinates::{Axes, SourceCoordinates};
use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{Builder, Import, ReadOptions};
use dibs_nostd::wire::AesCmac;
use dibs_stream::transport::Target;
use dibs_stream::{Sender, Settings, SurfaceOrder};
use igtl::{Address, Exchange, Igtl, TrackedTool};
use interrupt::Interrupt;
use live::Live;
use memory::Memory;
use parse::{Format, Parser};
use player::Player;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

#[derive(clap::Args)]
#[command(mut_arg("motion", |motion| motion.required_unless_present_any(["from", "unnamed_motion"]).conflicts_with("from")))]
#[command(mut_arg("unnamed_motion", |motion| motion.conflicts_with("from")))]
#[command(mut_arg("motion_rate", |rate| rate.alias("rate")), after_help = "\
Examples:
  dibs stream heart.dibs --motion heart.pc2 --to serial:/dev/ttyUSB0@921600 --quantise --partial 0.05 --loop
  dibs stream heart.dibs --motion heart.pc2 --to tcp:192.168.1.20:5000 --motion-rate 40
  dibs stream heart.dibs --motion heart.pc2 --to udp:192.168.1.20:5000 --motion-rate 1000 --weights
  dibs stream heart.ply --motion heart.pc2 --to unix:/tmp/uart --frames 100 --json
  dibs stream heart.dibs --motion heart.pc2 --to serial:/dev/ttyUSB0 --key heart.key
  dibs stream heart.dibs --motion heart.pc2 --to udp:192.168.1.20:5000@5001 --key heart.key --receiver 3
  solver | dibs stream heart.dibs --from - --to udp:192.168.1.20:5000
  solver | dibs stream heart.dibs --from - --format json --unit m --to udp:192.168.1.20:5000
  dibs stream heart.dibs --from shm:heart --to udp:192.168.1.20:5000
  dibs bridge heart.dibs --from igtl:192.168.1.30:18944 --axes RAS:LPS --to udp:192.168.1.20:5000
  dibs bridge heart.dibs --from igtl:192.168.1.30:18944 --pose-device organ --to udp:192.168.1.20:5000
  dibs bridge heart.dibs --from igtl:192.168.1.30:18944 --tool 0,0,0,0,0,150,2.5 --tool-device needle --to udp:192.168.1.20:5000

Frames of --from shm:NAME are raw in memory of that name, /dev/shm/NAME, after 16 bytes: a sequence number (u64), the number of
positions (u32), 0 (u32). The number is 0 while there is no frame; the program that writes adds 1 before a frame and 1 after
it, with release order, and removes the memory at the end.

Frames of --from are positions of the mesh's vertices in its own order, or of a tree's nodes. `raw` is x, y and z of each
as little-endian f32, and nothing else. `json` is a frame a line, [[X, Y, Z], ...] or {\"positions\": [[X, Y, Z], ...],
\"age_ms\": AGE} with the time since the frame was captured. Each is sent at once; where they come faster than the line or
the receiver takes them, the newest is. Without an age a frame counts as captured when it came, or when the frames before
it that equal it did. With --motion-rate every frame is sent, no faster than that, and counts as captured then. The first
wrong frame ends the stream.

Frames of --from igtl:HOST:PORT are the POLYDATA, POINT and NDARRAY messages of OpenIGTLink. One that equals the one before
is as old as that, unless its message has another time: a source states there when it measured, not when it sends. A wrong
message is refused and counted, and the stream goes on. Once the server ends, it is connected to again for --retry seconds,
and then the stream ends with an error. With igtl-listen:PORT a client that ends may be followed by another at any time.

An emulated serial line is a server for this: qemu-system-arm -serial unix:/tmp/uart,server=on,wait=off")]
pub struct Args {
    /// The tree that the receiver has (NAME.dibs), or the mesh from which `dibs build` makes the same tree with default
    /// options
    tree: PathBuf,
    #[command(flatten)]
    motion: MotionFile,
    /// Live frames, instead of a recorded motion: from standard input (-), from shared memory (shm:NAME), or from
    /// OpenIGTLink (igtl:HOST:PORT, igtl-listen:PORT)
    #[arg(long, value_name = "SOURCE", conflicts_with_all = ["weights", "repeat"])]
    from: Option<LiveSource>,
    /// The format of the frames of --from
    #[arg(long, value_enum, default_value_t = Format::Raw, conflicts_with_all = ["motion", "unnamed_motion"])]
    format: Format,
    /// The axes of the frames and of the tree, FROM:TO: RAS:LPS converts frames of 3D Slicer for a mesh that it saved
    #[arg(long, conflicts_with_all = ["motion", "unnamed_motion"])]
    axes: Option<Axes>,
    /// Accept only messages of this OpenIGTLink device
    #[arg(long, conflicts_with_all = ["motion", "unnamed_motion"])]
    device: Option<String>,
    /// Send every frame with the latest rigid pose of this OpenIGTLink device, from TRANSFORM, TDATA or QTDATA: the
    /// frame's positions are those before the pose is applied. For controllers that accept posed frames. The age is
    /// that of the older of the two. A pose that equals the one before is new only if its message has another time
    #[arg(long, value_name = "TRACKED", conflicts_with_all = ["motion", "unnamed_motion"])]
    pose_device: Option<String>,
    /// Print how far this tool is from the surface that was sent last, in a JSON object a line, for each message of
    /// --tool-device: the fields of `dibs query --json`, with the ages of both. In millimetres and in the tool's own frame,
    /// in the grammar of `dibs query --tool`. The peer gets the separation as a STRING
    #[arg(long, value_parser = tool::one, allow_hyphen_values = true, requires = "tool_device")]
    tool: Option<ToolSpec>,
    /// The OpenIGTLink device whose TRANSFORM, TDATA or QTDATA are the poses of --tool
    #[arg(long, value_name = "INSTRUMENT", requires = "tool")]
    tool_device: Option<String>,
    /// The separation is null, with a reason, once the surface or the tool's pose is older than this
    #[arg(long, value_name = "MS", default_value_t = 100, requires = "tool")]
    tool_age: u64,
    /// The receiver's address: `serial:PORT` or `serial:PORT@BAUD`, `tcp:HOST:PORT`, `udp:HOST:PORT` or
    /// `udp:HOST:PORT@LOCAL_PORT`, `unix:PATH`. A frame's UDP packets are spread over half of the time to the next
    /// frame
    #[arg(long)]
    to: Target,
    /// Send a frame's UDP packets without pauses: sooner, for a receiver whose buffer holds a whole frame
    #[arg(long)]
    at_once: bool,
    #[command(flatten)]
    motion_rate: MotionRate,
    /// Send 6 bytes a vertex instead of 12, quantised in a box around each frame
    #[arg(long)]
    quantise: bool,
    /// Send only the vertices that moved by more than this (mm)
    #[arg(long, value_name = "TOLERANCE")]
    partial: Option<f32>,
    /// Send the weights of the displacement modes that the tree was built with, instead of positions
    #[arg(long, alias = "modes", conflicts_with_all = ["quantise", "partial"])]
    weights: bool,
    /// Add a tag to every packet, with the 128-bit key in this file: 32 hexadecimal digits. Waits for the receiver's
    /// challenge
    #[arg(long, value_name = "KEY")]
    key: Option<PathBuf>,
    /// The receiver's challenge, if it has no return channel to report one: 0 unless it was created with another
    #[arg(long, value_name = "NUMBER", requires = "key")]
    challenge: Option<u64>,
    /// The receiver's id for the tags: several receivers may share a key, each with its own id
    #[arg(long, value_name = "NUMBER", default_value_t = 0, requires = "key")]
    receiver: u32,
    /// Largest packet, in bytes: no more than the receiver takes. 64 is a CAN-FD message
    #[arg(long, value_name = "BYTES", default_value = "1024", value_parser = ["64", "1024"])]
    mtu: String,
    /// Start over at the end of the motion
    #[arg(long = "loop")]
    repeat: bool,
    /// Stop after this many frames. Ctrl-C stops too, and prints the totals
    #[arg(long)]
    frames: Option<u64>,
    /// Most frames in flight before the next one waits, if the receiver reports
    #[arg(long, default_value_t = 2)]
    window: u32,
    /// How long to try to reconnect after the connection broke, and to connect to an OpenIGTLink server, at the start or
    /// after it ended; 0 gives up at once
    #[arg(long, value_name = "SECONDS", default_value_t = 10)]
    retry: u64,
    #[command(flatten)]
    lengths: Lengths,
    /// Print the totals as a JSON object
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    overwrite::check([&args.tree].into_iter().chain(args.motion.given()).chain(&args.key), [])?;
    let key = args.key.as_deref().map(key::read).transpose()?;
    let (order, origin, bytes) = order(&args.tree, &args.lengths)?;
    if args.partial.is_some_and(|tolerance| !(tolerance >= 0.0 && tolerance.is_finite())) {
        bail!("--partial: a tolerance is a length of at least 0");
    }
    let source = match args.motion.given() {
        Some(motion) => recorded(args, motion, &order, &bytes)?,
        None => live(args, args.motion_rate.given()?, (&order, origin, bytes))?,
    };
    if args.mtu == "64" {
        connect::<64>(args, key, order, &source)
    } else {
        connect::<1024>(args, key, order, &source)
    }
}

/// The source of live frames.
#[derive(Clone)]
enum LiveSource {
    Input,
    /// Shared memory by its name.
    Memory(String),
    Igtl(Address),
}

impl FromStr for LiveSource {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.starts_with("ros2:") {
            return Err(
                "a topic of ROS 2 is sent by the node examples/ros2/surface_node.py".to_owned()
            );
        }
        match text.strip_prefix("shm:") {
            Some(name) if !name.is_empty() && !name.contains('/') => {
                Ok(Self::Memory(name.to_owned()))
            }
            None if text == "-" => Ok(Self::Input),
            _ => text.parse().map(Self::Igtl).map_err(|()| {
                "give - for standard input, or shm:NAME for shared memory, or igtl:HOST:PORT or igtl-listen:PORT for OpenIGTLink"
                    .to_owned()
            }),
        }
    }
}

/// The surface to send.
struct Source {
    name: String,
    frames: Frames,
    /// Frames a second; `None` to send frames as they arrive.
    rate: Option<f64>,
}

enum Frames {
    Recorded {
        /// In the mesh's order.
        positions: Vec<Vec<Vec3>>,
        /// The weights of each frame, if weights are sent.
        weights: Option<Vec<Vec<f32>>>,
    },
    Live {
        live: Live,
        /// For a source that counts refused messages, and reports the receiver's status to its peer.
        exchange: Option<Arc<Exchange>>,
    },
}

/// Starts to read live frames.
fn live(
    args: &Args,
    rate: Option<f64>,
    (order, origin, tree): (&SurfaceOrder, DVec3, Vec<u8>),
) -> Result<Source> {
    let (unit, axes, keeps_all) = (args.lengths.unit(), args.axes, rate.is_some());
    let place = SourceCoordinates { unit, axes, origin, order: order.clone() };
    let source = args.from.as_ref().unwrap_or(&LiveSource::Input);
    if args.format != Format::Raw && !matches!(source, LiveSource::Input) {
        bail!("--format: frames in shared memory are raw, and those of OpenIGTLink have its own");
    }
    for (word, device) in [
        ("--device", &args.device),
        ("--pose-device", &args.pose_device),
        ("--tool-device", &args.tool_device),
    ] {
        if device.is_some() && !matches!(source, LiveSource::Igtl(_)) {
            bail!("{word}: only OpenIGTLink has devices");
        }
    }
    let (name, live, exchange) = match source {
        LiveSource::Input => {
            let (name, input) = ("standard input".to_owned(), std::io::stdin());
            let mut parser = Parser::new(name.clone(), args.format, place, keeps_all, input);
            (name, Live::start(move || parser.next(), keeps_all), None)
        }
        LiveSource::Memory(memory) => {
            let (name, input) = (format!("shm:{memory}"), Memory::open(memory, order.positions())?);
            let mut parser = Parser::new(name.clone(), Format::Raw, place, keeps_all, input);
            (name, Live::start(move || parser.next(), keeps_all), None)
        }
        LiveSource::Igtl(address) => {
            let exchange = Arc::<Exchange>::default();
            let devices = [args.device.clone(), args.pose_device.clone()];
            let patience = Duration::from_secs(args.retry);
            let tool = args.tool.zip(args.tool_device.clone()).map(|(tool, device)| {
                let most = Duration::from_millis(args.tool_age);
                TrackedTool::new(tool, device, most, (tree, &args.tree))
            });
            let (tool, counts) = (tool.transpose()?, Arc::clone(&exchange));
            let mut igtl = Igtl::new(address, devices, tool, patience, place, counts)?;
            (address.to_string(), Live::start(move || igtl.next(), keeps_all), Some(exchange))
        }
    };
    Ok(Source { name, frames: Frames::Live { live, exchange }, rate })
}

/// Reads a recorded motion of a tree, and checks that all of its frames can be sent.
fn recorded(args: &Args, path: &Path, order: &SurfaceOrder, tree: &[u8]) -> Result<Source> {
    let tree = tree_file::validate(tree, &args.tree)?;
    let motion = match &tree {
        AnyTree::Narrow(tree) => args.lengths.motion_of(tree, path),
        AnyTree::Wide(tree) => args.lengths.motion_of(tree, path),
    }?;
    let rate = args.motion_rate.of(&motion, path)?;
    let (name, mut refused) = (path.display(), None);
    for (number, frame) in motion.frames.iter().enumerate() {
        let at = || format!("{name}, frame {number}");
        let rows = order.to_rows(frame).map_err(|error| anyhow!("{}: {error}", at()))?;
        let refusal = || match &tree {
            AnyTree::Narrow(tree) => nodes::check_rows(tree, &rows).err(),
            AnyTree::Wide(tree) => nodes::check_rows(tree, &rows).err(),
        };
        refused = refused.or_else(|| Some(format!("{}: {}", at(), refusal()?)));
    }
    // The receiver refuses such a frame, and takes the others.
    if let Some(refused) = refused {
        eprintln!("warning: {refused}");
    }
    let weights =
        if args.weights { Some(modes::weights(&args.tree, order, &motion)?) } else { None };
    let frames = Frames::Recorded { positions: motion.frames, weights };
    Ok(Source { name: name.to_string(), frames, rate: Some(rate) })
}

/// Creates the sender: without tags, or with tags once the receiver's challenge is known.
fn connect<const MTU: usize>(
    args: &Args,
    key: Option<[u8; 16]>,
    order: SurfaceOrder,
    source: &Source,
) -> Result<()> {
    let settings =
        Settings { quantised: args.quantise, partial: args.partial, ..Settings::default() };
    let interrupt = Interrupt::new()?;
    let to = args.to.clone();
    let Some(line) = interrupt.unless_raised(move || to.open()) else {
        bail!("{}: stopped before it was open", args.to);
    };
    let line = line?.until(interrupt.flag());
    let Some(key) = key else {
        let sender = Sender::<_, MTU>::new(line, order, settings);
        return Player::new(args, source, sender, interrupt).run();
    };
    let receiver = args.receiver;
    let keyed_mac = move |challenge| AesCmac::new(&key, receiver, challenge);
    let mut sender = Sender::<_, MTU, _>::with_mac(line, order, settings, keyed_mac);
    if let Some(challenge) = args.challenge {
        sender.challenge(challenge);
    }
    Player::new(args, source, sender, interrupt).run()
}

/// The order and origin of a tree's vertices, and its bytes: from the given tree file, or from the tree built of the given mesh file.
fn order(path: &Path, lengths: &Lengths) -> Result<(SurfaceOrder, DVec3, Vec<u8>)> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("dibs")) {
        let bytes = tree_file::load(path)?;
        let tree = tree_file::validate(&bytes, path)?;
        let order = match &tree {
            AnyTree::Narrow(tree) => SurfaceOrder::of(tree),
            AnyTree::Wide(tree) => SurfaceOrder::of(tree),
        };
        let origin = tree.origin();
        return Ok((order, origin, bytes));
    }
    let options = ReadOptions { unit: lengths.unit(), ..Import::options() };
    let mesh = options.read(path)?.mesh;
    let name = path.display();
    let built = Builder::new()
        .build(&mesh)
        .map_err(|error| anyhow!("{name}: no tree can be built: {error}"))?;
    let order = match built.index_bits() {
        16 => SurfaceOrder::of(&built.tree::<u16>().context("the tree just built")?),
        _ => SurfaceOrder::of(&built.tree::<u32>().context("the tree just built")?),
    };
    Ok((order, built.origin(), built.blob().to_vec()))
}
