"""Names and channels of a compiled model: joints, bodies, actuators, states and controls."""

from __future__ import annotations

import dataclasses
from typing import Any

import mujoco
import numpy as np

from sims.simulator import Array, Channel, Joint

HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
FREE, BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)

#: Typical rates, where nothing in a model tells.
TURNING, SLIDING = 3.0, 1.0


def name_of(kind: str, model: Any, index: int) -> str:
    """The element's name, or its kind and index if it has none."""
    types = {
        "joint": mujoco.mjtObj.mjOBJ_JOINT,
        "body": mujoco.mjtObj.mjOBJ_BODY,
        "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
        "geom": mujoco.mjtObj.mjOBJ_GEOM,
        "site": mujoco.mjtObj.mjOBJ_SITE,
    }
    return mujoco.mj_id2name(model, types[kind], index) or f"{kind}{index}"


@dataclasses.dataclass(frozen=True)
class Drive:
    """A control and the actuator that receives it."""

    actuator: int
    name: str


def state_channels(model: Any) -> tuple[Channel, ...]:
    """Positions in the order of ``qpos``, velocities in that of ``qvel``, then activations."""
    positions: list[Channel] = []
    rates: list[Channel] = []
    for j in range(model.njnt):
        name, kind = name_of("joint", model, j), int(model.jnt_type[j])
        if kind in (HINGE, SLIDE):
            positions.append(_position(model, j, f"{name}_qpos"))
            unit, scale = ("rad/s", TURNING) if kind == HINGE else ("m/s", SLIDING)
            rates.append(Channel(f"{name}_qvel", unit, "rate", False, f"{name}_qpos", scale))
            continue
        if kind == FREE:
            for axis in "xyz":
                channel = f"{name}_qpos_{axis}"
                positions.append(Channel(channel, "m", "position", scale=1.0))
                rates.append(Channel(f"{name}_qvel_{axis}", "m/s", "rate", False, channel, SLIDING))
        for part in ("qw", "qx", "qy", "qz"):
            positions.append(Channel(f"{name}_qpos_{part}", "1", "other", scale=1.0))
        for axis in "xyz":
            # The rate of a quaternion is not its derivative, so it has no position of its own.
            rates.append(Channel(f"{name}_qvel_w{axis}", "rad/s", "other", scale=TURNING))
    activations = [
        Channel(f"{name_of('actuator', model, a)}_act" + (f"_{k}" if k else ""), "1", "other")
        for a in range(len(model.actuator_actnum))
        for k in range(int(model.actuator_actnum[a]))
    ]
    return (*positions, *rates, *activations)


def _position(model: Any, j: int, name: str) -> Channel:
    hinge = int(model.jnt_type[j]) == HINGE
    limited = bool(model.jnt_limited[j])
    low, high = model.jnt_range[j]
    scale = float(0.5 * (high - low)) if limited else 1.0
    # MuJoCo counts whole turns of a limited joint only as far as its range goes.
    return Channel(
        name, "rad" if hinge else "m", "position", angle=hinge and not limited, scale=scale
    )


def drives(model: Any) -> tuple[Drive, ...]:
    """One for each control, in the order of ``ctrl``."""
    found = []
    for a in range(len(model.actuator_ctrlnum)):
        name, count = name_of("actuator", model, a), int(model.actuator_ctrlnum[a])
        found += [Drive(a, name if count == 1 else f"{name} {k}") for k in range(count)]
    return tuple(found)


def action_channels(model: Any) -> tuple[Channel, ...]:
    """One for each control, with its range."""
    found = []
    for column, drive in enumerate(drives(model)):
        limited = bool(model.actuator_ctrllimited[drive.actuator])
        low, high = np.reshape(model.actuator_ctrlrange, (-1, 2))[column]
        scale = max(abs(low), abs(high)) if limited else _usual_control(model, drive.actuator)
        bounds = (float(low), float(high)) if limited else (-np.inf, np.inf)
        found.append(
            Channel(
                drive.name, _control_unit(model, drive.actuator), "input",
                scale=float(scale) or 1.0, low=bounds[0], high=bounds[1],
            )
        )  # fmt: skip
    return tuple(found)


