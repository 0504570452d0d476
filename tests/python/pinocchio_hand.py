"""Computes with Pinocchio what blindgrasp computes of a hand, and prints the largest differences as JSON.

    python pinocchio_hand.py HAND.urdf POSTURES.json

POSTURES.json has the gravity, the names of the joints and of the fingertips' links in blindgrasp's order, and for each posture
the joint angles and blindgrasp's values: for every fingertip its centre, attitude and both Jacobians (by rows), and the
hand's mass matrix and gravity torques. A difference is absolute where a value is smaller than one, and relative above:
`|a - b| / max(1, |b|)`. For mass matrices and torques, whose entries may all be small, it is also told relative to the
largest entry of each.

The package is `pin`, which needs its own path: this script adds the .pth files of every folder in PYTHONPATH.
"""

import json
import os
import site
import sys

for folder in os.environ.get("PYTHONPATH", "").split(os.pathsep):
    if folder:
        site.addsitedir(os.path.abspath(folder))

import numpy as np  # noqa: E402  (found by the lines above)
import pinocchio as pin  # noqa: E402


class Differences:
    """The largest difference of each kind."""

    def __init__(self):
        self.largest = {}

    def add(self, kind, theirs, ours):
        ours = np.asarray(ours, dtype=float).reshape(np.shape(theirs))
        # `not` catches what is not a number.
        if not np.all(np.isfinite(ours)) or not np.all(np.isfinite(theirs)):
            raise SystemExit(f"{kind}: not finite")
        error = np.max(np.abs(theirs - ours) / np.maximum(1.0, np.abs(ours)))
        self.largest[kind] = max(self.largest.get(kind, 0.0), float(error))
        if kind in ("mass matrix", "gravity torques"):
            relative = np.max(np.abs(theirs - ours)) / max(np.max(np.abs(ours)), 1e-12)
            self.largest[f"{kind}, relative"] = max(
                self.largest.get(f"{kind}, relative", 0.0), float(relative)
            )


def main(urdf, postures):
    with open(postures, encoding="utf-8") as file:
        ours = json.load(file)
    model = pin.buildModelFromUrdf(urdf)
    model.gravity.linear = np.array(ours["gravity_m_s2"])
    data = model.createData()

    names = ours["joints"]
    if sorted(names) != sorted(list(model.names)[1:]) or model.nv != len(names):
        raise SystemExit(f"other joints: {list(model.names)}")
    # Pinocchio sorts branches by name.
    column = [model.joints[model.getJointId(name)].idx_v for name in names]
    row = [model.joints[model.getJointId(name)].idx_q for name in names]
    tips = [model.getFrameId(name) for name in ours["fingertips"]]

    differences = Differences()
    for posture in ours["postures"]:
        q = np.zeros(model.nq)
        q[row] = posture["angles_rad"]
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for tip, fingertip in zip(tips, posture["fingertips"]):
            placement = data.oMf[tip]
            differences.add("fingertip centres", placement.translation, fingertip["centre_m"])
            differences.add("fingertip attitudes", placement.rotation, fingertip["attitude"])
            jacobian = pin.getFrameJacobian(model, data, tip, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            differences.add("Jacobians", jacobian[:3, column], fingertip["linear_jacobian"])
            differences.add("angular Jacobians", jacobian[3:, column], fingertip["angular_jacobian"])
        mass = pin.crba(model, data, q)
        # Only one half is filled.
        mass = np.triu(mass) + np.triu(mass, 1).T
        differences.add("mass matrix", mass[np.ix_(column, column)], posture["mass_matrix"])
        weight = pin.computeGeneralizedGravity(model, data, q)
        differences.add("gravity torques", weight[column], posture["gravity_torques_nm"])
    json.dump(
        {"version": pin.__version__, "postures": len(ours["postures"]), "largest": differences.largest}, sys.stdout
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
