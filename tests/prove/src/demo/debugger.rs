//! A debugger that changes one byte of the emulated board's memory as it runs, by the GDB remote protocol of QEMU.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;

use anyhow::{Context, Result, ensure};

/// Some bits of one byte of the board's memory.
#[derive(Clone, Copy)]
pub struct Bits {
    pub address: u32,
    pub mask: u8,
}

/// Flips bits on the board whose emulator listens at the socket; the board is paused meanwhile.
pub fn flip(socket: &Path, bits: Bits) -> Result<()> {
    let mut board = UnixStream::connect(socket)?;
    let Bits { address, mask } = bits;
    let before = ask(&mut board, &format!("m{address:x},1"))?;
    let before = u8::from_str_radix(&before, 16);
    let after = before.with_context(|| format!("the emulator does not read {address:#x}"))? ^ mask;
    let done = ask(&mut board, &format!("M{address:x},1:{after:02x}"))?;
    ensure!(done == "OK", "the emulator does not write to {address:#x}: {done}");
    let now = ask(&mut board, &format!("m{address:x},1"))?;
    ensure!(now == format!("{after:02x}"), "{address:#x} holds {now} after it was written");
    // The board continues when the debugger detaches.
    ask(&mut board, "D").map(drop)
}

/// Sends a packet, `$TEXT#SUM`, and returns the text of the answer.
fn ask(board: &mut UnixStream, text: &str) -> Result<String> {
    let sum = text.bytes().fold(0_u8, u8::wrapping_add);
    board.write_all(format!("${text}#{sum:02x}").as_bytes())?;
    loop {
        let answer = receive(board)?;
        // The emulator may report at any time that the board has stopped.
        if !answer.starts_with('T') {
            return Ok(answer);
        }
    }
}

fn receive(board: &mut UnixStream) -> Result<String> {
    let mut answer = String::new();
    let mut byte = [0];
    loop {
        board.read_exact(&mut byte)?;
        match byte[0] {
            // Earlier bytes, such as the acknowledgement, are not part of the answer.
            b'$' => answer.clear(),
            b'#' => break,
            byte => answer.push(byte.into()),
        }
    }
    board.read_exact(&mut [0; 2])?;
    board.write_all(b"+")?;
    Ok(answer)
}