def is_servo(model: Any, a: int) -> bool:
    """Whether an actuator follows a position or velocity by its own law."""
    return int(model.actuator_biastype[a]) == int(mujoco.mjtBias.mjBIAS_AFFINE) and bool(
        np.any(model.actuator_biasprm[a, 1:3])
    )


def joint_of(model: Any, a: int) -> int | None:
    """The hinge or slide joint that an actuator drives, if it drives one."""
    if int(model.actuator_trntype[a]) != int(mujoco.mjtTrn.mjTRN_JOINT):
        return None
    j = int(np.reshape(model.actuator_trnid, (-1, 2))[int(model.actuator_outadr[a]), 0])
    return j if int(model.jnt_type[j]) in (HINGE, SLIDE) else None


def _usual_control(model: Any, a: int) -> float:
    gain = abs(float(model.actuator_gainprm[a, 0]))
    if model.actuator_forcelimited[a] and gain and not is_servo(model, a):
        return float(np.max(np.abs(model.actuator_forcerange[a]))) / gain
    return 1.0


def _control_unit(model: Any, a: int) -> str:
    joint = joint_of(model, a)
    if joint is None:
        return "1"
    turns = int(model.jnt_type[joint]) == HINGE
    if is_servo(model, a):
        if model.actuator_biasprm[a, 1] == 0:
            return "rad/s" if turns else "m/s"
        return "rad" if turns else "m"
    gain, gear = model.actuator_gainprm[a, 0], model.actuator_gear[int(model.actuator_outadr[a]), 0]
    if gain == gear == 1 and not model.actuator_actnum[a]:
        return "N m" if turns else "N"
    return "1"


def joints(model: Any) -> tuple[Joint, ...]:
    """Hinges and slides, where a generalized force can act."""
    driven = {joint_of(model, a) for a in range(len(model.actuator_trntype))}
    scales = typical_forces(model)
    return tuple(
        Joint(
            name := name_of("joint", model, j),
            f"{name}_qpos",
            f"{name}_qvel",
            "N m" if int(model.jnt_type[j]) == HINGE else "N",
            float(scales[int(model.jnt_dofadr[j])]),
            driven=j in driven,
        )
        for j in range(model.njnt)
        if int(model.jnt_type[j]) in (HINGE, SLIDE)
    )


def typical_forces(model: Any) -> Array:
    """A force that matters at each degree of freedom, (nv,).

    The larger of the gravity load (root mean square over random poses) and what sets up a typical
    rate in a tenth of a second; no more than what limits the joint's actuator.
    """
    rng = np.random.default_rng(0)
    data = mujoco.MjData(model)
    weights, masses = [], []
    full = np.zeros((model.nv, model.nv))
    for _ in range(16):
        mujoco.mj_resetData(model, data)
        for j in range(model.njnt):
            if int(model.jnt_type[j]) in (HINGE, SLIDE):
                reach = 1.0 if not model.jnt_limited[j] else np.ptp(model.jnt_range[j]) / 2
                data.qpos[model.jnt_qposadr[j]] += min(reach, np.pi) * rng.uniform(-1, 1)
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, full)
        weights.append(np.array(data.qfrc_bias))
        masses.append(np.diag(full).copy())
    rate = np.array([SLIDING if _slides(model, d) else TURNING for d in range(model.nv)])
    force = np.maximum(
        np.sqrt(np.mean(np.square(weights), axis=0)), np.mean(masses, axis=0) * rate * 10
    )
    for a in range(len(model.actuator_trntype)):
        joint = joint_of(model, a)
        if joint is None or not model.actuator_forcelimited[a]:
            continue
        d = int(model.jnt_dofadr[joint])
        gear = abs(model.actuator_gear[int(model.actuator_outadr[a]), 0])
        most = float(np.max(np.abs(model.actuator_forcerange[a])) * gear)
        force[d] = min(force[d], most) if most else force[d]
    return np.asarray(force)


def typical_inertias(model: Any) -> Array:
    """Inertia that each degree of freedom moves in the reference pose, (nv,)."""
    return np.asarray(model.dof_M0, float)


def _slides(model: Any, d: int) -> bool:
    j = int(model.dof_jntid[d])
    kind = int(model.jnt_type[j])
    return kind == SLIDE or (kind == FREE and d - int(model.jnt_dofadr[j]) < 3)
