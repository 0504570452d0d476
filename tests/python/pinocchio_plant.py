"""Computes constrained accelerations with Pinocchio's mass matrix and bias, and prints how far blindgrasp's plant is off, as JSON.

    python pinocchio_plant.py HAND.urdf STATES.json

STATES.json has the gravity, the names of the joints and of the fingertips' links in blindgrasp's order, the object, and for each
state the joint angles, the object's pose, the torques, the fingertips' material, the corners of the face that each touches, and
two directions on it; velocities as given, and what blindgrasp's plant makes of them: velocities that obey the rolling
constraints, and with these accelerations, multipliers, normal forces and torsional torques.

Everything here is written from the paper's equations with their corrections, and from nothing of blindgrasp: contact frames from
the corners (Eqs. 3, 5), the slip of two material points (Eq. 10), normal forces with a damper (Eq. 14), torsional viscosity
(Eq. 15), Newton and Euler for the object (Eqs. 20, 21). With `G = diag(H, M, I)` the system that is solved is

    [ G  P^T ] [  a     ]   [ u - bias - forces ]
    [ P   0  ] [ lambda ] = [ -(dP/dt) v        ]

`H` is Pinocchio's `crba`, the hand's bias its `nle`, and `(dP/dt) v` comes from the accelerations of its frames, which are also
confirmed by differences of `P v`. The velocities given are projected by

    [ G  P^T ] [ v      ]   [ G v_given ]
    [ P   0  ] [ Lambda ] = [ 0         ]

A difference is relative: the largest one among the numbers of a kind in a state, by the largest of these numbers. Kinds are the
accelerations of the trunk's joints, of the fingers' joints, of the object's centre and of its rotation, the multipliers, the normal
forces and the torsional torques of all contacts.
"""

import json
import os
import site
import sys
from xml.etree import ElementTree

for folder in os.environ.get("PYTHONPATH", "").split(os.pathsep):
    if folder:
        site.addsitedir(os.path.abspath(folder))

import numpy as np  # noqa: E402  (found by the lines above)
import pinocchio as pin  # noqa: E402

WORLD = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


class Hand:
    """Pinocchio's model, with joints in blindgrasp's order."""

    def __init__(self, urdf, told):
        description = ElementTree.parse(urdf)
        # What has no mass is given next to nothing in the URDF, because other tools refuse it; beside the smallest links it counts.
        for link in description.iter("link"):
            for inertial in link.findall("inertial"):
                if float(inertial.find("mass").get("value")) < 1e-12:
                    link.remove(inertial)
        self.model = pin.buildModelFromXML(ElementTree.tostring(description.getroot(), encoding="unicode"))
        self.model.gravity.linear = np.array(told["gravity_m_s2"])
        self.data = self.model.createData()
        names = told["joints"]
        if sorted(names) != sorted(list(self.model.names)[1:]) or self.model.nv != len(names):
            raise SystemExit(f"other joints: {list(self.model.names)}")
        # Pinocchio sorts branches by name.
        self.column = [self.model.joints[self.model.getJointId(name)].idx_v for name in names]
        self.tips = [self.model.getFrameId(name) for name in told["fingertips"]]

    def sorted(self, values):
        """Numbers of the joints in Pinocchio's order."""
        mine = np.zeros(self.model.nv)
        mine[self.column] = values
        return mine

    def dynamics(self, q, v):
        mass = pin.crba(self.model, self.data, self.sorted(q))
        # Only one half is filled.
        mass = np.triu(mass) + np.triu(mass, 1).T
        bias = pin.nle(self.model, self.data, self.sorted(q), self.sorted(v))
        return mass[np.ix_(self.column, self.column)], bias[self.column]

    def fingertips(self, q, v):
        """Of each fingertip: centre, both Jacobians, and its accelerations while no joint accelerates."""
        q, v = self.sorted(q), self.sorted(v)
        pin.forwardKinematics(self.model, self.data, q, v, np.zeros(self.model.nv))
        pin.computeJointJacobians(self.model, self.data, q)
        pin.updateFramePlacements(self.model, self.data)
        for tip in self.tips:
            jacobian = pin.getFrameJacobian(self.model, self.data, tip, WORLD)[:, self.column]
            drift = pin.getFrameClassicalAcceleration(self.model, self.data, tip, WORLD)
            yield self.data.oMf[tip].translation.copy(), jacobian[:3], jacobian[3:], drift.linear.copy(), drift.angular.copy()


