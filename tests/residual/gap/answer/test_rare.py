"""What is rarer than the library is certain only where little is left."""

from types import SimpleNamespace

import pytest

from residual.gap.answer.form import rare_beside_much
from sims.effects import CouplingSpring, LinearSpring


@pytest.mark.parametrize(
    ("adequate", "ratio", "rare"), [(True, 1.0, ()), (False, 9.0, ()), (False, 12.0, (1,))]
)
def test_only_beside_much(adequate, ratio, rare):
    known, further = LinearSpring("a"), CouplingSpring("a and b")
    search = SimpleNamespace(
        candidates=[SimpleNamespace(label=str(effect)) for effect in (known, further)]
    )
    answer = SimpleNamespace(
        key=(0, 1),
        found=SimpleNamespace(search=search, adequate=adequate),
        left=SimpleNamespace(ratio=ratio),
    )
    assert rare_beside_much(answer, [further]) == frozenset(rare)
