"""Runs exported scenes in MuJoCo, driven by the tick that the microcontroller runs, and prints what became of them as JSON.

    python mujoco_grasp.py TICK RUNS.json

TICK is the program of the tests that stands between true joint angles and torques. RUNS.json is a list of runs: MJCF file, the scene's
effective file, and the times at which the pose of the object is asked for. What MJCF has no words for is done here, once a control
period, from the scene's file: tables that move, gravity that turns or shakes, pushes.

The verdict is made of what MuJoCo tells of its contacts, as docs/scenes.md has it: an object is dropped when no fingertip touches it, or it is
on a table that is gone, for 0.2 s, or when it is more than its own size from where the hand had it; it slipped if a fingertip went over
it by more than a millimetre.
"""

import json
import math
import multiprocessing
import subprocess
import sys
import tomllib

import mujoco
import numpy as np

PATIENCE_S = 0.2
TABLE_GONE_M = 5e-3
SLIPPED_M = 1e-3


def done(share):
    """From 0 to 1 with speed and acceleration zero at both ends."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10 + s * (6 * s - 15))


class World:
    """What happens around hand and object."""

    def __init__(self, scene):
        plant = scene["plant"]
        for key in ("turn", "push"):
            if key in plant:
                raise SystemExit(f"plant.{key} is not known here")
        self.gravity = np.array(plant["gravity_m_s2"])
        self.shakes = plant.get("shake", [])
        self.tables = plant.get("table", [])

    def gravity_at(self, t):
        gravity = self.gravity.copy()
        for shake in self.shakes:
            since = t - shake["from_s"]
            if 0 <= since < shake["for_s"]:
                gravity -= np.array(shake["amplitude_m_s2"]) * math.sin(2 * math.pi * shake["frequency_hz"] * since)
        return gravity

    def gone(self, table, t):
        """The way of a table from where it was, m."""
        ways = (np.array(way["by_m"]) * done((t - way["from_s"]) / way["for_s"]) for way in table.get("move", []))
        return sum(ways, np.zeros(3))


class Run:
    """A scene in MuJoCo."""

    def __init__(self, run):
        with open(run["scene"], "rb") as file:
            self.scene = tomllib.load(file)
        self.run = run
        self.world = World(self.scene)
        self.model = mujoco.MjModel.from_xml_path(run["mjcf"])
        self.data = mujoco.MjData(self.model)
        mujoco.mj_resetDataKeyframe(self.model, self.data, self.model.key("start").id)
        names = [joint["name"] for joint in self.scene["hand"]["joint"]]
        self.position = [self.model.jnt_qposadr[self.model.joint(name).id] for name in names]
        self.speed = [self.model.jnt_dofadr[self.model.joint(name).id] for name in names]
        self.motor = [self.model.actuator(name).id for name in names]
        self.body = self.model.body("object").id
        self.object = self.model.geom("object").id
        self.tips = [self.model.geom(f"{tip['name']}-tip-core").id for tip in self.scene["hand"]["fingertip"]]
        self.tables = [self.model.geom(f"table-{t + 1}").id for t in range(len(self.world.tables))]
        shape = self.scene["object"]["shape"]
        if "box" not in shape:
            raise SystemExit("sizes of boxes only")
        self.size = math.hypot(*shape["box"]["size_m"])
        self.period = self.scene["control"]["period_s"]
        self.substeps = round(self.period / self.model.opt.timestep)
        self.slipped = np.zeros(len(self.tips))
        self.normal = np.zeros(len(self.tips))
        self.depth = np.zeros(len(self.tips))
        self.home, self.untouched, self.on_table = None, 0.0, 0.0

    def surround(self, t):
        self.model.opt.gravity[:] = self.world.gravity_at(t)
        for t_table, (table, geom) in enumerate(zip(self.world.tables, self.tables)):
            mocap = self.model.body_mocapid[self.model.geom_bodyid[geom]]
            self.data.mocap_pos[mocap] = np.array(table["point_m"]) + self.world.gone(table, t)

    def look(self, t):
        """What touches; returns why the object is lost, if it is."""
        on_table = False
        self.normal[:], self.depth[:] = 0, 0
        force = np.zeros(6)
        for k in range(self.data.ncon):
            contact = self.data.contact[k]
            if contact.efc_address < 0 or self.object not in contact.geom:
                continue
            mujoco.mj_contactForce(self.model, self.data, k, force)
            if force[0] <= 0:
                continue
            other = contact.geom[0] + contact.geom[1] - self.object
            if other in self.tips:
                finger = self.tips.index(other)
                self.normal[finger], self.depth[finger] = force[0], contact.includemargin - contact.dist
                slip = self.data.efc_vel[contact.efc_address + 1 : contact.efc_address + 3]
                self.slipped[finger] += math.hypot(*slip) * self.period
            else:
                gone = self.world.gone(self.world.tables[self.tables.index(other)], t)
                on_table |= bool(np.linalg.norm(gone) > TABLE_GONE_M)
        fingers = int(np.count_nonzero(self.normal))
        self.untouched = 0.0 if fingers else self.untouched + self.period
        self.on_table = self.on_table + self.period if on_table else 0.0
        turn = self.data.xmat[self.body].reshape(3, 3)
        there = turn.T @ (self.data.xpos[self.body] - np.mean(self.data.geom_xpos[self.tips], axis=0))
        if fingers >= 2 and self.home is None:
            self.home = there
        if self.untouched > PATIENCE_S:
            return "untouched"
        if self.on_table > PATIENCE_S:
            return "on table"
        if self.home is not None and np.linalg.norm(there - self.home) > self.size:
            return "away"
        return None

    def pose(self, t):
        return {
            "t_s": t,
            "position_m": self.data.xpos[self.body].tolist(),
            "quaternion_wxyz": self.data.xquat[self.body].tolist(),
            "normal_n": self.normal.tolist(),
            "depth_m": self.depth.tolist(),
        }

    def play(self, tick):
        model, data = self.model, self.data
        told = {"name": self.run["name"], "poses": [], "lost": None}
        due = list(self.run["poses_at_s"])
        controller = subprocess.Popen([tick, self.run["scene"]], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        for period in range(round(self.scene["duration_s"] / self.period) + 1):
            t = period * self.period
            controller.stdin.write(np.concatenate([data.qpos[self.position], data.qvel[self.speed]]).tobytes())
            controller.stdin.flush()
            data.ctrl[self.motor] = np.frombuffer(controller.stdout.read(8 * len(self.motor)))
            # Of the middle of the period, over which it stands.
            self.surround(t + self.period / 2)
            mujoco.mj_step(model, data, self.substeps)
            told["lost"] = self.look(t)
            if told["lost"]:
                told["lost_at_s"] = t
                break
            if due and t >= due[0] - 1e-9:
                told["poses"].append(self.pose(due.pop(0)))
        controller.stdin.close()
        if controller.wait() != 0 or not np.all(np.isfinite(data.qpos)):
            raise SystemExit(f"{self.run['name']}: the tick or MuJoCo has failed")
        warnings = [mujoco.mjtWarning(k).name for k, warning in enumerate(data.warning) if warning.number]
        if warnings:
            raise SystemExit(f"{self.run['name']}: MuJoCo warns: {warnings}")
        told["slipped_m"] = self.slipped.tolist()
        slipped = bool(np.max(self.slipped) > SLIPPED_M)
        told["outcome"] = "dropped" if told["lost"] else "slipped" if slipped else "held"
        return told


def play(job):
    tick, run = job
    return Run(run).play(tick)


def main(tick, runs):
    with open(runs, encoding="utf-8") as file:
        jobs = [(tick, run) for run in json.load(file)]
    with multiprocessing.Pool() as pool:
        told = pool.map(play, jobs, chunksize=1)
    json.dump({"version": mujoco.__version__, "runs": told}, sys.stdout)


if __name__ == "__main__":
    main(*sys.argv[1:])
