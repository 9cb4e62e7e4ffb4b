//! Tests the controller's network end with bytes assembled by hand from RFC 826, 791 and 768.

// Requirement: P-05

use controller::network::{ADDRESS, Content, HARDWARE, MAX_REPLY, PORT, announcement, read, seal};

/// The sender of the frames.
const OTHER: [u8; 6] = [0x52, 0x55, 10, 0, 2, 2];
const OTHER_ADDRESS: [u8; 4] = [10, 0, 2, 2];
const OTHER_PORT: u16 = 40_001;

const BROADCAST: [u8; 6] = [0xFF; 6];

/// Offsets of the IPv4 datagram in a frame, and of its UDP header.
const IP: usize = 14;
const UDP: usize = 34;

/// The Internet checksum of these bytes: 0 if they include their own.
fn checksum(parts: &[&[u8]]) -> u16 {
    let bytes: Vec<u8> = parts.concat();
    let words = bytes
        .chunks(2)
        .map(|pair| u32::from(u16::from_be_bytes([pair[0], pair.get(1).copied().unwrap_or(0)])));
    let sum: u32 = words.sum();
    let sum = (sum & 0xFFFF) + (sum >> 16);
    !((sum & 0xFFFF) + (sum >> 16)) as u16
}

fn head(destination: [u8; 6], kind: u16) -> Vec<u8> {
    [&destination[..], &OTHER, &kind.to_be_bytes()].concat()
}

/// A packet in a UDP datagram from the other host.
fn datagram(packet: &[u8]) -> Vec<u8> {
    let length = 28 + packet.len() as u16;
    let mut ip = vec![0x45, 0, 0, 0, 0x12, 0x34, 0, 0, 64, 17, 0, 0];
    ip[2..4].copy_from_slice(&length.to_be_bytes());
    ip.extend(OTHER_ADDRESS);
    ip.extend(ADDRESS);
    let sum = checksum(&[&ip]);
    ip[10..12].copy_from_slice(&sum.to_be_bytes());
    let mut frame = head(HARDWARE, 0x0800);
    frame.extend(ip);
    for field in [OTHER_PORT, PORT, 8 + packet.len() as u16, 0] {
        frame.extend(field.to_be_bytes());
    }
    frame.extend(packet);
    frame
}

/// The frame with a field changed, and a matching IPv4 checksum.
fn changed(frame: &[u8], at: usize, value: &[u8]) -> Vec<u8> {
    let mut frame = frame.to_vec();
    frame[at..at + value.len()].copy_from_slice(value);
    frame[IP + 10..IP + 12].fill(0);
    let sum = checksum(&[&frame[IP..UDP]]);
    frame[IP + 10..IP + 12].copy_from_slice(&sum.to_be_bytes());
    frame
}

fn arp(operation: u8, from: ([u8; 6], [u8; 4]), to: ([u8; 6], [u8; 4])) -> Vec<u8> {
    [&[0, 1, 8, 0, 6, 4, 0, operation], &from.0[..], &from.1, &to.0, &to.1].concat()
}

#[test]
fn a_question_for_the_address_is_answered_and_no_other() {
    let ask = |address| arp(1, (OTHER, OTHER_ADDRESS), ([0; 6], address));
    for destination in [BROADCAST, HARDWARE] {
        let question = [head(destination, 0x0806), ask(ADDRESS)].concat();
        let Content::Question(answer) = read(&question) else { panic!("no answer") };
        let mut expected = [&OTHER[..], &HARDWARE, &[8, 6]].concat();
        expected.extend(arp(2, (HARDWARE, ADDRESS), (OTHER, OTHER_ADDRESS)));
        assert_eq!(answer[..], expected);
        // Ethernet pads short frames.
        assert!(matches!(read(&[&question[..], &[0; 18]].concat()), Content::Question(_)));
    }
    let elsewhere = [head(BROADCAST, 0x0806), ask([10, 0, 2, 16])].concat();
    let to_others = [head(OTHER, 0x0806), ask(ADDRESS)].concat();
    let no_question = arp(2, (OTHER, OTHER_ADDRESS), (HARDWARE, ADDRESS));
    let no_question = [head(HARDWARE, 0x0806), no_question].concat();
    for frame in [elsewhere, to_others, no_question] {
        assert_eq!(read(&frame), Content::Other);
    }
    let mut expected = [&BROADCAST[..], &HARDWARE, &[8, 6]].concat();
    expected.extend(arp(1, (HARDWARE, ADDRESS), ([0; 6], ADDRESS)));
    assert_eq!(announcement()[..], expected);
}

