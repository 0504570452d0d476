"""Vocabulary of the wire, written by tests/tests/protocol.rs from the tables of the firmware."""

INTERFACE_VERSION = 5
FAULTS = {
    1: "encoder gave no sample",
    2: "angle, speed or torque is not a finite number",
    3: "count changed by more than the joint can turn in a tick",
    4: "angle is beyond its range",
    5: "speed is above its limit",
    6: "torque stayed at its limit for too long",
    7: "count stands still although torque and neighbours changed",
    8: "encoder lost its settings",
    9: "amplifier's output does not answer",
    10: "heartbeat of the host stopped",
    11: "tick was late too often",
    12: "joints put more energy into the world than they may",
    13: "supply of the microcontroller is too low",
}
REFUSALS = {
    "NotArmed": "the hand is disarmed: arm it first",
    "NotGrasping": "there is no grasp to release",
    "Grasping": "a grasp is under way: release it first, or stop",
    "Releasing": "a release is under way: wait for its end, or stop",
    "InFault": "the hand is in a fault: clear it first",
    "NoFault": "there is no fault to clear",
    "FaultPersists": "the cause of the fault is still there: remove it first",
    "NoHeartbeat": "there is no heartbeat: send it all the time while the hand is armed",
    "FallbackClock": "the crystal did not start, so that the tick has no exact time: repair the board",
    "NotFinite": "a value is not a finite number",
    "OutOfRange": "a value is out of its range: the limits are parameters",
    "NotDisarmed": "parameters are set while the hand is disarmed: disarm it, or clear its fault, first",
    "NoSuchParameter": "this hand has no parameter with this index",
    "SwitchedOff": "this limit is switched off in the hand's configuration",
    "NoSession": "there is no session of this number: say hello first",
    "OutOfOrder": "this request, or a later one, was taken before: number them upwards",
    "OtherInterface": "this firmware has another interface version: use the tool that belongs to it",
    "NotUnderstood": "this is no request of this interface version",
    "Busy": "too many requests are waiting: wait for the answers",
    "JointsAreReal": "this image has real joints: only the image `pil` takes them over the link",
    "NoBurst": "no fault was caught since the hand was last armed",
    "BurstNotOver": "the records after the fault are still being taken: ask again in a moment",
    "LawNotChosen": "the law of this gain is not chosen: set its parameter `laws.` to 1, disarmed",
    "BeyondFile": "this is looser than the hand's file, and the line can only tighten: `get` shows what the file says",
}
EVENTS = {
    "heartbeat": 1,
    "late": 2,
    "fallback_clock": 4,
    "supply_low": 8,
}
LIMITS = {
    "torque": 1,
    "slew": 2,
    "lower_stop": 4,
    "upper_stop": 8,
}
GAINS = {
    "grasp": ["force_n", "attitude_stiffness_nm"],
    "integral": ["integral_gain_nm_rad"],
}
POTENTIALS = {
    "grasp": ["approach_potential_j", "attitude_potential_j"],
    "integral": ["integral_potential_j"],
}
LAW_SIGNALS = {
    "grasp": [],
    "integral": [],
}
MODES = ["Disarmed", "Armed", "Grasping", "Releasing", "Fault"]
# By their numbers.
PARAMETERS = [
    "damping_nm_s",
    "gravity_m_s2",
    "estimator.bandwidth_hz",
    "limits.torque_nm",
    "limits.slew_nm_s",
    "limits.stops.margin_rad",
    "limits.stops.stiffness_nm_rad",
    "limits.stops.damping_nm_s",
    "faults.possible_speed_rad_s",
    "faults.speed_limit_rad_s",
    "faults.range_slack_rad",
    "faults.saturated_ms",
    "faults.frozen_torque_nm",
    "faults.frozen_neighbour_rad",
    "faults.frozen_ms",
    "faults.heartbeat_ms",
    "faults.late_ticks",
    "faults.energy_j",
    "supervisor.soft_start_ms",
    "supervisor.release_ms",
    "supervisor.amplifier_start_ms",
    "force_n",
    "attitude_stiffness_nm",
    "integral_gain_nm_rad",
    "limits.force_n",
    "limits.attitude_stiffness_nm",
    "limits.integral_gain_nm_rad",
    "laws.grasp",
    "laws.integral",
]
# Names and types of a record's fields, in the order of their bytes.
RECORD_FIELDS = [
    ("sequence", "u32"),
    ("tick", "u32"),
    ("mode", "Mode"),
    ("fault", "Option<Raised>"),
    ("answer", "Option<Answer>"),
    ("events", "Events"),
    ("reading_failed", "Option<Raised>"),
    ("gains", "PerGain<f32>"),
    ("potentials_j", "PerGain<f32>"),
    ("law_signals", "PerSignal<f32>"),
    ("work_j", "f32"),
    ("damped_j", "f32"),
    ("excess_j", "f32"),
    ("cycles", "u32"),
    ("late_ticks", "u32"),
    ("dropped", "u32"),
    ("decimation", "u16"),
    ("counts", "List<i32, J>"),
    ("torques_nm", "List<f32, J>"),
    ("limiting", "List<Limiting, J>"),
]
