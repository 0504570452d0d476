//! The start of the images, on any board, in an order that matters: what was found is told, saved parameters are restored
//! with the amplifiers off, the hand is made; then supply monitor, joints, line and watchdog start.

use crate::boards::{Board, Found, Parts};
use crate::control::{Control, HandBurst, Timing};
use crate::link::Link;
use crate::model::{self, FINGERS, JOINTS};
use crate::queue::Queues;
use crate::tasks::{ControlTask, IdleTask, LineErrors};
use crate::{report, saved};
use blindgrasp_shared::device::Device;
use blindgrasp_shared::identity::{Clock, Identity, Image, Restored};
use blindgrasp_shared::link::rate::{FASTER_BAUDS, FIRST_BAUD};
use blindgrasp_shared::tick::Params;
use core::mem::MaybeUninit;

/// The memory in which the hand is for as long as the program runs.
pub struct Memory {
    control: MaybeUninit<Control>,
    burst: HandBurst,
}

impl Memory {
    /// Not yet used.
    pub const fn new() -> Self {
        Self { control: MaybeUninit::uninit(), burst: HandBurst::new() }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// Starts the image `hand`: its tasks, and what serves the line's interrupts.
pub fn hand<B: Board>(
    mut board: B,
    image: &'static [u8],
    memory: &'static mut Memory,
    queues: &'static mut Queues,
    board_memory: &'static mut B::Memory,
) -> (ControlTask<B>, IdleTask<B>, B::Interrupts) {
    report::start(board.found(), image);
    let (flash, mut store) = (board.take_flash(), None);
    let restore = |hash, params: &mut _| {
        let (found, restored) = saved::restore(flash?, hash, params)?;
        store = Some((found, hash));
        Some(restored)
    };
    let control = control::<B>(*board.found(), image, restore, memory);
    let (queues, link_end, store_end) = queues.split();
    let Parts { joints, line, interrupts, watchdog } = board.start(board_memory);
    let control = ControlTask { control, joints, queues, last: Timing::default(), watchdog };
    let idle = IdleTask { link: Link::new(line, link_end), errors: LineErrors::default(), store, store_end };
    (control, idle, interrupts)
}

/// Starts the image `pil`, whose joints are at the other end of the line: its hand, and its line.
pub fn pil<B: Board>(
    board: B,
    image: &'static [u8],
    memory: &'static mut Memory,
) -> (&'static mut Control, B::Line, B::Interrupts) {
    report::start(board.found(), image);
    let control = control::<B>(*board.found(), image, |_, _| None, memory);
    let (interrupts, line) = board.start_line();
    (control, line, interrupts)
}

/// Frequency of the timer, Hz.
pub fn timer_hz<B: Board>(found: &Found) -> u32 {
    if found.is_emulated() { B::EMULATED_HZ } else { B::CLOCK_HZ }
}

/// The control task's hand, as the image's description calls it, in a place of its own. `restore`, which is told the hash of
/// the hand, may put saved parameters in the place of its file's; it tells what became of them, if there is a store.
///
/// Here the stack is deepest: hence no part of it is in the caller's frame, nor the hand in that of its parameters.
///
/// # Panics
/// Never: the build wrote the description.
#[inline(never)]
fn control<B: Board>(
    found: Found,
    image: &'static [u8],
    restore: impl FnOnce(u32, &mut Params<JOINTS, FINGERS>) -> Option<Restored>,
    memory: &'static mut Memory,
) -> &'static mut Control {
    let mut params = model::params();
    let image = Image::decode(image).expect("the build wrote the description");
    let restored = restore(image.hand_hash, &mut params);
    made::<B>(found, image, params, restored, memory)
}

#[inline(never)]
fn made<B: Board>(
    found: Found,
    image: Image<'static>,
    params: Params<JOINTS, FINGERS>,
    restored: Option<Restored>,
    memory: &'static mut Memory,
) -> &'static mut Control {
    let Found { clock, reset, crash, brown_out } = found;
    // An emulated line has no rate, and without the crystal only the slowest is sure.
    let faster_bauds = if clock == Clock::External { &FASTER_BAUDS[..] } else { &[] };
    let told = Identity {
        reset,
        crash,
        brown_out,
        restored,
        clock_hz: if found.is_emulated() { 0 } else { B::CLOCK_HZ },
        most_baud: faster_bauds.iter().copied().fold(FIRST_BAUD, u32::max),
        ..Identity::of(image, clock)
    };
    let device = Device::new(params, told).with_faster_bauds(faster_bauds);
    memory.control.write(Control::new(device, &mut memory.burst))
}
