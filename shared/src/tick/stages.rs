//! The stages of the cycle in a tick: what they are asked for, what they notice, and their torques.

use super::{Params, Prepared, State};
use crate::command::{Command, Move, Refusal};
use crate::control::{Account, Latch};
use crate::cycle::{Carried, Closed, Cycle, Moving, Notice, Noticed, OPEN, PEAK, largest};
use crate::estimate::Motion;
use crate::hand::Posture;
use crate::math::{Real, norm};
use crate::period::Period;
use crate::supervisor::{Drive, Event, Mode};
use nalgebra::Vector3;

/// Returns the reason for which a command of the cycle can't be done even in a mode that takes it.
#[cold]
#[inline(never)]
pub(super) fn object<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &State<J, F>,
    command: Command,
) -> Option<Refusal> {
    let Prepared { config, period, laws, .. } = &params.prepared;
    let (cycle, carrying) = (&config.cycle, &config.cycle.carrying);
    match command {
        Command::Aim { joint, angle_rad } => {
            if usize::from(joint) >= params.hand.joint_count() {
                Some(Refusal::NoSuchJoint)
            } else if !angle_rad.is_finite() {
                Some(Refusal::NotFinite)
            } else {
                (!params.is_within(joint.into(), angle_rad)).then_some(Refusal::BeyondRange)
            }
        }
        Command::Posture { posture, time_ms } => {
            if !cycle.moves() {
                return Some(Refusal::NoPath);
            }
            let Some(to) = angles_rad(params, state, posture) else { return Some(Refusal::NoSuchPosture) };
            let least = || least_ticks(*period, way_rad(params, state, &to), cycle.moving.speed_rad_s);
            is_short(*period, time_ms, least).then_some(Refusal::TooFast)
        }
        Command::Move(movement) => {
            let to = target(&movement);
            if !to.iter().all(|v| v.is_finite()) {
                return Some(Refusal::NotFinite);
            }
            if state.cycle.carry.is_weighing() {
                return Some(Refusal::Weighing);
            }
            let (turn, about) = (Vector3::from(movement.turn_rad), Vector3::from(movement.about_m));
            // A turn about a point moves the frame by no more than its arc. What is not finite is not within reach.
            let turn_rad = norm(&turn);
            let way_m = norm(&Vector3::from(movement.position_m)) + turn_rad * norm(&about);
            if !(way_m <= carrying.reach_m && turn_rad <= carrying.reach_rad) {
                return Some(Refusal::TooFar);
            }
            is_short(*period, movement.time_ms, || target_ticks(params, state, &to))
                .then_some(Refusal::TooFast)
        }
        Command::PutDown | Command::Weigh => {
            if laws.config().hold.gravity_m_s2.is_none_or(|gravity| norm(&gravity) == 0.0) {
                Some(Refusal::NoGravity)
            } else if command == Command::PutDown && !(carrying.put_down_m_s > 0.0) {
                Some(Refusal::NoPath)
            } else {
                let is_other = state.supervisor.mode() == Mode::Carrying && command == Command::PutDown;
                (is_other && state.cycle.carry.is_weighing()).then_some(Refusal::Weighing)
            }
        }
        _ => None,
    }
}

/// Begins what a command asked for, which was done.
pub(super) fn obey<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
    before: Mode,
    command: Command,
) {
    match command {
        Command::Grasp(grasp) if matches!(before, Mode::Armed | Mode::Moving) => {
            state.grasp = super::gains(params, grasp);
        }
        Command::Arm if before == Mode::Disarmed => state.cycle.aim_rad = state.motion.angles_rad,
        Command::Aim { joint, angle_rad } => {
            if let Some(aim) = state.cycle.aim_rad.get_mut(usize::from(joint)) {
                *aim = angle_rad;
            }
        }
        Command::Posture { posture, time_ms } => state.cycle.asked = Some((posture, time_ms)),
        Command::Move(movement) => {
            let to = target(&movement);
            // A time that is too short was refused.
            let ticks = match movement.time_ms {
                0 => target_ticks(params, state, &to),
                time_ms => ticks(params.prepared.period, time_ms),
            };
            state.cycle.carry.turn_to(&to, ticks);
        }
        Command::PutDown if before == Mode::Carrying => state.cycle.carry.put_down(),
        Command::Weigh if !state.cycle.carry.is_weighing() => state.cycle.carry.weigh(),
        _ => {}
    }
}

/// Goes on with the stage of the mode, which may end it. Returns what is to be told.
pub(super) fn notice<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
) -> Option<Noticed> {
    let mode = state.supervisor.mode();
    let before = state.cycle.begun;
    let is_new = before != mode;
    state.cycle.begun = mode;
    if is_new {
        (state.cycle.fades, state.cycle.retreats) = (false, false);
    }
    match mode {
        Mode::Disarmed | Mode::Fault => None,
        Mode::Armed => (before == Mode::Releasing).then_some(Noticed::of_hand(Notice::Opened)),
        Mode::Moving => move_on(params, state, before),
        Mode::Closing => close(params, state, is_new),
        Mode::Grasping | Mode::Carrying | Mode::PuttingDown | Mode::Releasing => hold(params, state),
    }
}

