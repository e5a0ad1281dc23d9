"""Two numbers that imitate another law are not certain; two that are off are."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.confirmation.following import by_another_law
from residual.trajectories import Trajectory
from sims.effects import ConstantLoad, ParameterChange
from sims.effects.parameter_curve import ParameterCurve
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT = 240.0


class Chemostat(FirstOrderSystem):
    """Cells that grow on what is fed, by Monod's law."""

    dt = DT
    state_channels = (
        Channel("biomass", "g/L", "other", scale=3.0),
        Channel("substrate", "g/L", "other", scale=3.0),
    )
    action_channels = (
        Channel("dilution", "1/h", "input", scale=0.2, low=0.0),
        Channel("feed", "g/L", "input", scale=10.0, low=0.0),
    )
    parameters: ClassVar = {
        "growth": Parameter(0.45, "1/h", "largest rate of growth", low=0.01),
        "half": Parameter(0.8, "g/L", "half saturation", low=0.01),
        "gain": Parameter(0.5, "1", "biomass of substrate", low=0.01),
    }

    def rate(self, s, p):
        return p.growth * s / (p.half + s)

    def derivative(self, x, u, p):
        s = np.maximum(x[:, 1], 0.0)
        grown = self.rate(s, p) * x[:, 0]
        biomass = grown - u[:, 0] * x[:, 0]
        substrate = u[:, 0] * (u[:, 1] - s) - grown / p.gain
        return np.stack([biomass, substrate], axis=1) / 3600.0


class Inhibited(Chemostat):
    """The same where much food slows growth down, by Haldane's law."""

    def rate(self, s, p):
        return p.growth * s / (p.half + s + s * s / 5.0)


def records(system, seed, rows=600):
    rng, found = np.random.default_rng(seed), []
    for number in range(2):
        dilution = np.repeat(rng.uniform(0.08, 0.3, rows // 60), 60)
        feed = np.repeat(rng.uniform(5.0, 14.0, rows // 100), 100)
        inputs = np.column_stack([dilution, feed])
        path = system.rollout([4.0, 1.5], inputs)
        seen = path + 0.05 * rng.standard_normal(path.shape)
        found.append(Trajectory(f"run {number}", DT * np.arange(rows + 1), seen, inputs))
    return found


def kinds(system, seed):
    offered = ("growth", "half", "gain", "proportional_loss", "constant_load")
    found = find_gap(Chemostat(), records(system, seed), effects=offered)
    return {verdict.label: verdict for verdict in found.verdicts if verdict.parameters}


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
def test_numbers_of_another_law_are_not_certain(seed):
    """But that growth falls where there is much food is."""
    named = kinds(Inhibited(), seed)
    sure = {label for label, verdict in named.items() if verdict.kind == "confirmed"}
    assert named and sure <= {"parameter_curve@growth over substrate"}
    if sure:
        first, *_, last = named[sure.pop()].parameters.values()
        assert first.value > 0 > last.value
    else:
        # Either number's own curve stands for the law, or the law is doubted.
        curves = {"parameter_curve@growth over substrate", "parameter_curve@half over substrate"}
        assert curves & named.keys() or any("law" in one.doubts for one in named.values())


def test_numbers_that_are_off_are_certain():
    changes = [ParameterChange("growth", -0.08), ParameterChange("gain", 0.1)]
    named = kinds(Chemostat(effects=changes), 1)
    assert {label for label, verdict in named.items() if verdict.kind == "confirmed"} == {
        "growth", "gain",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("key", "doubtful"), [((0, 1), set()), ((0, 1, 2), {0, 1, 2})], ids=["one", "two"]
)
def test_beside_two_parameters_that_follow_something_nothing_is_certain(key, doubtful):
    """Though nothing but noise is left: two curves at once fit whatever acts there."""
    curves = [ParameterCurve(name, "substrate") for name in ("growth", "gain")]
    effects = [ConstantLoad("biomass"), *curves]
    search = SimpleNamespace(candidates=[SimpleNamespace(effect=e) for e in effects], fitter=None)
    assert by_another_law(search, key, adequate=True, close=True) == doubtful


@pytest.mark.parametrize(("close", "doubtful"), [(True, set()), (False, {0})])
def test_a_parameter_that_follows_something_is_sure_only_where_little_is_left(close, doubtful):
    curve = ParameterCurve("growth", "substrate")
    search = SimpleNamespace(candidates=[SimpleNamespace(effect=curve)], fitter=None)
    assert by_another_law(search, (0,), adequate=False, close=close) == doubtful
