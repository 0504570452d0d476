//! Executed instructions of the parts of a tick, counted in QEMU.
//!
//! With `-icount shift=4,sleep=off` QEMU lets 16 ns pass for each instruction, and its SysTick counts 168 MHz: 2.688
//! counts an instruction, whatever the host does meanwhile. What reading the timer costs is measured too, and taken
//! off. The figures are exact and the same in every run; they are instructions, not cycles.
//!
//! Everything is measured in a grasp that has its full force, with joints that move, and the largest of many ticks is
//! told.

use crate::control::Control;
use crate::link::MOST_SENT;
use crate::model::{FINGERS, JOINTS, params};
use crate::semihosting::File;
use blindgrasp_shared::command::{Command, Grasp, Move};
use blindgrasp_shared::control::{Account, Held, Latch, LawsConfig, Stance};
use blindgrasp_shared::device::Inputs;
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::hand::Posture;
use blindgrasp_shared::joints::{Joints, Reading};
use blindgrasp_shared::link::message::{Form, Packet, Reply, Request, Signals};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::telemetry::snapshot::BYTES_PER_JOINT;
use blindgrasp_shared::tick::Params;
use core::fmt::Write;
use core::hint::black_box;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use heapless::String;

type HandParams = Params<JOINTS, FINGERS>;

/// Ticks that are measured, after the grasp has its full force.
const TICKS: usize = 200;

/// Bytes of the largest snapshot.
const SNAPSHOT_MOST: usize = JOINTS * BYTES_PER_JOINT;

/// Counts instructions.
struct Counter {
    /// Timer counts of measuring nothing.
    empty: u32,
}

impl Counter {
    fn new(timer: &mut SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(0x00FF_FFFF);
        timer.clear_current();
        timer.disable_interrupt();
        timer.enable_counter();
        let mut counter = Self { empty: 0 };
        counter.empty = counter.timer_counts(|| ());
        counter
    }

    /// The timer counts downwards, in 24 bits.
    #[inline(never)]
    fn timer_counts(&self, measured: impl FnOnce()) -> u32 {
        let began = SYST::get_current();
        measured();
        let ended = SYST::get_current();
        began.wrapping_sub(ended) & 0x00FF_FFFF
    }

    fn instructions(&self, measured: impl FnOnce()) -> u32 {
        let counts = self.timer_counts(measured).saturating_sub(self.empty);
        // Counts / 2.688, to the nearest.
        ((u64::from(counts) * 1000 + 1344) / 2688) as u32
    }
}

/// The figures.
#[derive(Default)]
struct Figures {
    law_gravity_off: u32,
    law_gravity_on: u32,
    tick: u32,
    tick_move: u32,
    tick_grasp: u32,
    encode_full: u32,
    encode_input: u32,
    save: u32,
    full_bytes: usize,
    input_bytes: usize,
    snapshot_bytes: usize,
}

/// Joints that move a little about the middle of their ranges.
struct Swinging<'p> {
    params: &'p HandParams,
    tick: usize,
}

impl Swinging<'_> {
    fn angles_rad(&self) -> [f32; JOINTS] {
        // A triangle of 0.02 rad in 64 ticks, with a phase of its own for each joint.
        core::array::from_fn(|joint| {
            let (lower, upper) =
                self.params.hand().range_rad(joint.min(self.params.hand().joint_count() - 1));
            let phase = (self.tick + 5 * joint) % 64;
            let triangle = if phase < 32 { phase } else { 64 - phase };
            0.5 * (lower + upper) + (triangle as f32 / 32.0 - 0.5) * 0.02
        })
    }
}

impl Joints<JOINTS> for Swinging<'_> {
    fn collect(&mut self) -> Reading<JOINTS> {
        self.tick += 1;
        let angles_rad = self.angles_rad();
        let encoders = &self.params.config().estimator.encoders;
        Reading::Counts(core::array::from_fn(|joint| {
            let encoder = encoders[joint];
            let turned = (angles_rad[joint] / encoder.rad_per_count) as i32;
            encoder.zero_count + if encoder.reversed { -turned } else { turned }
        }))
    }

    fn write(&mut self, _torques_nm: &[f32; JOINTS], _powered: bool) -> Option<Raised> {
        None
    }
}

/// Measures, and prints one JSON object. Tells whether all of it could be done.
pub fn run(timer: &mut SYST, control: &mut Control) -> Result<(), &'static str> {
    let counter = Counter::new(timer);
    let params = params();
    let mut figures = Figures::default();
    // The paper's law; the virtual frame is in the whole tick.
    let mut without = params.config().laws;
    without.gains.frame = [0.0; 2];
    figures.law_gravity_on = law(&counter, &params, &without)?;
    without.hold.gravity_m_s2 = None;
    figures.law_gravity_off = law(&counter, &params, &without)?;
    let mut alone = Grasp::CONFIGURED;
    alone.gains.frame = [Some(0.0); 2];
    let mut of_law_alone = Figures::default();
    whole_tick(&counter, &params, control, alone, &mut of_law_alone)?;
    figures.tick_grasp = of_law_alone.tick;
    whole_tick(&counter, &params, control, Grasp::CONFIGURED, &mut figures)?;
    print(&figures)
}

