"""A forecast begins where its lead-in says, wherever that is sought from."""

import numpy as np
import pytest
from slides import Slide, braked, recorded

from residual.gap.fitting.starts import starts
from residual.gap.model.model import Model
from residual.gap.preparation.prepare import prepare


@pytest.fixture(scope="module")
def fitter():
    """Of a slide that moves half as far as its simulator would."""
    rng = np.random.default_rng(0)
    pwm = np.repeat(rng.uniform(-100, 100, 20), 20)
    places = braked(0.5 * pwm, 120.0, 4.0, 0.02)
    return prepare(Slide(), [recorded("run", places, pwm, 0.02, 1e-4, rng)], 0.3).fitter


@pytest.mark.parametrize("far", [0.0, 3.0, -30.0])
def test_the_guess_makes_no_difference(fitter, far):
    which = np.zeros(len(fitter.blocks.windows), np.int64)
    guess = fitter.nodes[fitter.blocks.windows.index[:, 0]]
    # As a fit of whole windows has it: what it is too far on at first it comes back by.
    off = far * fitter.scale * np.array([-0.2, 1.0])
    own, other = (
        starts(fitter, Model(Slide()), np.zeros((1, 0)), which, one) for one in (guess, guess + off)
    )
    np.testing.assert_allclose(other / fitter.scale, own / fitter.scale, atol=0.01)
