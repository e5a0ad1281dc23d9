"""Measure a robot that hides something: MuJoCo's forces at a finer step, by another integrator.

None of it is the code that explains the logs: the truth is one ``mujoco.MjData`` stepped in a
loop, with forces and commands of its own.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from residual.trajectories import Trajectory

Array = NDArray[np.float64]

#: Commands on their way are looked at this often, in s.
LOOK = 1e-4

#: Friction of the truth creeps a hundred times less than that which find_gap hosts.
HARDER = (0.9999, 0.99999, 0.001)

#: What begins the name of a point mass at the end of a link, and its radius there, in m.
CARRIED, RADIUS = "payload at tip of body ", 1e-4

#: Time, positions and velocities of the truth -> command.
Controller = Callable[[float, Array, Array], Array]


@dataclasses.dataclass(frozen=True)
class Sensors:
    """What is measured.

    Args:
        noise: Standard deviation of the encoders, in rad or m.
        period: Seconds between samples, also the control period.
        rates: Whether velocities are measured too (with 50 times the noise).
    """

    noise: float = 5e-4
    period: float = 0.01
    rates: bool = False


def _carrying(path: str | Path, hidden: Mapping[str, float]) -> mujoco.MjModel:
    """A model file with a small heavy sphere at the end of each capsule that is to carry one."""
    spec, plain = mujoco.MjSpec.from_file(str(path)), mujoco.MjModel.from_xml_path(str(path))
    for name, mass in hidden.items():
        if not name.startswith(CARRIED):
            continue
        body = name.removeprefix(CARRIED)
        (geom,) = spec.body(body).geoms
        g = int(plain.body(body).geomadr[0])
        if geom.type != mujoco.mjtGeom.mjGEOM_CAPSULE:
            raise ValueError(f"nothing called {name!r} can be hidden")
        axis = np.zeros(3)
        mujoco.mju_rotVecQuat(axis, [0.0, 0.0, plain.geom_size[g, 1]], plain.geom_quat[g])
        ends = plain.geom_pos[g] + axis, plain.geom_pos[g] - axis
        tip = max(ends, key=lambda end: float(np.linalg.norm(end)))
        # A body of its own: beside an inertial element geoms count nothing.
        spec.body(body).add_body(pos=tip).add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[RADIUS, 0, 0], mass=mass, contype=0,
            conaffinity=0,
        )  # fmt: skip
    return spec.compile()


class Truth:
    """A model file with hidden changes, simulated finely.

    Args:
        path: The nominal model.
        hidden: Size by name: attributes as ``"frictionloss of joint elbow"``, effects as
            ``"delay@elbow_motor"``; sizes are changes, those of gains and groups shares.
        finer: Steps of the truth in one of the nominal. It is integrated by another method of
            fourth order: by MuJoCo's RK4, or, where that is the nominal's, by the 3/8 rule.
            Methods of first order are no truth: at a 250th of the step of arm2 their error over
            0.4 s is 0.2 mrad, and gets a name.

    Raises:
        ValueError: A name is not known.
    """

    def __init__(self, path: str | Path, hidden: Mapping[str, float], finer: int = 10) -> None:
        model = self.model = _carrying(path, hidden)
        kinds = mujoco.mjtIntegrator
        self.own = model.opt.integrator == kinds.mjINT_RK4
        if self.own and model.na:
            raise ValueError(f"{path}: activations are not integrated by the 3/8 rule")
        model.opt.integrator = kinds.mjINT_RK4
        model.opt.timestep /= finer
        model.dof_solimp[:, :3] = HARDER
        self.loads = np.zeros(model.nv)
        self.delay = np.zeros(model.nu)
        self.lag = np.zeros(model.nu)
        self.bias = np.zeros(model.nu)
        self.zone = np.zeros(model.nu)
        self.level = np.full(model.nu, np.inf)
        self.offset = np.zeros(model.nq)
        for name, size in hidden.items():
            if not name.startswith(CARRIED):
                self._hide(name, size)
        if self.delay.any() or self.lag.any():
            model.opt.timestep /= max(1, round(model.opt.timestep / LOOK))
        # What is derived from masses follows; bodies here are not compiled as "simple".
        mujoco.mj_setConst(model, mujoco.MjData(model))

    def _hide(self, name: str, size: float) -> None:
        model = self.model
        if "@" in name:
            effect, _, where = name.partition("@")
            known: dict[str, Array] = {
                "delay": self.delay,
                "actuator_lag": self.lag,
                "actuator_bias": self.bias,
                "dead_zone": self.zone,
                "saturation": self.level,
            }
            if effect in known:
                known[effect][model.actuator(where).id] = size
            elif effect == "constant_load":
                self.loads[self._dof(where)] = size
            elif effect == "linear_spring":
                model.jnt_stiffness[model.joint(where).id] = size
            elif effect == "sensor_offset":
                self.offset[model.joint(where.removesuffix("_qpos")).qposadr[0]] = size
            else:
                raise ValueError(f"no effect {effect!r} can be hidden")
            return
        what, _, place = name.rpartition(" of ") if " of " in name else (name, "", "")
        kind, _, element = place.partition(" ")
        shares = {
            "gain of all actuators": model.actuator_gainprm[:, :3],
            "damping of all joints": model.dof_damping,
            "friction of all contacts": model.geom_friction[:, 0],
        }
        if kind == "joint" and what == "quadratic damping":
            model.dof_dampingpoly[self._dof(element), 0] += size
        elif kind == "joint":
            getattr(model, f"dof_{what}")[self._dof(element)] += size
        elif kind == "body" and what == "mass":
            b = model.body(element).id
            model.body_inertia[b] *= 1 + size / model.body_mass[b]
            model.body_mass[b] += size
        elif kind == "body":
            model.body_ipos[model.body(element).id, "xyz".index(what[-1])] += size
        elif kind == "actuator":
            a = model.actuator(element).id
            model.actuator_gainprm[a, :3] *= 1 + size
            model.actuator_biasprm[a, :3] *= 1 + size
        elif name in shares:
            shares[name] *= 1 + size
            if "gain" in name:
                model.actuator_biasprm[:, :3] *= 1 + size
        elif what.startswith("gravity "):
            model.opt.gravity["xyz".index(what[-1])] += size
        else:
            raise ValueError(f"nothing called {name!r} can be hidden")

    def _dof(self, joint: str) -> int:
        return int(self.model.joint(joint).dofadr[0])

    def run(
        self,
        controller: Controller,
        seconds: float,
        sensors: Sensors,
        rng: np.random.Generator,
        start: tuple[Array, Array] | None = None,
        name: str = "run",
        stop: Callable[[Array], bool] | None = None,
    ) -> Trajectory:
        """One record.

        Args:
            controller: Gives the command of every control period.
            seconds: Length.
            sensors: What is measured.
            rng: Source of noise.
            start: Positions and velocities; the reference pose by default.
            name: Of the record.
            stop: Ends the record where positions say so.
        """
        model, data = self.model, mujoco.MjData(self.model)
        if start is not None:
            data.qpos[:], data.qvel[:] = start
        mujoco.mj_forward(model, data)
        data.qfrc_applied[:] = self.loads
        step = float(model.opt.timestep)
        fine = round(sensors.period / step)
        count = round(seconds / sensors.period)
        moving = bool(self.delay.any() or self.lag.any())
        together = max(1, round(LOOK / step)) if moving else fine
        stays = np.exp(-together * step / np.maximum(self.lag, 1e-12))
        positions, rates = [np.array(data.qpos)], [np.array(data.qvel)]
        commands: list[Array] = []
        past: list[Array] = []
        received: Array | None = None
        for k in range(count):
            command: Array = np.asarray(
                controller(k * sensors.period, data.qpos, data.qvel), np.float64
            )
            limited = model.actuator_ctrllimited.astype(bool)
            low, high = model.actuator_ctrlrange.T
            command = np.where(limited, np.clip(command, low, high), command)
            commands.append(command)
            past.append(self._shaped(command))
            for i in range(0, fine, together):
                late = (k * sensors.period + i * step - self.delay) / sensors.period
                index = np.clip(np.floor(late + 1e-9).astype(int), 0, k)
                wanted = np.array([past[n][j] for j, n in enumerate(index)])
                received = wanted if received is None else wanted + (received - wanted) * stays
                data.ctrl[:] = received
                self._advance(data, min(together, fine - i))
            positions.append(np.array(data.qpos))
            rates.append(np.array(data.qvel))
            if stop is not None and stop(data.qpos):
                break
        seen = np.array(positions) + self.offset
        seen += rng.normal(0, sensors.noise, seen.shape)
        speed = np.full((len(seen), model.nv), np.nan)
        if sensors.rates:
            speed = np.array(rates) + rng.normal(0, 50 * sensors.noise, speed.shape)
        times = sensors.period * np.arange(len(seen), dtype=np.float64)
        states: Array = np.concatenate([seen, speed], axis=1, dtype=np.float64)
        return Trajectory(name, times, states, np.array(commands, dtype=np.float64))

    def _advance(self, data: Any, steps: int) -> None:
        """Steps with the present command; the 3/8 rule: Kutta, "Beitrag zur naeherungsweisen
        Integration totaler Differentialgleichungen", Z. Math. Phys. 46 (1901)."""
        model = self.model
        if not self.own:
            mujoco.mj_step(model, data, steps)
            return
        h = float(model.opt.timestep)
        for _ in range(steps):
            q, v = np.array(data.qpos), np.array(data.qvel)
            rates: list[Array] = []
            forces: list[Array] = []
            for shares in ((), (1 / 3,), (-1 / 3, 1.0), (1.0, -1.0, 1.0)):
                _put(model, data, q, v, rates, forces, h, shares)
                mujoco.mj_forward(model, data)
                rates.append(np.array(data.qvel))
                forces.append(np.array(data.qacc))
            _put(model, data, q, v, rates, forces, h, (1 / 8, 3 / 8, 3 / 8, 1 / 8))
        mujoco.mj_forward(model, data)

    def _shaped(self, command: Array) -> Array:
        """Commands after bias, dead zone and saturation."""
        command = command + self.bias
        command = command - np.clip(command, -self.zone, self.zone)
        return np.clip(command, -self.level, self.level)


def _put(
    model: Any, data: Any, q: Array, v: Array, rates: list[Array], forces: list[Array],
    h: float, shares: tuple[float, ...],
) -> None:  # fmt: skip
    """Positions and velocities of ``data``: those given, moved by shares of rates and forces."""
    data.qpos[:], data.qvel[:] = q, v
    if shares:
        rate = np.sum([share * r for share, r in zip(shares, rates, strict=True)], axis=0)
        data.qvel += h * np.sum(
            [share * f for share, f in zip(shares, forces, strict=True)], axis=0
        )
        mujoco.mj_integratePos(model, data.qpos, rate, h)
