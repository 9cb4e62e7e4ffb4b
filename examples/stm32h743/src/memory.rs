//! The memories: fills the TCMs, sets the regions of the memory protection unit (MPU), and turns the caches on.

use core::arch::global_asm;

use cortex_m::Peripherals;
use embassy_stm32::pac::RCC;

// Copies code and state of the control tick to the TCMs. It runs before everything else, so it cannot be written in
// Rust. It copies 8 bytes at a time, whole units of the TCMs' error correction.
global_asm!(
    ".pushsection .text.__pre_init, \"ax\", %progbits",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, =__itcm_start",
    "ldr r1, =__itcm_end",
    "ldr r2, =__itcm_load",
    "0:",
    "cmp r0, r1",
    "beq 1f",
    "ldm r2!, {{r3, r12}}",
    "stm r0!, {{r3, r12}}",
    "b 0b",
    "1:",
    "ldr r0, =__dtcm_start",
    "ldr r1, =__dtcm_end",
    "ldr r2, =__dtcm_load",
    "2:",
    "cmp r0, r1",
    "beq 3f",
    "ldm r2!, {{r3, r12}}",
    "stm r0!, {{r3, r12}}",
    "b 2b",
    "3:",
    "dsb",
    "isb",
    "bx lr",
    ".ltorg",
    ".size __pre_init, . - __pre_init",
    ".popsection",
);

/// A region of the MPU. Its size is a power of two, and its base a multiple of that.
#[repr(C)]
struct Region {
    base: u32,
    /// Binary logarithm of its size.
    log2: u32,
    attributes: u32,
}

/// Fields of the attributes: no code, access, and what the memory is (ARMv7-M manual, B3.5.9).
const NO_CODE: u32 = 1 << 28;
const NO_ACCESS: u32 = 0;
const READ_WRITE: u32 = 0b011 << 24;
const READ_ONLY: u32 = 0b110 << 24;
const ORDERED: u32 = 1 << 18;
const NOT_CACHED: u32 = 1 << 19 | 1 << 18;
const CACHED: u32 = 1 << 19 | 0b11 << 16;
/// Bits for the eighths of a region that are excluded from it.
const EXCEPT: u32 = 8;

/// Later regions take precedence. A table, so that a check of the binary finds the region of the DMA's memory.
#[used]
static REGIONS: [Region; 4] = [
    // External memory, which the board does not have: without this the processor may prefetch from it.
    Region { base: 0, log2: 32, attributes: NO_CODE | NO_ACCESS | ORDERED | 0b1000_0111 << EXCEPT },
    // Descriptors and buffers of the Ethernet DMA in SRAM3: each side reads the other's writes.
    Region { base: 0x3004_0000, log2: 15, attributes: NO_CODE | READ_WRITE | NOT_CACHED },
    // The code in the ITCM, after it is copied.
    Region { base: 0, log2: 16, attributes: READ_ONLY | CACHED },
    // Null pointers.
    Region { base: 0, log2: 5, attributes: NO_CODE | NO_ACCESS | ORDERED },
];

/// Sets the regions, with the default map for all other addresses, and turns the caches on.
pub fn protect(core: &mut Peripherals) {
    for (number, region) in (0..).zip(&REGIONS) {
        // SAFETY: no region makes memory in use inaccessible.
        unsafe {
            core.MPU.rnr.write(number);
            core.MPU.rbar.write(region.base);
            core.MPU.rasr.write(region.attributes | (region.log2 - 1) << 1 | 1);
        }
    }
    // SAFETY: as above.
    unsafe { core.MPU.ctrl.write(1 << 2 | 1) };
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}

/// Turns on the clock of SRAM3, which is off after a reset.
pub fn start_sram3() {
    RCC.ahb2enr().modify(|enabled| enabled.set_sram3en(true));
    // The clock runs two cycles after the write (RM0433, 8.5.11).
    let _ = RCC.ahb2enr().read();
}