#[inline(never)]
fn move_on<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
    before: Mode,
) -> Option<Noticed> {
    let opens = before == Mode::Releasing;
    if before != Mode::Moving {
        state.cycle.moving = Moving::resting(state.motion.angles_rad);
    }
    if opens {
        let open = (0_u8..).zip(&params.postures).find(|(_, posture)| posture.name.as_slice() == OPEN);
        state.cycle.asked = open.map(|(number, _)| (Some(number), 0));
    }
    let was_over = state.cycle.moving.path.is_over();
    let asked = state.cycle.asked.take();
    if let Some((posture, time_ms)) = asked
        && let Some(to) = angles_rad(params, state, posture)
    {
        let period = params.prepared.period;
        let speed = params.config().cycle.moving.speed_rad_s;
        let least = least_ticks(period, way_rad(params, state, &to), speed);
        state.cycle.moving.path.turn_to(&to, least.max(ticks(period, time_ms)));
        state.cycle.aim_rad = to;
    } else {
        state.cycle.moving.path.advance();
    }
    if opens {
        return Some(Noticed::of_hand(Notice::Opened));
    }
    (!was_over && state.cycle.moving.path.is_over()).then_some(Noticed::of_hand(Notice::InPosture))
}

#[inline(never)]
fn close<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &mut State<J, F>,
    is_new: bool,
) -> Option<Noticed> {
    let State { cycle, posture, motion, supervisor, .. } = state;
    if is_new {
        cycle.closing.begin(&params.hand, posture);
        cycle.moving = Moving::resting(motion.angles_rad);
    }
    let config = &params.config().cycle.closing;
    let noticed = match cycle.closing.advance(config, params.prepared.period, &params.hand, posture) {
        Closed::NotYet => return None,
        Closed::Touched => {
            supervisor.notice(Event::Touched);
            cycle.closing.stop();
            // The grasp begins in this tick.
            cycle.begun = Mode::Grasping;
            cycle.fades = true;
            hold(params, state);
            return Some(Noticed::of_hand(Notice::Touched));
        }
        Closed::Empty => Noticed::of_hand(Notice::Empty),
        Closed::Never { finger } => Noticed::at(finger, Notice::NeverTouched),
    };
    supervisor.notice(Event::Missed);
    Some(noticed)
}

#[inline(never)]
fn hold<const J: usize, const F: usize>(params: &Params<J, F>, state: &mut State<J, F>) -> Option<Noticed> {
    let Prepared { config, period, up, ramps, .. } = &params.prepared;
    let State { cycle, posture, motion, supervisor, latch, grasp, ledger, .. } = state;
    let hand = &params.hand;
    if supervisor.drive(ramps) == Drive::Close {
        if !cycle.retreats {
            cycle.retreats = true;
            cycle.moving = Moving::resting(motion.angles_rad);
            cycle.closing.begin_retreat(hand, posture);
        }
        cycle.closing.advance(&config.cycle.closing, *period, hand, posture);
        return None;
    }
    let carries = grasp.frame.iter().any(|&gain| gain > 0.0);
    if !(carries || ramps.has().closing) {
        return None;
    }
    let mode = supervisor.mode();
    let is_new = latch.is_none();
    let latch = latch.get_or_insert_with(|| Latch::of(hand, posture, &motion.angles_rad));
    if is_new {
        cycle.carry.begin(hand, posture, latch);
    }
    let carried = if carries {
        let stiffness_n_m =
            if mode == Mode::Carrying || mode == Mode::PuttingDown { grasp.frame[0] } else { 0.0 };
        cycle.carry.advance(
            &config.cycle.carrying,
            *period,
            (hand, posture),
            latch,
            (stiffness_n_m, *up, ledger.of_the_grip_j()),
            &mut cycle.held,
        )
    } else {
        Carried::On
    };
    if mode == Mode::Releasing {
        return None;
    }
    if cycle.carry.is_lost(hand, posture) {
        supervisor.notice(Event::Missed);
        return Some(Noticed::of_hand(Notice::Lost));
    }
    if mode == Mode::Grasping {
        if carries && !supervisor.ramps(ramps) {
            supervisor.notice(Event::Firm);
            cycle.begun = Mode::Carrying;
            cycle.carry.press_in(hand, posture);
            return Some(Noticed::of_hand(Notice::Holding));
        }
        return None;
    }
    let notice = match carried {
        Carried::On => return None,
        Carried::Arrived => Notice::AtTarget,
        Carried::Weighed => Notice::Weighed,
        Carried::OnGround => Notice::OnGround,
        Carried::Deep => Notice::Lowered,
    };
    if mode == Mode::PuttingDown && matches!(notice, Notice::OnGround | Notice::Lowered) {
        supervisor.notice(Event::Down);
        cycle.begun = Mode::Carrying;
    }
    Some(Noticed::of_hand(notice))
}

