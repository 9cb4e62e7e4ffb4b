//! Frames in memory shared with another program.
//!
//! The memory is little-endian: a sequence number (u64), the number of positions (u32), 0 (u32), and x, y and z of each
//! position (f32). The sequence number is 0 as long as there is no frame, odd while a frame is written, and even once
//! it is complete.

use super::parse::RAW;
use anyhow::{Context, Result, bail};
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

/// Bytes before the positions.
const HEADER: usize = 16;

/// Interval at which the sequence number is polled.
const GLANCE: Duration = Duration::from_micros(200);

/// Returns the bytes of each complete frame once, until the memory is removed.
pub struct Memory {
    file: File,
    /// The sequence number of the frame in `bytes`.
    sequence: u64,
    bytes: Vec<u8>,
    /// Number of its bytes that were returned.
    given: usize,
}

impl Memory {
    /// Opens POSIX shared memory by its name.
    pub fn open(name: &str, positions: usize) -> Result<Self> {
        let path = PathBuf::from("/dev/shm").join(name);
        let file = File::open(&path).with_context(|| {
            format!(
                "shm:{name}: cannot be opened; start the program that writes frames there first"
            )
        })?;
        let bytes = vec![0; RAW * positions];
        let memory = Self { file, sequence: 0, given: bytes.len(), bytes };
        let mut header = [0; HEADER];
        let is_header = memory.read_at(&mut header, 0).is_ok();
        let found = u32::from_le_bytes([header[8], header[9], header[10], header[11]]);
        if !is_header || header[12..] != [0; 4] {
            bail!(
                "shm:{name}: no frames: give a sequence number (u64), the number of positions (u32), 0 (u32), and x, y and z of \
                 each position as f32"
            );
        }
        let size = memory.file.metadata()?.len();
        if found as usize != positions || size < (HEADER + RAW * positions) as u64 {
            bail!(
                "shm:{name}: {size} bytes with frames of {found} positions, and the tree's are of {positions}: give the mesh's \
                 vertices, or the nodes of its volume"
            );
        }
        Ok(memory)
    }

    #[cfg(unix)]
    fn read_at(&self, bytes: &mut [u8], offset: usize) -> io::Result<()> {
        use std::os::unix::fs::FileExt;
        self.file.read_exact_at(bytes, offset as u64)
    }

    #[cfg(not(unix))]
    fn read_at(&self, _: &mut [u8], _: usize) -> io::Result<()> {
        Err(io::Error::other("this system has no shared memory by name"))
    }

    #[cfg(unix)]
    fn is_removed(&self) -> io::Result<bool> {
        use std::os::unix::fs::MetadataExt;
        Ok(self.file.metadata()?.nlink() == 0)
    }

    #[cfg(not(unix))]
    fn is_removed(&self) -> io::Result<bool> {
        Ok(true)
    }

    fn now(&self) -> io::Result<u64> {
        let mut number = [0; 8];
        self.read_at(&mut number, 0)?;
        Ok(u64::from_le_bytes(number))
    }

    /// Waits for a complete frame. Returns whether there is one.
    fn wait(&mut self) -> io::Result<bool> {
        loop {
            let before = self.now()?;
            if before == 0 {
                // A restarted writer counts from zero.
                self.sequence = 0;
            }
            if before != self.sequence && before.is_multiple_of(2) {
                let mut bytes = std::mem::take(&mut self.bytes);
                let read = self.read_at(&mut bytes, HEADER);
                self.bytes = bytes;
                read?;
                if self.now()? == before {
                    (self.sequence, self.given) = (before, 0);
                    return Ok(true);
                }
            } else if self.is_removed()? {
                return Ok(false);
            } else {
                thread::sleep(GLANCE);
            }
        }
    }
}

impl Read for Memory {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.given == self.bytes.len() && !out.is_empty() {
            match self.wait() {
                Ok(true) => (),
                Ok(false) => return Ok(0),
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                    return Err(io::Error::other("the memory was cut short"));
                }
                Err(error) => return Err(error),
            }
        }
        let rest = &self.bytes[self.given..];
        let count = rest.len().min(out.len());
        out[..count].copy_from_slice(&rest[..count]);
        self.given += count;
        Ok(count)
    }
}
