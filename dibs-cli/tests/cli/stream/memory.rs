//! `dibs stream --from shm:NAME`: whole frames of shared memory reach a receiver.

// Requirements: B-09, B-10

use std::fs::{self, File};
use std::net::TcpListener;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use dibs_build::Motion;
use dibs_build::glam::Vec3;
use dibs_nostd::wire::NoMac;

use super::receiver::{Bytes, receive};
use super::{N, assert_all, heart, raw, spawn, totals};

/// Shared memory that is removed with this.
struct Memory {
    path: PathBuf,
    file: File,
    sequence: u64,
}

impl Memory {
    fn new(what: &str, positions: usize) -> Self {
        let path = PathBuf::from(format!("/dev/shm/dibs-{what}-{}", std::process::id()));
        let file = File::options().create(true).truncate(true).write(true).read(true).open(&path);
        let memory = Self { path, file: file.unwrap(), sequence: 0 };
        memory.file.set_len(16 + 12 * positions as u64).unwrap();
        memory.file.write_all_at(&(positions as u32).to_le_bytes(), 8).unwrap();
        memory
    }

    fn name(&self) -> &str {
        self.path.file_name().unwrap().to_str().unwrap()
    }

    fn step(&mut self) {
        self.count_from(self.sequence + 1);
    }

    fn count_from(&mut self, sequence: u64) {
        self.sequence = sequence;
        self.file.write_all_at(&self.sequence.to_le_bytes(), 0).unwrap();
    }

    /// Writes a frame in two halves, with time between them for a reader that does not wait.
    fn write(&mut self, frame: &[Vec3]) {
        let bytes = raw(frame);
        let (first, second) = bytes.split_at(bytes.len() / 2);
        self.step();
        self.file.write_all_at(first, 16).unwrap();
        thread::sleep(Duration::from_millis(5));
        self.file.write_all_at(second, 16 + first.len() as u64).unwrap();
        self.step();
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Every frame arrives, to the bit, and none that was half written, from a writer that starts over in between, too; the
/// stream ends where the memory is removed.
#[test]
fn whole_frames_of_shared_memory_arrive() {
    let folder = heart();
    let folder = folder.path();
    let frames = Motion::read_pc2(folder.join("heart.pc2")).unwrap().frames;
    let mut memory = Memory::new("frames", N);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let to = listener.local_addr().unwrap();
    let line = format!("--from shm:{} --motion-rate 1000 --to tcp:{to}", memory.name());
    let child = spawn(folder, &line);
    let (socket, _) = listener.accept().unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    let writer = thread::spawn(move || {
        for (number, frame) in frames.iter().enumerate() {
            if number == 1 {
                // Half of another run's frame, and later the same number as that of the frame before.
                memory.count_from(0);
                memory.file.write_all_at(&raw(&frames[9])[..3_000], 16).unwrap();
                thread::sleep(Duration::from_millis(60));
            }
            memory.write(frame);
            thread::sleep(Duration::from_millis(60));
        }
    });
    let (seen, output) = receive(folder, &mut Bytes::new(socket), NoMac, child);
    writer.join().unwrap();
    assert_all(&seen, &totals(&output));
    assert_eq!(seen.error, 0.0);
}

#[test]
fn memory_that_holds_no_frames_is_one_sentence() {
    let folder = heart();
    let folder = folder.path();
    let (few, short) = (Memory::new("few", N - 1), Memory::new("short", N));
    short.file.set_len(12).unwrap();
    let cut = Memory::new("cut", N);
    cut.file.set_len(4_000).unwrap();
    for (source, code, part) in [
        (few.name(), 1, "frames of 501 positions, and the tree's are of 502"),
        (short.name(), 1, "no frames: give a sequence number"),
        (cut.name(), 1, "4000 bytes with frames of 502 positions"),
        ("dibs-nobody", 1, "start the program that writes frames there first"),
        ("a/b", 2, "give - for standard input, or shm:NAME"),
    ] {
        let child = spawn(folder, &format!("--from shm:{source} --to udp:127.0.0.1:9"));
        let output = child.wait_with_output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(code) && error.contains(part), "{source}: {error}");
    }
    let child =
        spawn(folder, &format!("--from shm:{} --format json --to udp:127.0.0.1:9", few.name()));
    let error = String::from_utf8(child.wait_with_output().unwrap().stderr).unwrap();
    assert!(error.contains("frames in shared memory are raw"), "{error}");
}