class Contacts:
    """All contacts of a state: what velocities do to them, with rows for `(dq, dx, w)`."""

    def __init__(self, hand, state, q, x, turn, v):
        joints = len(q)
        dx, w = v[joints : joints + 3], v[joints + 3 :]
        self.slip, self.drift, self.indentation, self.torsion = [], [], [], []
        self.elastic, self.damping, self.viscosity, self.depth = [], [], [], []
        told = zip(state["contacts"], hand.fingertips(q, v[:joints]))
        for contact, (centre, linear, angular, acceleration, spin_rate) in told:
            # Eq. 3, from the corners of the face: counter-clockwise seen from outside, in the object's frame.
            corners = np.array(contact["corners_m"])
            area = sum(np.cross(a - corners[0], b - corners[0]) for a, b in zip(corners[1:], corners[2:]))
            inwards = -area / np.linalg.norm(area)
            distance = -np.mean(corners @ inwards)
            along, across = (turn @ np.array(axis) for axis in contact["directions"])
            y = turn @ inwards
            if np.max(np.abs(np.cross(along, y) - across)) > 1e-12 or abs(along @ y) > 1e-12:
                raise SystemExit("a contact frame that is none")
            # Eq. 5.
            r = contact["radius_m"]
            depth = r + distance - y @ (x - centre)
            rho = r - depth
            point = centre + rho * y
            # The object's material point less that of the fingertip, as a matrix of velocities.
            tip = linear - skew(rho * y) @ angular
            apart = np.hstack([-tip, np.eye(3), -skew(point - x)])
            # How it changes while nothing accelerates: the point of contact moves on both bodies.
            tip_velocity, tip_spin = linear @ v[:joints], angular @ v[:joints]
            y_rate = np.cross(w, y)
            rate = -(y_rate @ (x - centre) + y @ (dx - tip_velocity))
            arm_rate = -rate * y + rho * y_rate
            apart_rate = np.cross(w, tip_velocity + arm_rate - dx) - (
                acceleration + np.cross(spin_rate, rho * y) + np.cross(tip_spin, arm_rate)
            )
            for axis in (along, across):
                self.slip.append(axis @ apart)
                self.drift.append(np.cross(w, axis) @ (apart @ v) + axis @ apart_rate)
            # `d(dr)/dt`, from Eq. 5: `-(w x y).(x - x_i) - y.(dx - dx_i)`.
            self.indentation.append(np.hstack([y @ linear, -y, -np.cross(y, x - centre)]))
            self.torsion.append(np.hstack([-y @ angular, np.zeros(3), y]))
            area = np.pi * (2 * r * depth - depth**2)
            self.elastic.append(contact["stiffness_n_m2"] * depth**2)
            self.damping.append(contact["damping_n_s_m3"] * area)
            self.viscosity.append(contact["torsion_n_s_m"] * area)
            self.depth.append(depth)
        for name, value in vars(self).items():
            setattr(self, name, np.array(value))


def rotation(axis_angle):
    return pin.exp3(np.asarray(axis_angle))


def drift_by_differences(hand, state, q, x, turn, v):
    """`(dP/dt) v` by central differences of `P v` along the motion, extrapolated once."""
    joints = len(q)

    def slip(t):
        moved = rotation(t * v[joints + 3 :]) @ turn
        return Contacts(hand, state, q + t * v[:joints], x + t * v[joints : joints + 3], moved, v).slip @ v

    halves = [(slip(t) - slip(-t)) / (2 * t) for t in (1e-4, 5e-5)]
    return (4 * halves[1] - halves[0]) / 3