/// Forward kinematics and grasp law.
fn law(
    counter: &Counter,
    params: &HandParams,
    config: &LawsConfig<f32, JOINTS>,
) -> Result<u32, &'static str> {
    let hand = params.hand();
    let laws = config.prepare(hand).map_err(|_| "the law could not be prepared")?;
    let mut joints = Swinging { params, tick: 0 };
    let mut posture = Posture::at_base();
    hand.forward_kinematics(&joints.angles_rad(), &mut posture);
    let (latch, held) = (Latch::of(hand, &posture, &joints.angles_rad()), Held::nothing());
    let speeds_rad_s = [0.3; JOINTS];
    let mut most = 0;
    for tick in 0..TICKS {
        joints.tick = tick;
        let angles_rad = joints.angles_rad();
        let (mut torques_nm, mut account) = ([0.0; JOINTS], Account::none());
        most = most.max(counter.instructions(|| {
            hand.forward_kinematics(black_box(&angles_rad), &mut posture);
            let stance = Stance {
                hand,
                posture: &posture,
                angles_rad: &angles_rad,
                speeds_rad_s: black_box(&speeds_rad_s),
                held: &held,
            };
            laws.add_torques(&stance, Some(&laws.grip(&latch)), &mut torques_nm, &mut account);
            black_box((&torques_nm, &account));
        }));
    }
    Ok(most)
}

/// A way that takes longer than what is measured.
const WAY: Move = Move {
    position_m: [0.01, 0.01, 0.01],
    turn_rad: [0.1, 0.2, 0.1],
    about_m: [0.01, 0.0, 0.02],
    time_ms: 60_000,
};

/// The whole tick with its request, in a grasp, and the encoding of its record. With a virtual frame, what is grasped is moved.
fn whole_tick(
    counter: &Counter,
    params: &HandParams,
    control: &mut Control,
    grasp: Grasp,
    figures: &mut Figures,
) -> Result<(), &'static str> {
    // From hello to full force: the soft start takes as long as it takes.
    let settle = 20 + params.config().supervisor.soft_start_ms as usize;
    let carries = grasp == Grasp::CONFIGURED;
    let mut joints = Swinging { params, tick: 0 };
    let mut session = 0;
    for tick in 0..settle + 1 + TICKS {
        let request = match tick {
            0 => Request::Hello { interface_version: INTERFACE_VERSION },
            1 => Request::Telemetry { decimation: 1, signals: Signals::FULL },
            2 => Request::Command(Command::Stop),
            // Nothing is between fingertips that only swing: the grasp begins at once.
            3 => Request::SetParameter { parameter: Parameter::CLOSING_SPEED, index: 0, value: 0.0 },
            5 => Request::Command(Command::Arm),
            10 => Request::Command(Command::Grasp(grasp)),
            // On its way a target costs the most.
            _ if tick == settle && carries => Request::Command(Command::Move(WAY)),
            _ => Request::Heartbeat,
        };
        let packet = Packet { session, sequence: tick as u16, request };
        let mut outputs = None;
        let instructions = counter.instructions(|| {
            let inputs = Inputs { packet: Some(packet), ..Inputs::default() };
            outputs = Some(control.turn(black_box(&mut joints), &inputs));
        });
        // What making up the joints took is not the tick's.
        let idle = counter.instructions(|| {
            joints.tick -= 1;
            black_box(joints.collect());
        });
        let Some(outputs) = outputs else { return Err("there was no tick") };
        match outputs.reply {
            Some(Reply::Identity { session: given, .. }) => session = given,
            Some(Reply::Answer { refused: Some(_), .. }) => return Err("a request was refused"),
            _ => {}
        }
        if tick < settle {
            continue;
        }
        if outputs.record.mode != if carries { Mode::Carrying } else { Mode::Grasping } {
            return Err("the hand does not grasp");
        }
        let instructions = instructions.saturating_sub(idle);
        // That which takes the command is one of many, and tells its answer.
        if tick == settle {
            figures.tick_move = instructions;
            continue;
        }
        figures.tick = figures.tick.max(instructions);
        for (form, most, bytes) in [
            (Form::Full(Signals::ALL), &mut figures.encode_full, &mut figures.full_bytes),
            (Form::Input, &mut figures.encode_input, &mut figures.input_bytes),
        ] {
            let (mut record, mut buffer) = (outputs.record.clone(), [0; MOST_SENT]);
            let mut length = 0;
            let instructions = counter.instructions(|| {
                let frame = form.frame(black_box(&mut record), black_box(&mut buffer));
                length = frame.map_or(0, <[u8]>::len);
            });
            *most = instructions.max(*most);
            *bytes = length.max(*bytes);
        }
        let mut buffer = [0; SNAPSHOT_MOST];
        let mut length = 0;
        let instructions = counter.instructions(|| {
            let saved = control.device().state().save(params, black_box(&mut buffer));
            length = saved.map_or(0, |bytes| bytes.len());
        });
        figures.save = figures.save.max(instructions);
        figures.snapshot_bytes = length;
    }
    Ok(())
}

fn print(figures: &Figures) -> Result<(), &'static str> {
    let &Figures { law_gravity_off, law_gravity_on, tick, tick_move, tick_grasp, encode_full, .. } = figures;
    let &Figures { encode_input, save, full_bytes, input_bytes, snapshot_bytes, .. } = figures;
    let mut json = String::<448>::new();
    writeln!(
        json,
        "{{\"law_gravity_off\": {law_gravity_off}, \"law_gravity_on\": {law_gravity_on}, \"tick\": {tick}, \"tick_move\": {tick_move}, \"tick_grasp\": {tick_grasp}, \
         \"encode_full\": {encode_full}, \"encode_input\": {encode_input}, \"save\": {save}, \
         \"full_bytes\": {full_bytes}, \"input_bytes\": {input_bytes}, \"snapshot_bytes\": {snapshot_bytes}}}"
    )
    .map_err(|_| "the figures are too long")?;
    let mut output = File::standard_output().ok_or("there is no standard output")?;
    if output.write(json.as_bytes()) { Ok(()) } else { Err("the figures could not be written") }
}