/// Adds the torques of the stage, N m.
pub(super) fn torques<const J: usize, const F: usize>(
    params: &Params<J, F>,
    drive: Drive,
    motion: &Motion<J>,
    posture: &Posture<f32, J, F>,
    cycle: &mut Cycle<J, F>,
    account: &mut Account<f32>,
    torques_nm: &mut [f32; J],
) {
    let share = match drive {
        Drive::Off | Drive::Hold => return,
        Drive::Path => 0.0,
        Drive::Close => 1.0,
        Drive::Grip { force_share, .. } if cycle.fades && force_share < 1.0 => 1.0 - force_share,
        Drive::Grip { .. } => return,
    };
    let Prepared { config, period, trunk, .. } = &params.prepared;
    if share > 0.0 {
        let mut closing_nm = [0.0; J];
        let (closing, speeds_rad_s) = (&config.cycle.closing, &motion.speeds_rad_s);
        let hand = &params.hand;
        let followed =
            cycle.closing.torques(closing, (hand, posture), speeds_rad_s, share, *period, &mut closing_nm);
        (account.way_share, account.way_potential_j) = (share, followed.potential_j);
        account.fed_j += followed.fed_j;
        for ((torque, closing), is_trunk) in torques_nm.iter_mut().zip(closing_nm).zip(trunk) {
            *torque += if *is_trunk { 0.0 } else { closing };
        }
    }
    let count = params.hand.joint_count();
    let moves = |k: usize| k < count && (drive == Drive::Path || trunk.get(k).is_some_and(|trunk| *trunk));
    if !matches!(drive, Drive::Grip { .. }) {
        let followed = cycle.moving.torques(&config.cycle.moving, *period, motion, moves, torques_nm);
        account.way_share = 1.0;
        account.way_potential_j += followed.potential_j;
        account.fed_j += followed.fed_j;
    }
}

/// Returns the angles of a posture, or of the one that is aimed at, rad.
fn angles_rad<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &State<J, F>,
    posture: Option<u8>,
) -> Option<[f32; J]> {
    let Some(number) = posture else { return Some(state.cycle.aim_rad) };
    let posture = params.postures.as_slice().get(usize::from(number))?;
    let mut angles_rad = [0.0; J];
    angles_rad.iter_mut().zip(&posture.angles_rad).for_each(|(to, from)| *to = *from);
    Some(angles_rad)
}

/// Returns the longest way of a joint to a posture, rad: from where it is, or is on its way.
fn way_rad<const J: usize, const F: usize>(params: &Params<J, F>, state: &State<J, F>, to: &[f32; J]) -> f32 {
    let count = params.hand.joint_count();
    if state.cycle.begun == Mode::Moving {
        return largest(state.cycle.moving.path.ways(to).get(..count).unwrap_or(&[]));
    }
    let angles_rad = &state.motion.angles_rad;
    let ways: [f32; J] = core::array::from_fn(|k| (to[k] - angles_rad[k]).magnitude());
    largest(ways.get(..count).unwrap_or(&[]))
}

/// Returns the target of a movement: way, rotation vector, point that is turned about.
fn target(movement: &Move) -> [f32; 9] {
    let ([px, py, pz], [rx, ry, rz], [bx, by, bz]) =
        (movement.position_m, movement.turn_rad, movement.about_m);
    [px, py, pz, rx, ry, rz, bx, by, bz]
}

/// Returns the fewest ticks that a way to a target may take.
fn target_ticks<const J: usize, const F: usize>(
    params: &Params<J, F>,
    state: &State<J, F>,
    to: &[f32; 9],
) -> u32 {
    let (carrying, period) = (&params.config().cycle.carrying, params.prepared.period);
    let (way_m, turn_rad) = state.cycle.carry.ways(to);
    let turning = least_ticks(period, turn_rad, carrying.speed_rad_s);
    least_ticks(period, way_m, carrying.speed_m_s).max(turning)
}

/// Returns the fewest ticks that a way may take whose largest speed is limited.
fn least_ticks(period: Period, way: f32, speed_1_s: f32) -> u32 {
    if way == 0.0 {
        return 1;
    }
    // The conversion saturates; without a speed, it takes for ever.
    (PEAK * way / (speed_1_s * period.seconds())) as u32 + 1
}

/// Returns the ticks of a time that is asked for.
fn ticks(period: Period, time_ms: u16) -> u32 {
    u32::from(time_ms) * 1000 / period.microseconds()
}

/// Returns `true` if a time is asked for that is too short.
fn is_short(period: Period, time_ms: u16, least_ticks: impl FnOnce() -> u32) -> bool {
    time_ms > 0 && ticks(period, time_ms) < least_ticks()
}
