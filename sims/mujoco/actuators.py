"""What an actuator of a model file has to become for the effects on it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import mujoco
import numpy as np

from sims.mujoco.markup import Markup, Tag
from sims.simulator import Array

#: Attributes of MJCF's actuator shortcuts that ``general`` does not have.
SHORTCUTS = ("kp", "kv", "dampratio", "timeconst", "inheritrange", "input")

_GAINS = {int(mujoco.mjtGain.mjGAIN_FIXED): "fixed", int(mujoco.mjtGain.mjGAIN_AFFINE): "affine"}
_BIASES = {int(mujoco.mjtBias.mjBIAS_NONE): "none", int(mujoco.mjtBias.mjBIAS_AFFINE): "affine"}
_DYNAMICS = {
    int(mujoco.mjtDyn.mjDYN_NONE): "none",
    int(mujoco.mjtDyn.mjDYN_INTEGRATOR): "integrator",
    int(mujoco.mjtDyn.mjDYN_FILTER): "filter",
    int(mujoco.mjtDyn.mjDYN_FILTEREXACT): "filterexact",
}


def written(numbers: Iterable[Any]) -> str:
    """Numbers with all their digits."""
    return " ".join(repr(float(number)) for number in numbers)


class Circuit:
    """One actuator: gain, bias, dynamics, range and delay, and how they change.

    Each change returns why it cannot be expressed, or an empty string.

    Args:
        model: The compiled nominal.
        a: Index of the actuator.
        fields: Fields of the model that attributes have changed, (1, ...).
    """

    def __init__(self, model: Any, a: int, fields: Mapping[str, Array]) -> None:
        def value(field: str, index: int) -> Array:
            found = fields[field][0] if field in fields else getattr(model, field)
            return np.array(found[index], float)

        out = int(model.actuator_outadr[a])
        self.gear, self._gear = value("actuator_gear", out), np.array(model.actuator_gear[out])
        self.gain, self._gain = value("actuator_gainprm", a), np.array(model.actuator_gainprm[a])
        self.bias, self._bias = value("actuator_biasprm", a), np.array(model.actuator_biasprm[a])
        self.kind = int(model.actuator_gaintype[a])
        self.law = int(model.actuator_biastype[a])
        self.dynamics = int(model.actuator_dyntype[a])
        self.constants = np.array(model.actuator_dynprm[a])
        self.early = bool(model.actuator_actearly[a])
        self.limited = bool(model.actuator_forcelimited[a])
        self.range = np.array(
            np.reshape(model.actuator_ctrlrange, (-1, 2))[int(model.actuator_ctrladr[a])]
        )
        self.bounded = bool(model.actuator_ctrllimited[a])
        self._force = float(self.gain[0])
        self._shift = 0.0  # force that comes of a shifted command: it grows with the gain
        self._shaped = False
        self._general = False
        self.plain: dict[str, str | None] = {}

    @property
    def changed(self) -> bool:
        """Whether anything is to be written."""
        return bool(
            self.plain
            or self._general
            or not np.array_equal(self.gear, self._gear)
            or not np.array_equal(self.gain, self._gain)
            or not np.array_equal(self.bias, self._bias)
        )

    def scale(self, share: float) -> str:
        """The command counts ``1 + share`` times."""
        if self.kind != int(mujoco.mjtGain.mjGAIN_FIXED):
            return "its gain is no constant"
        self.gain[0] *= 1 + share
        self._shift_by(share * self._shift)
        self._shaped = self._general = True
        return ""

    def shift(self, amount: float) -> str:
        """An amount is added to the command."""
        if self.kind != int(mujoco.mjtGain.mjGAIN_FIXED) or self.dynamics:
            return "its gain is no constant, or it has a state"
        self._shaped = True
        return self._shift_by(self._force * amount)

    def _shift_by(self, force: float) -> str:
        self._shift += force
        return self._push(force) if force else ""

    def push(self, force: float) -> str:
        """A constant force acts on its joint."""
        if self.limited:
            return "the force of its actuator is limited"
        return self._push(force / float(self.gear[0]))

    def _push(self, force: float) -> str:
        if self.law not in _BIASES:
            return "its actuator has a law of its own"
        self.law = int(mujoco.mjtBias.mjBIAS_AFFINE)
        self.bias[0] += force
        self._general = True
        return ""

    def cut(self, level: float) -> str:
        """Commands are cut at plus and minus a level."""
        if self._shaped:
            return "commands are cut after a gain or bias"
        low, high = self.range if self.bounded else (-math.inf, math.inf)
        self.plain |= {
            "ctrllimited": "true",
            "ctrlrange": written([max(low, -level), min(high, level)]),
        }
        return ""

    def delay(self, seconds: float, step: float, runge_kutta: bool) -> str:
        """Commands arrive late."""
        if seconds < step * (1 - 1e-9):
            return "MuJoCo has no delay shorter than a time step"
        # RK4 reads the record of commands inside a step too, half a step early on average.
        late = seconds + 0.5 * step if runge_kutta else seconds
        samples = math.ceil(late / step - 1e-9) + 1
        self.plain |= {"delay": written([late]), "nsample": f"{samples}", "interp": "linear"}
        return ""

    def lag(self, seconds: float, runge_kutta: bool) -> str:
        """Commands are followed as by a first-order filter."""
        if self.dynamics:
            return "the actuator has dynamics of its own"
        kinds = mujoco.mjtDyn
        self.dynamics = int(kinds.mjDYN_FILTER if runge_kutta else kinds.mjDYN_FILTEREXACT)
        self.constants[0], self.early = seconds, not runge_kutta
        self._general = True
        return ""

    def write(self, markup: Markup, tag: Tag) -> str:
        """Change the actuator's tag; a shortcut becomes ``general`` where it has to."""
        markup.set(tag, **self.plain)
        if not np.array_equal(self.gear, self._gear):
            markup.set(tag, gear=written(self.gear))
        same_law = np.array_equal(self.gain, self._gain) and np.array_equal(self.bias, self._bias)
        if not self._general and same_law:
            return ""
        if tag.name == "position" and not self._general:
            markup.set(tag, kp=written(self.gain[:1]), kv=written([-self.bias[2]]), dampratio=None)
            return ""
        if tag.name == "velocity" and not self._general:
            markup.set(tag, kv=written(self.gain[:1]))
            return ""
        if not (self.kind in _GAINS and self.law in _BIASES and self.dynamics in _DYNAMICS):
            return "its actuator cannot be written as a general one"
        if tag.name != "general":
            markup.rename(tag, "general")
            if "inheritrange" in tag.attributes and "ctrlrange" not in self.plain:
                markup.set(tag, ctrlrange=written(self.range), ctrllimited="true")
            markup.set(tag, **dict.fromkeys(SHORTCUTS))
        markup.set(
            tag,
            gaintype=_GAINS[self.kind],
            gainprm=_trimmed(self.gain),
            biastype=_BIASES[self.law],
            biasprm=_trimmed(self.bias),
            dyntype=_DYNAMICS[self.dynamics],
            dynprm=_trimmed(self.constants),
        )
        if self.early:
            markup.set(tag, actearly="true")
        return ""


def _trimmed(numbers: Array) -> str:
    """At least three numbers, and as many as are not zero."""
    last = int(np.max(np.flatnonzero(numbers), initial=0))
    return written(numbers[: max(3, last + 1)])
