//! The smallest loop in RTIC, on the emulated board: the bus interrupt fills one buffer, the control interrupt of
//! higher priority reads the other, and neither waits. It ends with the first force from a received surface.
#![no_std]
#![no_main]

#[path = "../../board.rs"]
mod board;

// Linked for its vector table and start-up code.
use cortex_m_rt as _;

dibs_nostd::include_tree!("heart");
static SURFACE: heart::Surface = heart::Surface::new();

unsafe extern "C" {
    fn UART0();
}

/// Placed after the exceptions in the vector table.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [unsafe extern "C" fn(); 1] = [UART0];

#[rtic::app(device = crate::board, peripherals = false)]
mod app {
    use core::sync::atomic::{AtomicU32, Ordering};

    use cortex_m_semihosting::hprintln;
    use dibs_nostd::constraint::{ForbiddenRegion, SpringDamper};
    use dibs_nostd::glam::Vec3;
    use dibs_nostd::guard::GuardLimits;
    use dibs_nostd::{Capsule, Error, Millis};

    use crate::board::{self, end};
    use crate::{SURFACE, heart};

    /// Tissue that hardly moves: 1 mm/s. On the emulated line a frame takes long, and no status is returned.
    const LIMITS: GuardLimits =
        GuardLimits::new(1.0, Millis(2_000)).without_transit().automatic().instructions(400_000);

    /// Number of control ticks so far: the time, in ms.
    static NOW: AtomicU32 = AtomicU32::new(0);

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        bus: heart::Bus,
        guard: heart::Guard,
        wall: ForbiddenRegion,
    }

    #[init]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        // Any error here occurs before the robot moves: stop.
        let Ok(local) = start() else { end(false) };
        board::start_bus();
        board::start_ticks(&mut cx.core.SYST);
        (Shared {}, local)
    }

    fn start() -> Result<Local, Error> {
        let (bus, guard) = heart::start(&SURFACE, LIMITS)?;
        let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
        Ok(Local { bus, guard, wall: ForbiddenRegion::new(spring, 5.0)? })
    }

    #[task(binds = UART0, priority = 1, local = [bus])]
    fn receive(cx: receive::Context) {
        board::acknowledge();
        while let Some(byte) = board::byte() {
            cx.local.bus.receive(&[byte], Millis(NOW.load(Ordering::Relaxed)));
            let _counted = cx.local.bus.work(100);
        }
    }

    #[task(binds = SysTick, priority = 2, local = [guard, wall])]
    fn control(cx: control::Context) {
        let now = Millis(NOW.fetch_add(1, Ordering::Relaxed));
        let (tip, top) = (Vec3::new(32.0, 0.0, 60.0), Vec3::new(32.0, 0.0, 150.0));
        let Ok(tool) = Capsule::new(tip, top, 2.5) else { end(false) };
        let answer = cx.local.guard.closest(&tool, now);
        let force = answer.force(cx.local.wall).force;
        if let Ok(closest) = answer.closest {
            hprintln!("{} mm, {} N", closest.separation, force.length());
            end(true)
        }
        if now > board::PATIENCE {
            end(false)
        }
    }
}
