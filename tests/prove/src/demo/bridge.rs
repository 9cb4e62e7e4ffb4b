//! Frames by `dibs bridge`: an OpenIGTLink source, which keeps the board's time, sends them to the program, and that sends
//! them to the board.

// Requirement: B-09

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use controller::TICK_RATE;
use serde_json::Value;
use xtask::process::run;

use super::bus::{Bus, WINDOW};
use super::scene::Scene;
use super::sender::{Link, PAUSE, Paced, order, paced};
use super::session::joined;

#[path = "../../../../dibs-cli/tests/cli/stream/igtl_messages.rs"]
#[expect(dead_code, reason = "the bridge's own tests send more kinds")]
mod igtl_messages;

/// Between two looks at the board's statuses.
const GLANCE: Duration = Duration::from_millis(1);

/// Real time that the program has to start.
const PATIENCE: Duration = Duration::from_secs(20);

/// Frames that come faster than this wait for their turn. None of the source is passed over, so that its number is that of
/// the controller's.
const MOST: &str = "1000";

/// Frames on their way before one waits in the program. There it would grow old by this computer's time, which is faster than
/// the emulated board's, so that the board would take it for one captured before the published frame.
const ON_THEIR_WAY: &str = "64";

/// Sends the motion repeatedly until the controller ends. Returns the program's totals.
pub fn send(scene: &Scene, link: &Arc<Link>, port: u16) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let [tree, said] = ["surface.dibs", "said"].map(|name| folder.path().join(name));
    fs::write(&tree, scene.tree.blob())?;
    let (listener, relay) = (TcpListener::bind("127.0.0.1:0")?, Relay::new(link, port)?);
    // A board that starts has no network yet.
    while link.now() == 0 && !link.is_over() {
        thread::sleep(PAUSE);
    }
    let mut bridge = Command::new(std::env::current_exe()?.with_file_name("dibs"));
    bridge.arg("bridge").arg(&tree).args([
        "--json",
        "--window",
        ON_THEIR_WAY,
        "--motion-rate",
        MOST,
    ]);
    bridge.arg("--from").arg(format!("igtl:{}", listener.local_addr()?));
    bridge.arg("--to").arg(format!("udp:{}", relay.to));
    bridge.stdout(Stdio::piped()).stderr(File::create(&said)?);
    let bridge = Guard(bridge.spawn().context("cannot start `dibs`, which cargo builds")?);
    let totals = pass(scene, link, bridge, &listener, relay);
    totals.with_context(|| {
        format!("`dibs bridge` said: {}", fs::read_to_string(&said).unwrap_or_default())
    })
}

/// Lets the program send until the controller ends. Returns its totals.
fn pass(
    scene: &Scene,
    link: &Link,
    mut bridge: Guard,
    listener: &TcpListener,
    relay: Relay,
) -> Result<Value> {
    let mut peer = accept(listener)?;
    let played = thread::scope(|scope| {
        let relayed = scope.spawn(|| relay.run(link));
        play(scene, link, &mut peer).and(joined(relayed.join()))
    });
    // It prints its totals when it is interrupted.
    run(Command::new("kill").args(["-INT", &bridge.0.id().to_string()]))?;
    let mut totals = String::new();
    bridge.0.stdout.take().context("no output")?.read_to_string(&mut totals)?;
    played?;
    Ok(serde_json::from_str(&totals)?)
}

/// Sends a message for each frame, at the motion's rate by the board's clock.
fn play(scene: &Scene, link: &Link, peer: &mut TcpStream) -> Result<()> {
    let (frames, rate) = Bus::Bridge.frames(&scene.motion, scene.rate);
    let interval = (TICK_RATE as f32 / rate) as u32;
    let order = order(scene)?;
    let mut due = link.now();
    for (epoch, positions) in (1..).zip(frames.iter().cycle()) {
        while link.now() < due {
            thread::sleep(PAUSE);
            if link.is_over() {
                return Ok(());
            }
        }
        let message =
            igtl_messages::message(1, "NDARRAY", "heart", &igtl_messages::array(positions));
        link.record(epoch, order.to_rows(positions)?, link.now());
        peer.write_all(&message)?;
        link.frames_sent.fetch_add(1, Ordering::Relaxed);
        due = (due + interval).max(link.now().saturating_sub(interval));
    }
    Ok(())
}

/// The network between program and board at the board's speed, which is below this computer's: datagrams wait for room in the
/// board's buffer, which the emulator's own network does not do.
struct Relay {
    to: SocketAddr,
    program: UdpSocket,
    board: UdpSocket,
    paced: Paced<Datagrams>,
}

/// A datagram each write.
struct Datagrams(UdpSocket);

impl Write for Datagrams {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.send(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Relay {
    fn new(link: &Arc<Link>, port: u16) -> Result<Self> {
        let [program, board] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0"));
        let (program, board) = (program?, board?);
        board.connect(("127.0.0.1", port))?;
        program.set_read_timeout(Some(GLANCE))?;
        board.set_nonblocking(true)?;
        let paced = paced(Datagrams(board.try_clone()?), link, WINDOW);
        Ok(Self { to: program.local_addr()?, program, board, paced })
    }

    /// Passes datagrams on, both ways, until the controller ends.
    fn run(self, link: &Link) -> Result<()> {
        let Self { program, board, mut paced, .. } = self;
        let (waiting, come) = mpsc::channel::<Vec<u8>>();
        thread::scope(|scope| {
            scope.spawn(move || {
                for datagram in come {
                    // Fails only once the controller has ended.
                    let _ = paced.write(&datagram).and_then(|_| paced.flush());
                }
            });
            let mut buffer = [0; 2_048];
            let mut from = None;
            while !link.is_over() {
                if let Ok((bytes, sender)) = program.recv_from(&mut buffer) {
                    from = Some(sender);
                    waiting.send(buffer[..bytes].to_vec())?;
                }
                while let Ok(bytes) = board.recv(&mut buffer) {
                    from.map(|from| program.send_to(&buffer[..bytes], from)).transpose()?;
                }
            }
            drop(waiting);
            Ok(())
        })
    }
}

/// The program's connection.
fn accept(listener: &TcpListener) -> Result<TcpStream> {
    listener.set_nonblocking(true)?;
    let start = Instant::now();
    loop {
        if let Ok((peer, _)) = listener.accept() {
            peer.set_nonblocking(false)?;
            // Else a message may wait until the bridge's system acknowledges the one before.
            peer.set_nodelay(true)?;
            return Ok(peer);
        }
        ensure!(start.elapsed() < PATIENCE, "`dibs bridge` does not connect");
        thread::sleep(Duration::from_millis(5));
    }
}

/// Ends the program when the run fails halfway.
struct Guard(Child);

impl Drop for Guard {
    fn drop(&mut self) {
        // Both fail only if it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
