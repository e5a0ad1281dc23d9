"""A search whose sets of effects have given forecast errors, to see what is made of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from residual.gap.data.blocks import Blocks
from residual.gap.data.windows import Windows
from residual.gap.search.currency import Currency
from sims.effects import (
    ActuatorGain,
    ConstantLoad,
    CoulombFriction,
    Delay,
    ParameterChange,
    ViscousFriction,
)
from sims.pendulum_equation import PendulumEquation

#: Numbers 0 to 5; 1 and 2 are of one family.
EFFECTS = (
    ParameterChange("mass"),
    ViscousFriction("pivot"),
    CoulombFriction("pivot"),
    ConstantLoad("pivot"),
    ActuatorGain("voltage"),
    Delay("voltage"),
)


class Toy:
    """Sets with relative errors as given, by joint; blocks scatter by ``scatter``.

    Args:
        errors: By key: the error of every joint, or one for all.
        merits: By key; if not given, a multiple of the squared mean error.
        joints: Number of joints, a channel each.
        blocks: Number of blocks.
        scatter: Relative spread of the blocks' errors about the given ones.
        half: Errors at half the horizon, if not the same.
        surprising: Numbers of effects that are larger than usual.
        undoing: Sets of which two members undo each other.
        mass: Change of the mass, in kg.
        sizes: Numbers of a set's members, of which a tenth is a step; none if not given.
    """

    def __init__(
        self, errors, merits=None, joints=1, blocks=20, scatter=0.0, half=None, surprising=(),
        mass=0.02, undoing=(), sizes=None,
    ):  # fmt: skip
        self.sizes = sizes or {}
        self.surprising, self.undoing = set(surprising), set(undoing)
        fitted = (ParameterChange("mass", mass), *EFFECTS[1:])
        rng = np.random.default_rng(0)
        drive = rng.uniform(0.5, 2.0, (blocks, joints))
        errors = {(): 1.0, **errors}
        self.currency = Currency(drive**2, tuple((j,) for j in range(joints)))

        def squares(error):
            wobble = 1 + scatter * rng.standard_normal((blocks, joints))
            return (np.broadcast_to(error, joints) * drive * wobble) ** 2

        self.validated = {
            key: SimpleNamespace(
                squares=drive**2 if key == () else squares(error),
                half=squares((half or errors).get(key, error)),
                thetas=np.ones((5, len(key))),
            )
            for key, error in errors.items()
        }
        self.tried = {
            key: SimpleNamespace(
                merit=(merits or {}).get(key, 1e4 * float(np.mean(error)) ** 2),
                theta=np.zeros(len(key)),
                model=SimpleNamespace(
                    step=np.full(len(key), 0.1),
                    simulator=PendulumEquation(),
                    added=lambda _, key=key: tuple(fitted[n] for n in key),
                ),
            )
            for key, error in errors.items()
        }
        self.unfit, self.refused, self.nearly, self.extreme = set(), {}, set(), set()
        self.candidates = [
            SimpleNamespace(
                effect=e, label=str(e), knobs=(SimpleNamespace(field="change", strength=True),)
            )
            for e in EFFECTS
        ]
        self.simulator = PendulumEquation()
        windows = Windows.cut([(0, 4 * i, 4 * i + 4) for i in range(blocks)])
        self.fitter = SimpleNamespace(
            blocks=Blocks(windows, np.arange(blocks), np.arange(blocks) % 5),
            samples=SimpleNamespace(
                times=0.1 * np.arange(4.0 * blocks),
                names=("run",),
                measured=np.array([0]),
                seen=np.zeros((4 * blocks, 1)),
            ),
            tie=lambda nominal: 0.05,
            profiled=lambda fit: fit,
            chance=lambda one, other: 0.0,
        )

    def surprises(self, key):
        return len(self.surprising & set(key)) + self.unlikely(key)

    def unlikely(self, key):
        return int(key in self.undoing)

    def labels(self, key):
        return tuple(self.candidates[number].label for number in key)

    def usable(self):
        return [k for k in self.validated if k not in self.unfit and k not in self.refused]

    def sound(self, key):
        return key not in self.unfit and key not in self.refused

    def from_longer_leads(self, key):
        return self.validated[key].squares

    def best(self):
        return min(self.usable(), key=self.error)

    def error(self, key):
        return self.currency.error(self.validated[key].squares)

    def own(self, key):
        return np.array(self.sizes.get(key, np.zeros(len(key))))

    def numbers(self, key):
        return len(key)

    def contains(self, one, other):
        return False

    def twins_of(self, number):
        return []

    def same_motion(self, rest, one, other):
        return False

    def family(self, number):
        effect = self.candidates[number].effect
        family = effect.family_in(self.simulator)
        return f"{family}@{effect.where}" if family else ""
