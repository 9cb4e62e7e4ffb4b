//! A network that floods the controller: the sender's packets in garbage, repetitions, fragments, ARP and broadcasts.
//!
//! The emulator's socket backend accepts raw Ethernet frames, one a datagram, so that frames arrive that no network
//! stack would send.

use std::io::{self, Write};
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use anyhow::Result;
use controller::network::{ADDRESS, HARDWARE, PORT};
use dibs_stream::transport::Line;
use etherparse::{
    ArpEthIpv4Packet, ArpOperation, EtherType, Ethernet2Header, IpFragOffset, IpNumber, Ipv4Header,
    PacketBuilder, SlicedPacket, TransportSlice,
};
use fastrand::Rng;
use xtask::qemu;

use super::sender::Link;

/// Packets that the sender sends in one control tick: with twice as many the buffer would have no room for a flood.
const PACKETS_A_TICK: u32 = 3;

/// Frames of the flood in a control tick: ten times as many as the packets of 60 frames a second.
const FLOOD_A_TICK: usize = 20;

/// Ticks between two bursts, and frames of a burst: more than the board's buffer holds.
const STORM_EVERY: u32 = 50;
const STORM: usize = 150;

/// Ticks between two pauses of the flood, and ticks of a pause: a frame needs all of its packets, so without pauses it
/// depends on chance, and on the host's load, whether any arrives completely.
pub const CALM_EVERY: u32 = 1_000;
pub const CALM: u32 = 100;

const SENDER: ([u8; 6], [u8; 4], u16) = ([2, 0, 0, 0, 0, 2], [10, 0, 2, 2], 5001);

const BROADCAST: [u8; 6] = [0xFF; 6];

/// Interval at which the controller's tick is polled.
const PAUSE: Duration = Duration::from_micros(200);

/// A network without a switch, shared by both ends and the flood.
pub struct Wire {
    socket: UdpSocket,
    /// Frames with packets of the sender, to be repeated.
    sent: Arc<Mutex<Vec<Vec<u8>>>>,
}

impl Wire {
    /// A network, and the controller's end of it.
    pub fn new() -> Result<(Self, qemu::Bus)> {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        let own = socket.local_addr()?;
        // The emulator binds a port that was free a moment ago.
        let board = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?;
        socket.connect(board)?;
        socket.set_read_timeout(Some(Duration::from_millis(50)))?;
        let backend = format!("socket,udp={own},localaddr={board}");
        Ok((Self { socket, sent: Arc::default() }, qemu::Bus::Ethernet(backend)))
    }

    /// The sender's end.
    pub fn line(&self, link: &Arc<Link>) -> Result<Line> {
        let writer = Frames { wire: self.share()?, link: Arc::clone(link), tick: 0, count: 0 };
        let socket = self.socket.try_clone()?;
        let mut frame = [0; 2048];
        Ok(Line::datagrams(writer, move |buffer| {
            let bytes = or_refused(socket.recv(&mut frame))?;
            let packet = SlicedPacket::from_ethernet(&frame[..bytes]).ok();
            let Some(TransportSlice::Udp(udp)) = packet.and_then(|packet| packet.transport) else {
                return Ok(0);
            };
            let is_status = udp.destination_port() == SENDER.2;
            let packet = if is_status { udp.payload() } else { &[] };
            let room = buffer.get_mut(..packet.len()).ok_or(io::ErrorKind::InvalidData)?;
            room.copy_from_slice(packet);
            Ok(packet.len())
        }))
    }

    /// Another handle to the same network.
    pub fn share(&self) -> io::Result<Self> {
        Ok(Self { socket: self.socket.try_clone()?, sent: Arc::clone(&self.sent) })
    }

