//! The clocks: 480 MHz for the processor, from the 8 MHz of the board's ST-LINK.

use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};

/// The processor's clock. Parts before revision V reach 400 MHz only.
pub const HERTZ: u32 = INPUT / 2 * 240 / 2;

/// FDCAN's clock: output Q of the same PLL.
#[cfg_attr(not(feature = "fdcan"), expect(dead_code, reason = "FDCAN is off"))]
pub const FDCAN_HERTZ: u32 = INPUT / 2 * 240 / 12;

const INPUT: u32 = 8_000_000;

/// Starts the clocks, and returns the part's peripherals.
// Not inlined, like all code of this program that contains the driver's panic paths.
#[inline(never)]
pub fn start() -> Peripherals {
    embassy_stm32::init(config())
}

fn config() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: Hertz(INPUT), mode: HseMode::Bypass });
    rcc.hsi48 = None;
    rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV2,
        mul: PllMul::MUL240,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV12),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = VoltageScale::Scale0;
    rcc.mux.fdcansel = mux::Fdcansel::PLL1_Q;
    config
}
