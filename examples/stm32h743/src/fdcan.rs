//! The bus over FDCAN1: pins PD0 and PD1, with a transceiver to the bus. The idle loop polls it; the interrupt handler
//! only acknowledges.

use core::num::{NonZeroU8, NonZeroU16};
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use controller::Trust;
use dibs_nostd::wire::canfd::Identifiers;
use embassy_stm32::can::config::{
    DataBitTiming, FrameTransmissionConfig, GlobalFilter, NominalBitTiming,
};
use embassy_stm32::can::filter::{Action, Filter, FilterType, StandardFilterSlot};
use embassy_stm32::can::frame::{FdFrame, Header};
use embassy_stm32::can::{Can, CanConfigurator, IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::FDCAN1;
use embassy_stm32::{Peripherals, bind_interrupts};
use embedded_can::StandardId;

use crate::clocks;

/// A frame of the heart takes a quarter of a second, so it beats in slow motion, as over a serial line.
pub const TRUST: Trust = Trust::SERIAL;

/// Largest status, in bytes: one message.
pub const STATUS_MTU: usize = 64;

/// Messages received in one iteration of the idle loop: as many as the driver's FIFO holds.
const MESSAGES: u32 = 3;

/// The first of three identifiers: heartbeats. Frames have the last one.
const BASE: u16 = 0x120;

/// 1 Mbit/s, sampled at 80 %.
const NOMINAL: NominalBitTiming = NominalBitTiming {
    prescaler: PRESCALER,
    seg1: quanta(31),
    seg2: quanta(8),
    sync_jump_width: quanta(8),
};

/// 2 Mbit/s for the data. Higher rates need compensation of the transceiver's delay, which the driver does not support.
const DATA: DataBitTiming = DataBitTiming {
    transceiver_delay_compensation: false,
    prescaler: PRESCALER,
    seg1: quanta(15),
    seg2: quanta(4),
    sync_jump_width: quanta(4),
};

const PRESCALER: NonZeroU16 = NonZeroU16::MIN.saturating_add(1);

const _: () = {
    let quanta = clocks::FDCAN_HERTZ / PRESCALER.get() as u32;
    assert!(quanta / (1 + NOMINAL.seg1.get() as u32 + NOMINAL.seg2.get() as u32) == 1_000_000);
    assert!(quanta / (1 + DATA.seg1.get() as u32 + DATA.seg2.get() as u32) == 2_000_000);
};

const fn quanta(count: u8) -> NonZeroU8 {
    NonZeroU8::MIN.saturating_add(count - 1)
}

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

/// The CAN bus.
pub struct Bus {
    can: Can<'static>,
    identifiers: Identifiers,
}

impl Bus {
    /// Starts the controller; `None` if the identifiers are out of range.
    #[inline(never)]
    pub fn start(parts: Peripherals) -> Option<Self> {
        let identifiers = Identifiers::new(BASE)?;
        let wanted = FilterType::DedicatedDual(StandardId::new(BASE)?, StandardId::new(BASE + 2)?);
        interrupt::FDCAN1_IT0.set_priority(Priority::P8);
        interrupt::FDCAN1_IT1.set_priority(Priority::P8);
        let mut can = CanConfigurator::new(parts.FDCAN1, parts.PD0, parts.PD1, Interrupts);
        let config = can.config().set_nominal_bit_timing(NOMINAL).set_data_bit_timing(DATA);
        let config = config.set_frame_transmit(FrameTransmissionConfig::AllowFdCanAndBRS);
        can.set_config(config.set_global_filter(GlobalFilter::reject_all()));
        let filter = Filter { filter: wanted, action: Action::StoreInFifo0 };
        can.properties().set_standard_filter(StandardFilterSlot::_0, filter);
        Some(Self { can: can.into_normal_mode(), identifiers })
    }

    /// Receives a few messages.
    #[inline(never)]
    pub fn poll(&mut self, _tick: u32, mut take: impl FnMut(&[u8]) -> bool) {
        for _ in 0..MESSAGES {
            let context = &mut Context::from_waker(Waker::noop());
            // The controller counts errors of the bus; lost messages are noticed as gaps.
            let Poll::Ready(Ok(message)) = pin!(self.can.read_fd()).poll(context) else { return };
            let (frame, _) = message.parts();
            take(frame.data());
        }
    }

    /// Sends a status, or drops it if the queue is full.
    #[inline(never)]
    pub fn send(&mut self, status: &[u8]) {
        let Some(identifier) = StandardId::new(self.identifiers.of(status)) else { return };
        let header = Header::new_fd(identifier.into(), status.len() as u8, false, true);
        if let Ok(frame) = FdFrame::new(header, status) {
            let context = &mut Context::from_waker(Waker::noop());
            let _ = pin!(self.can.write_fd(&frame)).poll(context);
        }
    }
}
