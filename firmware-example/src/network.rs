//! The network end of the bus: packets in Ethernet frames, with ARP, IPv4 and UDP.
//!
//! It is as small as the bus allows: one address, one port, no fragments, no options, and one peer, the sender of the
//! last good packet. `docs/decisions.md` says why it is not a whole network stack.

// Requirement: P-05

use etherparse::checksum::Sum16BitWords;
use etherparse::{
    ArpEthIpv4Packet, ArpOperation, ArpPacketSlice, EtherType, Ethernet2Header, Ethernet2Slice,
    IpNumber, Ipv4Header, Ipv4Slice, UdpHeader, UdpSlice,
};

use crate::STATUS_MTU;

/// The controller's hardware address, locally administered.
pub const HARDWARE: [u8; 6] = [0x02, 0, 0, 0, 0, 0x15];

/// The controller's address: the one that QEMU's user network gives to its first guest.
pub const ADDRESS: [u8; 4] = [10, 0, 2, 15];

/// The controller's port.
pub const PORT: u16 = 5000;

/// Largest Ethernet frame in bytes, with its checksum, rounded up to whole words.
pub const MAX_FRAME: usize = 1520;

/// Bytes of the headers before a packet: Ethernet, IPv4 without options, UDP.
const HEADERS: usize = 14 + 20 + 8;

/// Largest frame that the controller sends, in bytes.
pub const MAX_REPLY: usize = HEADERS + STATUS_MTU;

/// Size of an ARP frame, in bytes.
pub const ARP_FRAME: usize = 14 + 28;

/// Time to live of a status.
const TIME_TO_LIVE: u8 = 64;

const BROADCAST: [u8; 6] = [0xFF; 6];

/// A host that has sent packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peer {
    hardware: [u8; 6],
    address: [u8; 4],
    port: u16,
}

/// The content of a frame.
#[derive(Debug, PartialEq, Eq)]
pub enum Content<'f> {
    /// A packet for the controller's port, not yet checked.
    Packet(&'f [u8], Peer),
    /// An ARP request for the controller's hardware address, and the reply.
    Question([u8; ARP_FRAME]),
    /// Anything else.
    Other,
}

/// Parses a frame that has passed its Ethernet checksum and is without it.
#[must_use]
pub fn read(frame: &[u8]) -> Content<'_> {
    let content = Ethernet2Slice::from_slice_without_fcs(frame).ok().and_then(|frame| {
        let is_ours = frame.destination() == HARDWARE;
        match frame.ether_type() {
            EtherType::IPV4 if is_ours => packet(&frame),
            EtherType::ARP if is_ours || frame.destination() == BROADCAST => answer(&frame),
            _ => None,
        }
    });
    content.unwrap_or(Content::Other)
}

fn packet<'f>(frame: &Ethernet2Slice<'f>) -> Option<Content<'f>> {
    let datagram = Ipv4Slice::from_slice(frame.payload_slice()).ok()?;
    let header = datagram.header();
    // The complement of the sum of an intact header, including its checksum, is zero.
    let is_intact = Sum16BitWords::new().add_slice(header.slice()).ones_complement() == 0;
    let is_ours = header.destination() == ADDRESS
        && datagram.payload_ip_number() == IpNumber::UDP
        && !datagram.is_payload_fragmented();
    if !is_intact || !is_ours {
        return None;
    }
    // UDP's checksum is not needed: a packet has its own CRC-32, which detects more.
    let udp = UdpSlice::from_slice(datagram.payload().payload).ok()?;
    let (hardware, address) = (frame.source(), header.source());
    let peer = Peer { hardware, address, port: udp.source_port() };
    (udp.destination_port() == PORT).then_some(Content::Packet(udp.payload(), peer))
}

fn answer<'f>(frame: &Ethernet2Slice<'f>) -> Option<Content<'f>> {
    let question = ArpPacketSlice::from_slice(frame.payload_slice()).ok()?;
    let question = ArpEthIpv4Packet::try_from(question.to_packet()).ok()?;
    if question.operation != ArpOperation::REQUEST || question.target_ipv4 != ADDRESS {
        return None;
    }
    let (hardware, address) = (question.sender_mac, question.sender_ipv4);
    Some(Content::Question(arp(ArpOperation::REPLY, hardware, hardware, address)))
}

fn arp(
    operation: ArpOperation,
    destination: [u8; 6],
    target_mac: [u8; 6],
    target_ipv4: [u8; 4],
) -> [u8; ARP_FRAME] {
    let (sender_mac, sender_ipv4) = (HARDWARE, ADDRESS);
    let content = ArpEthIpv4Packet { operation, sender_mac, sender_ipv4, target_mac, target_ipv4 };
    let mut frame = [0; ARP_FRAME];
    // The sizes fit, so nothing is cut off.
    let _ = join(&mut frame, &[&head(destination, EtherType::ARP), &content.to_bytes()]);
    frame
}

/// A frame that announces the controller's addresses to all (gratuitous ARP), sent at the start: requests before that
/// were not answered.
#[must_use]
pub fn announcement() -> [u8; ARP_FRAME] {
    arp(ArpOperation::REQUEST, BROADCAST, [0; 6], ADDRESS)
}

/// A frame that carries a status to a peer; `None` only if the status is too large.
#[must_use]
pub fn seal<'b>(status: &[u8], to: &Peer, frame: &'b mut [u8; MAX_REPLY]) -> Option<&'b [u8]> {
    let length = u16::try_from(UdpHeader::LEN + status.len()).ok()?;
    let mut ip = Ipv4Header::new(length, TIME_TO_LIVE, IpNumber::UDP, ADDRESS, to.address).ok()?;
    ip.header_checksum = ip.calc_header_checksum();
    let udp = UdpHeader::with_ipv4_checksum(PORT, to.port, &ip, status).ok()?;
    let head = head(to.hardware, EtherType::IPV4);
    let bytes = join(frame, &[&head, &ip.to_bytes(), &udp.to_bytes(), status])?;
    frame.get(..bytes)
}

fn head(destination: [u8; 6], ether_type: EtherType) -> [u8; 14] {
    Ethernet2Header { source: HARDWARE, destination, ether_type }.to_bytes()
}

/// Writes the parts one after another, and returns their total size; `None` if `out` is too small.
fn join(out: &mut [u8], parts: &[&[u8]]) -> Option<usize> {
    let mut rest = out.iter_mut();
    let mut bytes = 0;
    for &byte in parts.iter().copied().flatten() {
        *rest.next()? = byte;
        bytes += 1;
    }
    Some(bytes)
}