    /// Floods the controller until it ends, with pauses. Returns the number of frames sent.
    pub fn flood(&self, link: &Link, seed: u64) -> Result<u64> {
        let mut rng = Rng::with_seed(seed);
        let (mut tick, mut count) = (0, 0);
        while !link.is_over() {
            let now = link.now();
            if now == tick {
                thread::sleep(PAUSE);
                continue;
            }
            let is_storm = now / STORM_EVERY != tick / STORM_EVERY;
            tick = now;
            if now % CALM_EVERY >= CALM_EVERY - CALM {
                continue;
            }
            let storm = rng.usize(..KINDS.len());
            for _ in 0..if is_storm { STORM } else { FLOOD_A_TICK } {
                let kind = if is_storm { storm } else { rng.usize(..KINDS.len()) };
                if let Some(frame) = KINDS[kind](&mut rng, self) {
                    or_refused(self.socket.send(&frame))?;
                    count += 1;
                }
            }
        }
        Ok(count)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Vec<u8>>> {
        self.sent.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Makes a frame of one kind; `None` if it needs a frame that was sent before.
type Kind = fn(&mut Rng, &Wire) -> Option<Vec<u8>>;

/// The kinds of frames in the flood.
const KINDS: [Kind; 9] = [noise, garbage, cut, repeat, repeat, fragment, question, broadcast, lie];

/// Random bytes after the controller's hardware address.
fn noise(rng: &mut Rng, _: &Wire) -> Option<Vec<u8>> {
    Some([&HARDWARE[..], &bytes(rng, 8, 400)].concat())
}

/// A random packet for the controller's port.
fn garbage(rng: &mut Rng, _: &Wire) -> Option<Vec<u8>> {
    let packet = bytes(rng, 0, 300);
    Some(frame(&packet))
}

/// The start of a packet.
fn cut(rng: &mut Rng, wire: &Wire) -> Option<Vec<u8>> {
    let mut frame = repeat(rng, wire)?;
    frame.truncate(rng.usize(14..frame.len()));
    Some(frame)
}

/// A repetition of one of the sender's packets.
fn repeat(rng: &mut Rng, wire: &Wire) -> Option<Vec<u8>> {
    rng.choice(wire.lock().iter()).cloned()
}

/// A fragment of a packet.
fn fragment(rng: &mut Rng, wire: &Wire) -> Option<Vec<u8>> {
    let packet = bytes(rng, 8, 300);
    let mut ip = Ipv4Header::new(packet.len() as u16, 64, IpNumber::UDP, SENDER.1, ADDRESS).ok()?;
    ip.more_fragments = rng.bool();
    ip.fragment_offset = IpFragOffset::try_new(rng.u16(1..8_000)).ok()?;
    ip.header_checksum = ip.calc_header_checksum();
    // Sometimes a complete packet that claims to be a fragment.
    let whole = repeat(rng, wire)?;
    let packet = if rng.bool() { &packet } else { whole.get(34..)? };
    Some([&head(HARDWARE, EtherType::IPV4)[..], &ip.to_bytes(), packet].concat())
}

/// An ARP request for the controller's hardware address, or for another.
fn question(rng: &mut Rng, _: &Wire) -> Option<Vec<u8>> {
    let question = ArpEthIpv4Packet {
        operation: if rng.bool() { ArpOperation::REQUEST } else { ArpOperation(rng.u16(..)) },
        sender_mac: SENDER.0,
        sender_ipv4: SENDER.1,
        target_mac: [0; 6],
        target_ipv4: if rng.bool() { ADDRESS } else { rng.u32(..).to_be_bytes() },
    };
    Some([&head(BROADCAST, EtherType::ARP)[..], &question.to_bytes()].concat())
}

/// A broadcast with random content.
fn broadcast(rng: &mut Rng, _: &Wire) -> Option<Vec<u8>> {
    Some([&head(BROADCAST, EtherType(rng.u16(..)))[..], &bytes(rng, 46, 600)].concat())
}

/// A packet with wrong bits in its headers: versions, lengths, checksums, addresses, ports.
fn lie(rng: &mut Rng, wire: &Wire) -> Option<Vec<u8>> {
    let mut frame = repeat(rng, wire)?;
    for _ in 0..rng.usize(1..4) {
        let bit = rng.usize(12 * 8..42 * 8);
        *frame.get_mut(bit / 8)? ^= 1 << (bit % 8);
    }
    Some(frame)
}

fn bytes(rng: &mut Rng, least: usize, most: usize) -> Vec<u8> {
    let length = rng.usize(least..most);
    std::iter::repeat_with(|| rng.u8(..)).take(length).collect()
}

fn head(destination: [u8; 6], ether_type: EtherType) -> [u8; 14] {
    Ethernet2Header { source: SENDER.0, destination, ether_type }.to_bytes()
}

/// A packet from the sender.
fn frame(packet: &[u8]) -> Vec<u8> {
    let (hardware, address, port) = SENDER;
    let builder =
        PacketBuilder::ethernet2(hardware, HARDWARE).ipv4(address, ADDRESS, 64).udp(port, PORT);
    let mut frame = Vec::with_capacity(builder.size(packet.len()));
    builder.write(&mut frame, packet).expect("a packet of the bus fits a datagram");
    frame
}

/// The sender's packets as Ethernet frames, a few in each control tick.
struct Frames {
    wire: Wire,
    link: Arc<Link>,
    tick: u32,
    count: u32,
}

impl Write for Frames {
    fn write(&mut self, packet: &[u8]) -> io::Result<usize> {
        while self.count >= PACKETS_A_TICK && self.link.now() == self.tick {
            if self.link.is_over() {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            thread::sleep(PAUSE);
        }
        if self.link.now() != self.tick {
            (self.tick, self.count) = (self.link.now(), 0);
        }
        self.count += 1;
        let frame = frame(packet);
        or_refused(self.wire.socket.send(&frame))?;
        let mut sent = self.wire.lock();
        sent.push(frame);
        let old = sent.len().saturating_sub(100);
        sent.drain(..old);
        Ok(packet.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The emulator may not have bound its port yet, or have ended: then a datagram is lost.
fn or_refused(result: io::Result<usize>) -> io::Result<usize> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => Ok(0),
        result => result,
    }
}