#[test]
fn a_packet_is_taken_out_and_a_status_goes_back() {
    let packet: Vec<u8> = (0..200).collect();
    let frame = datagram(&packet);
    // Bytes after the datagram are not part of the packet.
    let padded = [&frame[..], &[0xEE; 4]].concat();
    for frame in [&frame, &padded] {
        let Content::Packet(found, _) = read(frame) else { panic!("no packet") };
        assert_eq!(found, packet);
    }
    let Content::Packet(_, peer) = read(&frame) else { panic!("no packet") };
    let (status, mut reply) = ([0xA5; 77], [0; MAX_REPLY]);
    let reply = seal(&status, &peer, &mut reply).expect("has room");
    assert_eq!(reply.len(), UDP + 8 + status.len());
    assert_eq!(reply[..IP], [&OTHER[..], &HARDWARE, &[8, 0]].concat());
    let (ip, udp) = (&reply[IP..UDP], &reply[UDP..]);
    assert_eq!(
        (ip[0], ip[9], &ip[12..16], &ip[16..20]),
        (0x45, 17, &ADDRESS[..], &OTHER_ADDRESS[..])
    );
    assert_eq!(u16::from_be_bytes([ip[2], ip[3]]), 28 + 77);
    assert_eq!(checksum(&[ip]), 0);
    let fields = [PORT, OTHER_PORT, 8 + 77].map(u16::to_be_bytes).concat();
    assert_eq!((&udp[..6], &udp[8..]), (&fields[..], &status[..]));
    assert_eq!(checksum(&[&ADDRESS, &OTHER_ADDRESS, &[0, 17], &udp[4..6], udp]), 0);
    assert!(seal(&[0; 97], &peer, &mut [0; MAX_REPLY]).is_none());
}

#[test]
fn frames_for_others_damaged_and_cut_off_ones_are_passed_over() {
    let frame = datagram(&[7; 100]);
    assert!(matches!(read(&changed(&frame, IP + 8, &[1])), Content::Packet(..)), "hops left");
    for (at, value, name) in [
        (0, &OTHER[..], "another hardware address"),
        (12, &[0x86, 0xDD], "IPv6"),
        (IP, &[0x46], "options longer than the header"),
        (IP, &[0x44], "a header too short"),
        (IP + 2, &[0xFF, 0xFF], "longer than the frame"),
        (IP + 6, &[0x20, 0], "more fragments"),
        (IP + 6, &[0, 1], "a later fragment"),
        (IP + 9, &[6], "TCP"),
        (IP + 16, &[10, 0, 2, 16], "another address"),
        (UDP + 2, &[0, 1], "another port"),
        (UDP + 4, &[0xFF, 0xFF], "a length beyond the datagram"),
        (UDP + 4, &[0, 7], "a length below its own header"),
    ] {
        assert_eq!(read(&changed(&frame, at, value)), Content::Other, "{name}");
    }
    for bit in 0..160 {
        let mut damaged = frame.clone();
        damaged[IP + bit / 8] ^= 1 << (bit % 8);
        assert_eq!(read(&damaged), Content::Other, "bit {bit} of the header");
    }
    for length in 0..frame.len() {
        assert_eq!(read(&frame[..length]), Content::Other, "{length} bytes");
    }
}
