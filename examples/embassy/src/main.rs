//! The smallest loop in Embassy, on the emulated board: the control task runs on an executor in an interrupt, which has
//! a higher priority than the bus's task in the main thread. It ends with the first force from a received surface.
#![no_std]
#![no_main]

#[path = "../../board.rs"]
mod board;

use core::sync::atomic::{AtomicU32, Ordering};

use board::end;
use cortex_m::peripheral::{NVIC, Peripherals};
use cortex_m_rt::exception;
use cortex_m_semihosting::hprintln;
use dibs_nostd::constraint::{ForbiddenRegion, SpringDamper};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::GuardLimits;
use dibs_nostd::{Advance, Capsule, Error, Millis};
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;

dibs_nostd::include_tree!("heart");
static SURFACE: heart::Surface = heart::Surface::new();

/// Tissue that hardly moves: 1 mm/s. On the emulated line a frame takes long, and no status is returned.
const LIMITS: GuardLimits =
    GuardLimits::new(1.0, Millis(2_000)).without_transit().automatic().instructions(400_000);

static CONTROL: InterruptExecutor = InterruptExecutor::new();
static TICK: Signal<CriticalSectionRawMutex, Millis> = Signal::new();
static BYTES: Pipe<CriticalSectionRawMutex, 4096> = Pipe::new();
/// Number of control ticks so far: the time, in ms.
static NOW: AtomicU32 = AtomicU32::new(0);

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    // Any error here occurs before the robot moves: stop.
    end(bus().await.is_ok())
}

/// Starts the control task, and receives the bus's packets.
async fn bus() -> Result<(), Error> {
    let (mut receiver, guard) = heart::start(&SURFACE, LIMITS)?;
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
    start(guard, ForbiddenRegion::new(spring, 5.0)?);
    let mut bytes = [0; 64];
    loop {
        let count = BYTES.read(&mut bytes).await;
        receiver.receive(&bytes[..count], Millis(NOW.load(Ordering::Relaxed)));
        while receiver.work(100) == Ok(Advance::Pending) {}
    }
}

fn start(guard: heart::Guard, wall: ForbiddenRegion) {
    let Some(mut core) = Peripherals::take() else { end(false) };
    // SAFETY: no critical section relies on priorities; lower values are more urgent.
    unsafe {
        core.NVIC.set_priority(board::Interrupt::Spare, 0x40);
        core.NVIC.set_priority(board::Interrupt::UART0, 0x80);
    }
    match control(guard, wall) {
        Ok(task) => CONTROL.start(board::Interrupt::Spare).spawn(task),
        Err(_) => end(false),
    }
    board::start_bus();
    // SAFETY: the handler's state is static.
    unsafe { NVIC::unmask(board::Interrupt::UART0) };
    board::start_ticks(&mut core.SYST);
}

#[embassy_executor::task]
async fn control(mut guard: heart::Guard, wall: ForbiddenRegion) {
    loop {
        let now = TICK.wait().await;
        let (tip, top) = (Vec3::new(32.0, 0.0, 60.0), Vec3::new(32.0, 0.0, 150.0));
        let Ok(tool) = Capsule::new(tip, top, 2.5) else { end(false) };
        let answer = guard.closest(&tool, now);
        let force = answer.force(&wall).force;
        if let Ok(closest) = answer.closest {
            hprintln!("{} mm, {} N", closest.separation, force.length());
            end(true)
        }
        if now > board::PATIENCE {
            end(false)
        }
    }
}

#[exception]
fn SysTick() {
    TICK.signal(Millis(NOW.fetch_add(1, Ordering::Relaxed)));
}

extern "C" fn uart() {
    board::acknowledge();
    while let Some(byte) = board::byte() {
        let _full = BYTES.try_write(&[byte]);
    }
}

extern "C" fn control_executor() {
    // SAFETY: called from the interrupt that the executor was started with.
    unsafe { CONTROL.on_interrupt() };
}

/// Placed after the exceptions in the vector table.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [extern "C" fn(); 2] = [uart, control_executor];
