//! The controller on a NUCLEO-H743ZI2: `docs/boards.md`.
//!
//! The control tick (`SysTick`, 1 kHz) has the highest priority, and runs from memory without wait states. The idle
//! loop receives packets from Ethernet, or from FDCAN with the feature `fdcan`, checks complete frames and the tree in
//! flash in slices, and sends statuses.

// Requirement: P-10

#![no_std]
#![no_main]

#[cfg(not(feature = "fdcan"))]
#[path = "ethernet.rs"]
mod bus;
#[cfg(feature = "fdcan")]
#[path = "fdcan.rs"]
mod bus;
mod clocks;
#[path = "../../../firmware-example/src/bin/board/exclusive.rs"]
mod exclusive;
mod memory;
mod tick;

use core::panic::PanicInfo;

use bus::Bus;
use controller::{BusStatus, ContactList, Receiver, Script, surface};
use cortex_m::Peripherals;
use cortex_m::peripheral::SCB;
use cortex_m_rt::entry;

static SURFACE: surface::Surface = surface::Surface::new();
static BUS: BusStatus = BusStatus::new();

#[entry]
fn main() -> ! {
    static mut CONTACTS: ContactList = ContactList::new();
    match start(CONTACTS) {
        Some((receiver, bus)) => idle(receiver, bus),
        // Any error here occurs before the robot moves.
        None => loop {
            cortex_m::asm::wfi();
        },
    }
}

/// Starts the control tick and the bus; `None` if the tree is damaged or a constant out of range.
fn start(contacts: &'static mut ContactList) -> Option<(Receiver, Bus)> {
    let mut core = Peripherals::take()?;
    memory::protect(&mut core);
    let parts = clocks::start();
    memory::start_sram3();
    let (receiver, control) =
        controller::start(&SURFACE, &BUS, &bus::TRUST, Script, contacts).ok()?;
    let bus = Bus::start(parts)?;
    tick::start(&mut core, control);
    Some((receiver, bus))
}

fn idle(mut receiver: Receiver, mut bus: Bus) -> ! {
    let mut status = [0; bus::STATUS_MTU];
    loop {
        bus.poll(tick::now().0, |packet| take(&mut receiver, packet));
        receiver.work();
        if let Some(status) = receiver.status(tick::now(), &mut status) {
            bus.send(status);
        }
    }
}

/// Receives a packet. Returns whether it was a good one.
// Not inlined, so that the panic paths of the calling driver are not mixed with code of the controller.
#[inline(never)]
fn take(receiver: &mut Receiver, packet: &[u8]) -> bool {
    receiver.packet(packet, tick::now())
}

/// The drivers have panic paths: `docs/boards.md`. A reset sets the output to zero.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    SCB::sys_reset()
}
