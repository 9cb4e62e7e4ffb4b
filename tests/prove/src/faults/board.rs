//! The receiver on the emulated board: every byte goes through its UART.

use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use dibs_nostd::wire::{Body, Counters, Deframer, Mac, Packet};
use probe::bus::{HEAD_BYTES, REPORT_MTU};
use tempfile::TempDir;

use super::subject::{LIMIT, Log, Receiver, TREE};

/// Timeout of an operation on the board.
const PATIENCE: Duration = Duration::from_secs(30);

/// A board that runs the probe `bus`.
pub struct Board {
    emulator: Child,
    line: UnixStream,
    deframer: Deframer<{ HEAD_BYTES + REPORT_MTU }>,
    sent: u32,
    received: Option<u32>,
    status: Vec<u8>,
    counters: Counters,
    published: u32,
    wrong: u64,
    /// The folder of the emulator and its socket.
    _folder: TempDir,
}

impl Board {
    pub fn boot<M: Mac>(program: &Path, mac: &M) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let blob = TREE.blob();
        let challenge = u32::try_from(mac.challenge())?;
        let head = [u32::from(M::TAGGED), challenge, LIMIT.to_bits(), blob.len() as u32];
        let script = [head.map(u32::to_le_bytes).as_flattened(), blob].concat();
        fs::write(folder.path().join("script.bin"), script)?;
        let socket = UnixListener::bind(folder.path().join("bus"))?;
        let mut qemu = Command::new("qemu-system-arm");
        qemu.args(["-machine", "mps2-an500", "-cpu", "cortex-m7", "-display", "none"]);
        qemu.args(["-monitor", "none", "-serial", "unix:bus"]);
        qemu.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(program);
        qemu.current_dir(folder.path()).stdin(Stdio::null());
        let mut emulator = qemu.spawn().context("qemu-system-arm does not start")?;
        let line = match accept(&socket, &mut emulator) {
            Ok(line) => line,
            Err(error) => {
                emulator.kill()?;
                emulator.wait()?;
                return Err(error);
            }
        };
        line.set_read_timeout(Some(PATIENCE))?;
        let mut board = Self {
            emulator,
            line,
            deframer: Deframer::new(),
            sent: 0,
            received: None,
            status: Vec::new(),
            counters: Counters::new(),
            published: 0,
            wrong: 0,
            _folder: folder,
        };
        board.wait(&Log::default())?;
        Ok(board)
    }

    /// Waits until all sent bytes are processed.
    fn wait(&mut self, log: &Log) -> Result<()> {
        let mut buffer = [0; 512];
        while self.received != Some(self.sent) {
            let bytes = self.line.read(&mut buffer).context("the board does not answer")?;
            ensure!(bytes > 0, "the board has stopped");
            for &byte in &buffer[..bytes] {
                let report = match self.deframer.push(byte) {
                    None => continue,
                    Some(report) => report.context("a report of the board is damaged")?.to_vec(),
                };
                self.take(&report, log)?;
            }
        }
        Ok(())
    }

    fn take(&mut self, report: &[u8], log: &Log) -> Result<()> {
        let (head, status) = report.split_at_checked(HEAD_BYTES).context("a short report")?;
        let mut words = head.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes));
        let mut word = || words.next().context("a short report");
        let (received, published, epoch, digest) = (word()?, word()?, word()?, word()?);
        let Body::Status(counted) = Packet::decode(status)?.body else {
            bail!("the board reported something else")
        };
        self.counters.update(&counted);
        if published != self.published {
            let is_right = published == self.published + 1 && log.has_digest(epoch, digest);
            self.wrong += u64::from(!is_right);
        }
        (self.published, self.received) = (published, Some(received));
        self.status = status.to_vec();
        Ok(())
    }

    fn deliver(&mut self, bytes: &[u8], log: &Log) -> Result<()> {
        self.line.write_all(bytes)?;
        self.sent = self.sent.wrapping_add(bytes.len() as u32);
        self.wait(log)
    }
}

fn accept(socket: &UnixListener, emulator: &mut Child) -> Result<UnixStream> {
    socket.set_nonblocking(true)?;
    let start = Instant::now();
    loop {
        match socket.accept() {
            Ok((line, _)) => {
                line.set_nonblocking(false)?;
                return Ok(line);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                let ended = emulator.try_wait()?;
                ensure!(ended.is_none(), "the emulator ended before it connected");
                ensure!(start.elapsed() < PATIENCE, "the emulator does not connect");
                thread::sleep(Duration::from_millis(2));
            }
            Err(error) => return Err(error.into()),
        }
    }
}

impl Receiver for Board {
    fn counters(&self) -> &Counters {
        &self.counters
    }

    fn status(&mut self) -> Vec<u8> {
        self.status.clone()
    }

    fn message(&mut self, _: &[u8], _: &Log) {
        unreachable!("a UART is a byte stream");
    }

    fn bytes(&mut self, bytes: &[u8], log: &Log) {
        self.deliver(bytes, log).expect("the board answers");
    }

    fn published(&self) -> u32 {
        self.published
    }

    fn wrong(&self) -> u64 {
        self.wrong
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // Both fail only if the emulator has ended already.
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}
