//! Checks that no query sees vertices of two epochs while the bus interrupt fires throughout. In a controller the query
//! preempts the bus. Here the bus preempts the query, which is worse.
//!
//! Reads from `script.bin` the number of queries, the length of a tree of [`VERTICES`] vertices with its rest shape,
//! and the tree. Writes five words to `answers.bin`: queries, queries that saw two epochs, frames published,
//! publications refused during a read, and queries that saw two epochs on a table without the protocol.
#![no_std]
#![no_main]

#[path = "../board/exit.rs"]
mod exit;
#[path = "../board/files.rs"]
mod files;

use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::interrupt::{self, Mutex};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{Peripherals, SYST};
use cortex_m_rt::{entry, exception};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    FrameLabel, FrameWriter, Frames, Millis, Options, Query, Sphere, Tree, VertexTable,
};
use exit::exit;

/// Vertices of the surface: an octahedron's, split three times.
const VERTICES: usize = 258;
/// Vertices that one interrupt writes.
const SHARE: usize = 16;
/// Without an FPU all work takes about eight times as long, and so do the interrupts' intervals.
const SLOWER: u32 = if cfg!(feature = "no-swap") { 3 } else { 0 };

static FRAMES: Frames<VERTICES> = Frames::new();
/// The same positions without the protocol: one buffer that is both written and read.
static PLAIN: [[AtomicU32; 3]; VERTICES] = [const { [const { AtomicU32::new(0) }; 3] }; VERTICES];
static SENDER: Mutex<RefCell<Option<Sender>>> = Mutex::new(RefCell::new(None));
static BYTES: Mutex<RefCell<[u8; 64 * 1024]>> = Mutex::new(RefCell::new([0; 64 * 1024]));
static PUBLISHED: AtomicU32 = AtomicU32::new(0);
static PUT_OFF: AtomicU32 = AtomicU32::new(0);

/// The interrupt's state.
struct Sender {
    writer: FrameWriter<'static>,
    rest: [Vec3; VERTICES],
    epoch: u32,
    next: usize,
    random: u32,
}

/// A vertex's position in an epoch.
fn placed(rest: Vec3, epoch: u32) -> Vec3 {
    rest + Vec3::X * (epoch % 64) as f32
}

impl Sender {
    /// Writes the next vertices, and publishes a complete frame.
    fn interrupt(&mut self) {
        if self.next == 0 {
            self.epoch = self.epoch.wrapping_add(1);
            self.writer.begin();
        }
        let share = self.rest.iter().enumerate().skip(self.next).take(SHARE);
        for (row, &rest) in share {
            let position = placed(rest, self.epoch);
            // Every row is inside the table.
            let _ = self.writer.push(position);
            if let Some(words) = PLAIN.get(row) {
                for (word, value) in words.iter().zip(position.to_array()) {
                    word.store(value.to_bits(), Ordering::Relaxed);
                }
            }
        }
        self.next += SHARE;
        if self.next >= VERTICES {
            self.next = 0;
            let label = FrameLabel {
                epoch: self.epoch,
                received: Millis(0),
                position_error: 0.0,
                stretch: None,
            };
            let counter = if self.writer.publish(label).is_ok() { &PUBLISHED } else { &PUT_OFF };
            // Nobody else writes it.
            counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
        // Irregular intervals interrupt queries at every place.
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // SAFETY: one write of SysTick's reload register, which nobody else uses.
        unsafe { (*SYST::PTR).rvr.write((60 + (self.random >> 25)) << SLOWER) };
    }
}

#[exception]
fn SysTick() {
    interrupt::free(|section| {
        if let Ok(mut sender) = SENDER.borrow(section).try_borrow_mut()
            && let Some(sender) = sender.as_mut()
        {
            sender.interrupt();
        }
    });
}

/// A table that notes whether vertices of two epochs are read.
struct Watched<'a, V> {
    table: &'a V,
    rest: &'a [Vec3; VERTICES],
    epoch: Cell<Option<u32>>,
    is_mixed: Cell<bool>,
}

