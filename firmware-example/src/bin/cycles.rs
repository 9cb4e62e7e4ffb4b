//! Measures a query's `Cost` in cycles on your board, by the cycle counter of the debug watchpoint unit (DWT). If that
//! does not count, as in an emulator, it uses `SysTick` and says so.
//!
//! Adapt `memory.x` to your part, set its clock as your product does before the measurement, and run this with a
//! debugger that shows semihosting output:
//!
//! ```text
//! cargo build -p firmware-example --bin cycles --features cycles --profile firmware --target thumbv7em-none-eabihf
//! ```
//!
//! It searches the heart at rest from many poses, alternately with warm and with empty caches, and with three budgets:
//! zero, node tests only, and unlimited. The resulting constants bound every measured query. Add a margin for others.
#![no_std]
#![no_main]

use controller::surface::{CENTRE, Frames, Query, REACH, TREE};
use core::panic::PanicInfo;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DCB, DWT, Peripherals, SYST};
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Budget, Capsule, Cost, FrameLabel, Millis, Options, Proximity};

const POSES: u32 = 2_000;

/// Half the capsule's axis, and its radius, in mm: those of the paper's table 3.
const HALF_AXIS: f32 = 75.0;
const RADIUS: f32 = 3.0;

static FRAMES: Frames = Frames::new();

#[entry]
fn main() -> ! {
    let measured = measure();
    if let Err(reason) = measured {
        hprintln!("{}", reason);
    }
    exit(measured.is_ok())
}

fn measure() -> Result<(), &'static str> {
    let mut core = Peripherals::take().ok_or("the peripherals are taken")?;
    let counter = Counter::start(&mut core.DCB, &mut core.DWT, &mut core.SYST);
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);

    let (mut writer, mut reader) = FRAMES.split().map_err(|_| "the buffers are taken")?;
    writer.begin();
    let tree = TREE.validate().map_err(|_| "the tree in flash is damaged")?;
    for row in 0..tree.vertex_count() {
        let position = tree.rest_position(row).ok_or("the tree has no rest shape")?;
        writer.push(position).map_err(|_| "more vertices than rows")?;
    }
    let label = FrameLabel { epoch: 1, received: Millis(0), position_error: 0.0, stretch: None };
    writer.publish(label).map_err(|_| "the frame is not complete")?;
    let frame = reader.read().ok_or("nothing is published")?;

    let mut query = Query::new(&tree).map_err(|_| "the stack is too small")?;
    let mut random = Random(1);
    let mut bound = Cost { base: 0, node_test: 0, triangle_test: 0 };
    let (mut sum, mut largest) = (0_u64, 0_u32);
    for pose in 0..POSES {
        let centre = CENTRE + random.within() * REACH;
        let half = random.within().normalize_or(Vec3::X) * HALF_AXIS;
        let Ok(tool) = Capsule::new(centre - half, centre + half, RADIUS) else { continue };
        let mut cycles = |tests| {
            // Every other pose starts with empty caches, the worst case.
            if pose % 2 == 1 {
                core.SCB.clean_invalidate_dcache(&mut core.CPUID);
                core.SCB.invalidate_icache();
            }
            let budget = Budget::new(tests);
            let start = counter.now();
            let answer = query.closest(&frame, &tool, &Options::cold().unsigned().budget(budget));
            let cycles = counter.since(start);
            answer.map(|answer| (cycles, answer)).map_err(|_| "the query failed")
        };
        // A budget of no more than one triangle test allows none.
        let [none, nodes, all] = [cycles(0)?, cycles(Budget::TRIANGLE)?, cycles(u32::MAX)?];
        raise(&mut bound, none, nodes, all);
        sum += u64::from(all.0);
        largest = largest.max(all.0);
    }
    let mean = sum / u64::from(POSES);
    let unit = counter.unit();
    hprintln!("{POSES} poses, {mean} {unit} in the mean, {largest} at the most");
    let Cost { base, node_test, triangle_test } = bound;
    hprintln!("Cost {{ base: {base}, node_test: {node_test}, triangle_test: {triangle_test} }}");
    Ok(())
}

/// The counter that is used.
#[derive(Clone, Copy, PartialEq)]
enum Counter {
    /// The core's cycles, in 32 bits.
    Cycles,
    /// `SysTick`, which counts down in 24 bits: the only counter in an emulator.
    SysTick,
}

impl Counter {
    fn start(dcb: &mut DCB, dwt: &mut DWT, systick: &mut SYST) -> Self {
        dcb.enable_trace();
        DWT::unlock(); // the M7's lock access register
        dwt.set_cycle_count(0);
        dwt.enable_cycle_counter();
        let before = DWT::cycle_count();
        cortex_m::asm::delay(1_000);
        if DWT::cycle_count() != before {
            return Self::Cycles;
        }
        systick.set_clock_source(SystClkSource::Core);
        systick.set_reload(SYSTICK_BITS);
        systick.clear_current();
        systick.enable_counter();
        Self::SysTick
    }

    fn now(self) -> u32 {
        match self {
            Self::Cycles => DWT::cycle_count(),
            Self::SysTick => SYSTICK_BITS - SYST::get_current(),
        }
    }

    fn since(self, start: u32) -> u32 {
        let passed = self.now().wrapping_sub(start);
        if self == Self::SysTick { passed & SYSTICK_BITS } else { passed }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Cycles => "cycles",
            Self::SysTick => "counts of SysTick (the cycle counter stands still)",
        }
    }
}

const SYSTICK_BITS: u32 = 0x00FF_FFFF;

/// Raises the constants until they bound the cost of all three queries.
fn raise(bound: &mut Cost, none: (u32, Proximity), nodes: (u32, Proximity), all: (u32, Proximity)) {
    bound.base = bound.base.max(none.0);
    for (cycles, answer) in [nodes, all] {
        let without = bound.instructions(answer.node_tests, 0);
        let beyond = u64::from(cycles).saturating_sub(without) as u32;
        match answer.triangle_tests {
            0 => bound.node_test += beyond.div_ceil(answer.node_tests.max(1)),
            tests => bound.triangle_test = bound.triangle_test.max(beyond.div_ceil(tests)),
        }
    }
}

/// Marsaglia's xorshift: the same poses on every run.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0 as f32 / u32::MAX as f32
    }

    /// A point of the cube from -1 to 1.
    fn within(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

fn exit(success: bool) -> ! {
    debug::exit(if success { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    exit(false)
}

/// No interrupt is enabled.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [u32; 1] = [0];
