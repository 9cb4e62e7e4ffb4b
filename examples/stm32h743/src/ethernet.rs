//! The bus over Ethernet: the part's controller, and the board's LAN8742A by RMII. The idle loop polls it; the
//! interrupt handler only acknowledges.

use core::mem::MaybeUninit;
use core::task::{Context, Waker};

pub use controller::STATUS_MTU;
use controller::Trust;
use controller::network::{Content, HARDWARE, MAX_REPLY, Peer, announcement, read, seal};
use embassy_net_driver::{Driver, LinkState, RxToken, TxToken};
use embassy_stm32::eth::{Ethernet, GenericPhy, InterruptHandler, PacketQueue, Sma};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::{ETH, ETH_SMA};
use embassy_stm32::{Peripherals, bind_interrupts};

pub const TRUST: Trust = Trust::ETHERNET;

/// Queues of frames to send and of received frames; the second covers the frames that arrive during a control tick.
type Queue = PacketQueue<2, 16>;

/// Most frames received in one iteration of the idle loop.
const FRAMES: u32 = 4;

/// Ticks between two polls of the link.
const LINK_INTERVAL: u32 = 500;

/// The LAN8742A's address on its management bus.
const PHY: u8 = 0;

// In SRAM3, because the DMA does not reach the TCMs, and SRAM3 is not cached.
#[unsafe(link_section = ".sram3.queue")]
static mut QUEUE: MaybeUninit<Queue> = MaybeUninit::uninit();

bind_interrupts!(struct Interrupts {
    ETH => InterruptHandler;
});

/// The network.
pub struct Bus {
    device: Ethernet<'static, ETH, GenericPhy<Sma<'static, ETH_SMA>>>,
    /// Sender of the last good packet: statuses are sent to it, and not to others that flood the port.
    peer: Option<Peer>,
    is_up: bool,
    /// Tick of the last poll of the link.
    looked: u32,
}

impl Bus {
    /// Starts the chip.
    // Never `None`; the return type is that of FDCAN, whose start may fail.
    #[expect(clippy::unnecessary_wraps, reason = "one signature for both buses")]
    #[inline(never)]
    pub fn start(parts: Peripherals) -> Option<Self> {
        // SAFETY: there is one `Peripherals`, so this is the only reference.
        let queue = unsafe { &mut *core::ptr::addr_of_mut!(QUEUE) };
        Queue::init(queue);
        // SAFETY: zeroed by `init`, which makes it an empty queue.
        let queue = unsafe { queue.assume_init_mut() };
        interrupt::ETH.set_priority(Priority::P8);
        let device = Ethernet::new_with_phy(
            queue,
            parts.ETH,
            Interrupts,
            parts.PA1,
            parts.PA7,
            parts.PC4,
            parts.PC5,
            parts.PG13,
            parts.PB13,
            parts.PG11,
            HARDWARE,
            GenericPhy::new(Sma::new(parts.ETH_SMA, parts.PA2, parts.PC1), PHY),
        );
        Some(Self { device, peer: None, is_up: false, looked: 0 })
    }

    /// Receives only a few frames: a flood slows the idle loop's other work down, but does not stop it. `take` returns
    /// whether a packet was a good one.
    #[inline(never)]
    pub fn poll(&mut self, tick: u32, mut take: impl FnMut(&[u8]) -> bool) {
        self.watch_link(tick);
        for _ in 0..FRAMES {
            let context = &mut Context::from_waker(Waker::noop());
            let Some((received, to_send)) = self.device.receive(context) else { return };
            // The frame is still followed by its Ethernet checksum, which is treated as padding.
            let answer = received.consume(|frame| match read(frame) {
                Content::Question(answer) => Some(answer),
                Content::Packet(packet, from) => {
                    if take(packet) {
                        self.peer = Some(from);
                    }
                    None
                }
                Content::Other => None,
            });
            if let Some(answer) = answer {
                write(to_send, &answer);
            }
        }
    }

    /// Announces the controller's addresses whenever the link comes up.
    fn watch_link(&mut self, tick: u32) {
        if tick.wrapping_sub(self.looked) < LINK_INTERVAL {
            return;
        }
        self.looked = tick;
        let context = &mut Context::from_waker(Waker::noop());
        let is_up = self.device.link_state(context) == LinkState::Up;
        if is_up && !self.is_up {
            self.put(&announcement());
        }
        self.is_up = is_up;
    }

    /// Sends a status, if a sender is known.
    #[inline(never)]
    pub fn send(&mut self, status: &[u8]) {
        let mut frame = [0; MAX_REPLY];
        if let Some(frame) = self.peer.and_then(|peer| seal(status, &peer, &mut frame)) {
            self.put(frame);
        }
    }

    /// Sends a frame, or drops it if the queue is full.
    fn put(&mut self, frame: &[u8]) {
        let context = &mut Context::from_waker(Waker::noop());
        if let Some(token) = self.device.transmit(context) {
            write(token, frame);
        }
    }
}

fn write(token: impl TxToken, frame: &[u8]) {
    token.consume(frame.len(), |place| {
        for (to, from) in place.iter_mut().zip(frame) {
            *to = *from;
        }
    });
}
