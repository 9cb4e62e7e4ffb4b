//! A server by the crate openigtlink-rust: PORT FRAMES TRIANGLES KIND. Standard input has the triangles as big-endian u32,
//! and the frames as big-endian f32. A program of its own, so that nothing else depends on that crate.

// Requirement: B-10

use std::error::Error;
use std::io::Read;
use std::thread;
use std::time::Duration;

use openigtlink_rust::io::{IgtlConnection, IgtlServer};
use openigtlink_rust::protocol::message::{IgtlMessage, Message};
use openigtlink_rust::protocol::types::{NdArrayMessage, PointElement, PointMessage, ScalarType};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let (frames, triangles): (usize, usize) = (arguments[2].parse()?, arguments[3].parse()?);
    let mut data = Vec::new();
    std::io::stdin().read_to_end(&mut data)?;
    let positions = &data[12 * triangles..];
    let mut peer = IgtlServer::bind(&format!("127.0.0.1:{}", arguments[1]))?.accept()?;
    for frame in positions.chunks_exact(positions.len() / frames) {
        if arguments[4] == "POINT" {
            let points = frame.chunks_exact(12).map(|bytes| {
                let number = |at: usize| {
                    f32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
                };
                PointElement::new("", "", [0, 4, 8].map(number))
            });
            send(&mut peer, PointMessage::new(points.collect()))?;
        } else {
            let points = u16::try_from(frame.len() / 12)?;
            let array = NdArrayMessage::new_2d(ScalarType::Float32, points, 3, frame.to_vec())?;
            send(&mut peer, array)?;
        }
        thread::sleep(Duration::from_millis(5));
    }
    thread::sleep(Duration::from_secs(60));
    Ok(())
}

fn send<M: Message>(peer: &mut IgtlConnection, content: M) -> Result<(), Box<dyn Error>> {
    let mut message = IgtlMessage::new(content, "heart")?;
    // The crate says 2, which has an extended header, and writes none.
    message.header.version = 1;
    Ok(peer.send(&message)?)
}
