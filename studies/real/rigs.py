"""The measured rigs: which files are fitted, which judge, and what the answer key accepts.

Nothing in a key ever reaches ``find_gap``; it is for scoring only.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from sims import effects as known
from sims.effects.base import Effect
from studies.real.prepare import cut_coast, sum_accelerations

#: What takes energy out of a joint.
FRICTION = ("viscous_friction", "coulomb_friction", "stribeck_friction", "directional_friction")
DISSIPATION = (*FRICTION, "quadratic_drag", "friction_curve")
LATE = ("delay", "actuator_lag")


@dataclasses.dataclass(frozen=True)
class Part:
    """Logs, and what of them.

    Args:
        files: Names in the rig's folder.
        start, stop: In s on the log's clock, if not the config's.
        only: As in a column map, if not the config's.
    """

    files: tuple[str, ...]
    start: float | None = None
    stop: float | None = None
    only: Mapping[str, list[str | int]] | None = None


@dataclasses.dataclass(frozen=True)
class Rig:
    """One measured system.

    Args:
        folder: Of its logs.
        fit: What find_gap sees.
        judge: What every simulator is judged on.
        horizon: Of the forecasts that judge, in s.
        judged: Groups of channels; of each, the root of the sum of squares is one error.
        key: The key's effects, without their strengths.
        wanted: One set of accepted labels for each thing that has to be named, families included.
        supported: Further labels that the key does not contradict.
        slopes: Neighbourhood in s from which rates that were not measured are derived, to judge.
        derived: Columns of the prepared logs that hold such rates, by channel.
        prepare: Makes a log readable; source, target.
    """

    folder: str
    fit: Part
    judge: Part
    horizon: float
    judged: tuple[tuple[str, ...], ...]
    key: tuple[Effect, ...]
    wanted: tuple[frozenset[str], ...]
    supported: frozenset[str] = frozenset()
    slopes: float | None = None
    derived: Mapping[str, str] = dataclasses.field(default_factory=dict)
    prepare: Callable[[Path, Path], None] | None = None

    @property
    def name(self) -> str:
        """Of its config."""
        return self.folder.replace("-", "_")

    @property
    def allowed(self) -> frozenset[str]:
        """Labels that may be confirmed."""
        return self.supported.union(*self.wanted)


def _at(names: Sequence[str], *places: str) -> frozenset[str]:
    return frozenset(f"{name}@{place}" for name in names for place in places)


def _numbered(numbers: Sequence[int]) -> tuple[str, ...]:
    return tuple(f"run{number:02d}.csv" for number in numbers)


#: Mass in kg, radius in m and burn time in s of each rocket.
ROCKETS = {
    "andromeda.csv": (20.977, 0.07535, 3.76),
    "cavour.csv": (8.219, 0.0520, 3.80),
    "ndrt.csv": (20.846, 0.1015, 3.433),
    "erebus.csv": (5.82, 0.04575, 3.657),
    "juno3.csv": (24.05, 0.0655, 5.8),
    "bella.csv": (18.226, 0.0780, 2.43),
}


def _coast(source: Path, target: Path) -> None:
    cut_coast(source, target, *ROCKETS[source.name])


RIGS: Sequence[Rig] = (
    Rig(
        "airtrack",
        fit=Part(("real_linear_h_1.txt",)),
        judge=Part(("real_linear_h_1.txt",), stop=1e9),
        horizon=1.0,
        judged=(("position",),),
        key=(known.LinearSpring("position"), known.ViscousFriction("position")),
        wanted=(_at(("linear_spring",), "position"),),
        supported=_at(DISSIPATION, "position"),
    ),
    Rig(
        "heater",
        fit=Part(("data_step_test.csv",)),
        judge=Part(("data_step_test.csv",), stop=1e9),
        horizon=1e9,
        judged=(("temperature",),),
        key=(known.Delay("level"),),
        wanted=(_at(LATE, "level"),),
        supported=frozenset({"time_constant"}),
    ),
    Rig(
        "phone-drop",
        fit=Part(("phone_drop.csv",)),
        judge=Part(("phone_drop.csv",), only={"kind": ["up_down"]}),
        horizon=0.2,
        judged=(("velocity",),),
        key=(known.QuadraticDrag("phone"),),
        wanted=(_at(("quadratic_drag", "viscous_friction"), "phone"),),
        supported=_at(("constant_load",), "phone"),
        prepare=sum_accelerations,
    ),
    Rig(
        "pendulum-pair",
        fit=Part(("run_b.csv",)),
        judge=Part(("run_b.csv",), start=5.5, stop=8.2),
        horizon=1.0,
        judged=(("angle",),),
        key=(known.ParameterChange("payload"),),
        wanted=(frozenset({"payload", "actuator_gain@torque"}),),
        supported=frozenset({"inertia", "moment"}),
    ),
    Rig(
        "pendulum-swingup",
        fit=Part(("run_ddp.csv", "run_dircol.csv")),
        judge=Part(("run_ddp.csv", "run_dircol.csv")),
        horizon=1.0,
        judged=(("angle",),),
        key=(known.ActuatorGain("torque"), known.CoulombFriction("angle")),
        wanted=(frozenset({"actuator_gain@torque", "payload", "inertia"}),),
        supported=_at(FRICTION[1:], "angle") | {"moment"},
    ),
    Rig(
        "arm-three-axes",
        fit=Part(("run.csv",)),
        judge=Part(("run.csv",), start=4.5, stop=7.4),
        horizon=0.1,
        judged=(("rate 1",), ("rate 4",), ("rate 6",)),
        key=tuple(
            kind(f"angle {n}")
            for n in "146"
            for kind in (known.ViscousFriction, known.CoulombFriction)
        ),
        wanted=tuple(_at(FRICTION, f"angle {n}") for n in "146"),
        slopes=0.02,
    ),
    Rig(
        "arm-open-loop-torque",
        fit=Part(_numbered(range(1, 21, 2))),
        judge=Part(_numbered(range(2, 21, 2))),
        horizon=0.3,
        judged=(("rate 1",), ("rate 5",), ("rate 6",)),
        key=tuple(
            effect
            for n in "156"
            for effect in (
                known.ViscousFriction(f"angle {n}"),
                known.ParameterChange(f"inertia {n}"),
            )
        ),
        wanted=tuple(_at(FRICTION, f"angle {n}") for n in "156"),
        supported=frozenset({"inertia 1", "inertia 5", "inertia 6"}),
    ),
    Rig(
        "small-car-steps",
        fit=Part(_numbered([n for n in range(1, 42) if (n - 1) % 3 != 2])),
        judge=Part(_numbered([n for n in range(1, 42) if (n - 1) % 3 == 2])),
        horizon=1.0,
        judged=(("x", "y", "heading", "speed"),),
        key=(
            known.ActuatorLag("speed_command"),
            known.ActuatorGain("speed_command"),
            known.ActuatorLag("steering"),
        ),
        wanted=(_at(LATE, "speed_command"), _at(LATE, "steering")),
        supported=_at(("actuator_gain", "actuator_bias"), "steering")
        | {"actuator_gain@speed_command", "wheelbase"},
    ),
    Rig(
        "coasting-rockets",
        fit=Part(("andromeda.csv", "cavour.csv", "ndrt.csv")),
        judge=Part(("erebus.csv", "juno3.csv", "bella.csv")),
        horizon=5.0,
        judged=(("altitude",), ("speed",)),
        key=(known.QuadraticDrag("airframe"),),
        wanted=(_at(("quadratic_drag", "viscous_friction"), "airframe"),),
        derived={"speed": "speed"},
        prepare=_coast,
    ),
)
