"""docs/effects.md lists the whole library, with what the classes say."""

import inspect
import re
from pathlib import Path

import numpy as np
import pytest

from sims import effects
from sims.effects import Effect, library
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

PAGE = Path(__file__).parents[2] / "docs" / "effects.md"
PLACES = {"joint": "joint", "actuator": "input", "channel": "measured channel"}
PLACES["parameter"] = "parameter by a state or an input"


class Tank(FirstOrderSystem):
    state_channels = (Channel("level", "m", "other"), Channel("next level", "m", "other"))
    action_channels = (Channel("pump", "V", "input"),)

    def derivative(self, x, u, p):
        return u + 0.0 * x


class Coupled(EquationOfMotion):
    """Two joints that move each other."""

    state_channels = tuple(
        channel
        for name in ("pivot", "elbow")
        for channel in (
            Channel(name, "rad", "position", angle=True),
            Channel(f"{name} rate", "rad/s", "rate", rate_of=name),
        )
    )
    action_channels = (Channel("voltage", "V", "input"),)

    def acceleration(self, q, v, u, force, p):
        return force @ np.array([[2.0, -0.5], [-0.5, 3.0]])


def row(effect: Effect) -> str:
    """The effect's row of the table; units are those of a joint that turns, driven by a voltage."""
    first_order = effect.where.startswith("level")
    between = isinstance(effect, effects.Coupling | effects.Link)
    coupled = between or effect.name == "added_inertia"
    host = Coupled() if coupled else PendulumEquation()
    known = effect.quantities(Tank() if first_order else host)
    numbers = ", ".join(f"`{name}` {quantity.unit}" for name, quantity in known.items())
    place = PLACES[next(iter(inspect.signature(type(effect)).parameters))]
    place = "two states" if " and " in effect.where else place
    place = "two joints" if between else place
    family = effect.family + (f", {effect.subfamily}" if effect.subfamily else "")
    cells = (f"`{effect.name}`", place, numbers, family, effect.sentence, effect.needs)
    return f"| {' | '.join(cells)} |"


# One of each; on another channel an offset has another unit. Curves are asked for later.
CURVES = [
    kind("voltage" if kind.along == "input" else "pivot")
    for kind in effects.CURVES
    if kind is not effects.StateCurve
]
# Asked for where a command is followed, which a voltage is not, or where nothing hangs.
OTHERS = [
    effects.StateCurve("level"), effects.RateLimit("pivot"),
    effects.FlexiblePart("pivot"), effects.FlexibleJoint("pivot"), effects.AddedInertia("pivot"),
    effects.ParameterCurve("mass", "voltage"), effects.ParameterSpline("mass", "voltage"),
    effects.Unbalance("pivot"),
    effects.LoadDependentFriction("pivot"), effects.AsymmetricResponse("level"),
    effects.ConstantLoss("level"), effects.PowerLoss("level"), effects.AsymmetricDamping("pivot"),
    effects.AsymmetricActuator("voltage"), effects.SlewLimit("voltage"),
    effects.Hysteresis("voltage"), effects.Coupling("pivot by elbow"),
    effects.CouplingSpring("pivot and elbow"), effects.CouplingDamper("pivot and elbow"),
    effects.NegativeStiffness("pivot"), effects.CrankInertia("pivot"),
    effects.EncoderError("angle"),
    effects.UpperStop("pivot"), effects.LowerStop("pivot"), effects.AmbientFlow("pivot"),
    effects.DriveLimit("pivot"),
    effects.AsymmetricCouplingDamping("pivot and elbow"),
    effects.CouplingUnbalance("pivot and elbow"), effects.Reaction("level and next level"),
]  # fmt: skip
HOSTED = (*library(PendulumEquation()), *library(Tank()), *CURVES, *OTHERS)
LIBRARY = {e.name: e for e in reversed(HOSTED) if not isinstance(e, effects.ParameterChange)}


@pytest.mark.parametrize("effect", LIBRARY.values(), ids=str)
def test_the_page_has_its_row(effect):
    assert row(effect) in PAGE.read_text(encoding="utf-8").splitlines()


def test_the_page_has_nothing_else():
    text = PAGE.read_text(encoding="utf-8")
    listed = {line.split("`")[1] for line in text.splitlines() if line.startswith("| `")}
    assert listed == set(LIBRARY)


def test_the_page_says_which_lie_upstream_of_a_sensor():
    text = PAGE.read_text(encoding="utf-8")
    upstream = [e.name for e in HOSTED if e.upstream_of_sensor and e.where != "pump"]
    (line,) = [line for line in text.splitlines() if line.startswith("Upstream of a sensor")]
    assert [word for word in line.split("`")[1::2]] == upstream


def test_an_effect_of_one_s_own_acts_as_the_page_writes_it():
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (code,) = (block for block in blocks if block.startswith("# my_file.py"))
    exec(code, names := {"__name__": "my_file"})
    fan = names["FanTorque"]("pivot", 1e-4)
    assert fan.quantities(PendulumEquation())["level"].unit == "N m s^3/rad^3"
    braked = PendulumEquation(effects=[fan]).step([[0.0, 20.0]], [[0.0]])
    assert 0 < braked[0, 1] < PendulumEquation().step([[0.0, 20.0]], [[0.0]])[0, 1]


def test_what_one_derives_from_is_there():
    for name in ("JointEffect", "DryFriction", "StaticActuatorEffect", "SensorEffect"):
        assert f"`{name}`" in PAGE.read_text(encoding="utf-8") and hasattr(effects, name)