impl<'a, V: VertexTable> Watched<'a, V> {
    fn new(table: &'a V, rest: &'a [Vec3; VERTICES], epoch: Option<u32>) -> Self {
        Self { table, rest, epoch: Cell::new(epoch), is_mixed: Cell::new(false) }
    }
}

impl<V: VertexTable> VertexTable for Watched<'_, V> {
    fn len(&self) -> usize {
        self.table.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        let position = self.table.position(vertex)?;
        let rest = *self.rest.get(vertex as usize)?;
        // Without a label, the first vertex that is read gives the epoch, modulo 64.
        let epoch = self.epoch.get().unwrap_or((position.x - rest.x + 0.5) as u32);
        self.epoch.set(Some(epoch));
        if position != placed(rest, epoch) {
            self.is_mixed.set(true);
        }
        Some(position)
    }
}

/// [`PLAIN`] as a table.
struct Plain;

impl VertexTable for Plain {
    fn len(&self) -> usize {
        VERTICES
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        let words = PLAIN.get(vertex as usize)?;
        let [x, y, z] = words.each_ref().map(|w| f32::from_bits(w.load(Ordering::Relaxed)));
        Some(Vec3::new(x, y, z))
    }
}

#[entry]
fn main() -> ! {
    exit(run().is_some());
}

fn run() -> Option<()> {
    let mut script = files::Input::open()?;
    let mut word = [0; 4];
    script.read(&mut word)?;
    let queries = u32::from_le_bytes(word);
    script.read(&mut word)?;
    let length = u32::from_le_bytes(word) as usize;
    let counts = interrupt::free(|section| {
        let mut bytes = BYTES.borrow(section).try_borrow_mut().ok()?;
        let bytes = bytes.get_mut(..length)?;
        script.read(bytes)?;
        let tree = Tree::<u16>::from_bytes(bytes).ok()?;
        let mut rest = [Vec3::ZERO; VERTICES];
        for (row, place) in rest.iter_mut().enumerate() {
            *place = tree.rest_position(row as u32)?;
        }
        let (writer, mut reader) = FRAMES.split().ok()?;
        let sender = Sender { writer, rest, epoch: 0, next: 0, random: 1 };
        *SENDER.borrow(section).try_borrow_mut().ok()? = Some(sender);

        let mut core = Peripherals::take()?;
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(100 << SLOWER);
        core.SYST.clear_current();
        core.SYST.enable_counter();
        core.SYST.enable_interrupt();
        // SAFETY: the section only guards statics that no interrupt uses from here on but `SENDER`,
        // whose borrow has ended.
        unsafe { interrupt::enable() };

        let mut query = Query::<_, MAX_STACK>::new(&tree).ok()?;
        let (mut mixed, mut mixed_plain, mut done) = (0, 0, 0_u32);
        while done < queries {
            let angle = done as f32 * 0.37;
            let center = Vec3::new(32.0 + 70.0 * wave(angle), 70.0 * wave(angle + 1.0), 5.0);
            let tool = Sphere::new(center, 2.5).ok()?;
            if let Some(frame) = reader.read() {
                // Positions give the epoch only modulo 64, so the label gives it.
                let watched = Watched::new(&frame, &rest, Some(frame.label().epoch));
                query.closest(&watched, &tool, &Options::cold()).ok()?;
                mixed += u32::from(watched.is_mixed.get());
                done += 1;
            }
            let watched = Watched::new(&Plain, &rest, None);
            // On a surface of two epochs, which may be stretched beyond the limit, the query may fail.
            let _ = query.closest(&watched, &tool, &Options::cold());
            mixed_plain += u32::from(watched.is_mixed.get());
        }
        core.SYST.disable_interrupt();
        let load = |counter: &AtomicU32| counter.load(Ordering::Relaxed);
        Some([done, mixed, load(&PUBLISHED), load(&PUT_OFF), mixed_plain])
    })?;
    let mut answers = files::Output::create()?;
    for count in counts {
        answers.write(&count.to_le_bytes())?;
    }
    answers.flush()
}

/// A triangle wave of period 1 between -1 and 1, for positive `x`: the board has no sine.
fn wave(x: f32) -> f32 {
    let turns = x - (x as i32) as f32;
    4.0 * if turns < 0.5 { turns } else { 1.0 - turns } - 1.0
}