def solve(mass, rows, forces, rates):
    """Accelerations and multipliers of one system with constraints."""
    n, m = len(mass), len(rows)
    matrix = np.block([[mass, rows.T], [rows, np.zeros((m, m))]])
    # Rows and columns to one size: joints, metres and newtons differ by orders of magnitude.
    scale = np.hstack([1 / np.sqrt(np.diag(mass)), np.ones(m)])
    scale[n:] = 1 / np.linalg.norm(rows * scale[:n], axis=1)
    matrix = matrix * scale[:, None] * scale
    right = np.hstack([forces, rates]) * scale
    found = np.linalg.solve(matrix, right)
    # Once more for what rounding has left.
    found += np.linalg.solve(matrix, right - matrix @ found)
    found *= scale
    return found[:n], found[n:], np.linalg.cond(matrix)


class Differences:
    """The largest difference of each kind."""

    def __init__(self):
        self.largest = {}

    def add(self, kind, theirs, ours):
        theirs, ours = np.asarray(theirs), np.asarray(ours, dtype=float)
        if theirs.shape != ours.shape or not np.all(np.isfinite(ours)) or not np.all(np.isfinite(theirs)):
            raise SystemExit(f"{kind}: not finite, or another number of them")
        if ours.size == 0:
            return
        error = np.max(np.abs(theirs - ours)) / np.max(np.abs(theirs))
        self.largest[kind] = max(self.largest.get(kind, 0.0), float(error))


def main(urdf, states):
    with open(states, encoding="utf-8") as file:
        told = json.load(file)
    hand = Hand(urdf, told)
    gravity = np.array(told["gravity_m_s2"])
    trunk = np.array(told["trunk"], dtype=int)
    differences, drifts, condition, deepest = Differences(), 0.0, 0.0, []
    for state in told["states"]:
        q, x = np.array(state["angles_rad"]), np.array(state["position_m"])
        turn = np.array(state["attitude"])
        v = np.array(state["velocities"])
        joints = len(q)
        fingers = np.setdiff1d(np.arange(joints), trunk)
        inertia = turn @ np.array(told["inertia_kg_m2"]) @ turn.T
        mass = np.zeros((joints + 6, joints + 6))
        mass[:joints, :joints], bias = hand.dynamics(q, v[:joints])
        mass[joints : joints + 3, joints : joints + 3] = told["mass_kg"] * np.eye(3)
        mass[joints + 3 :, joints + 3 :] = inertia
        contacts = Contacts(hand, state, q, x, turn, v)
        if np.min(contacts.depth) <= 0:
            raise SystemExit("a fingertip that does not touch")
        deepest.append(float(np.max(contacts.depth)))

        # Velocities that obey the constraints: nearest to those given, by kinetic energy.
        given = np.array(state["given_velocities"])
        nearest, _, _ = solve(mass, contacts.slip, mass @ given, np.zeros(len(contacts.slip)))
        differences.add("velocities, projected", nearest, v)

        by_differences = drift_by_differences(hand, state, q, x, turn, v)
        drifts = max(drifts, float(np.max(np.abs(contacts.drift - by_differences)) / np.max(np.abs(contacts.drift))))

        normal = contacts.elastic + contacts.damping * (contacts.indentation @ v)
        twist = -contacts.viscosity * (contacts.torsion @ v)
        w = v[joints + 3 :]
        forces = np.hstack([np.array(state["torques_nm"]) - bias, told["mass_kg"] * gravity, -np.cross(w, inertia @ w)])
        forces += contacts.torsion.T @ twist - contacts.indentation.T @ normal
        accelerations, multipliers, worst = solve(mass, contacts.slip, forces, -contacts.drift)
        condition = max(condition, float(worst))
        ours = np.array(state["accelerations"])
        differences.add("accelerations of the trunk", accelerations[trunk], ours[trunk])
        differences.add("accelerations of the fingers", accelerations[fingers], ours[fingers])
        differences.add("acceleration of the object", accelerations[joints : joints + 3], ours[joints : joints + 3])
        differences.add("rotation of the object", accelerations[joints + 3 :], ours[joints + 3 :])
        differences.add("multipliers", multipliers, state["multipliers_n"])
        differences.add("normal forces", normal, state["normal_n"])
        differences.add("torsional torques", twist, state["torsion_nm"])
    json.dump(
        {
            "version": pin.__version__,
            "states": len(told["states"]),
            "largest": differences.largest,
            "drift by differences": drifts,
            "condition": condition,
            "deepest_m": max(deepest),
        },
        sys.stdout,
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
