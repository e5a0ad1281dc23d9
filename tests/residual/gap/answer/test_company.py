"""What helps only beside what may not be there."""

import dataclasses
from types import SimpleNamespace

import pytest

from residual.gap.answer.company import helps_only_beside, in_company
from residual.gap.confirmation.claim import Claim
from residual.gap.result import Span, Verdict

#: Errors with a slope (0), a constant (1), a friction (2) and a trifle (3).
ERRORS = {
    (): 1.0, (0,): 1.1, (1,): 1.05, (0, 1): 0.2, (2,): 0.6, (0, 2): 0.7, (1, 2): 0.65,
    (0, 1, 2): 0.1, (2, 3): 0.6, (3,): 1.0,
}  # fmt: skip


def search():
    return SimpleNamespace(tried=ERRORS, error=ERRORS.__getitem__)


@pytest.mark.parametrize(
    ("key", "number", "others", "only"),
    [
        ((0, 1), 0, [1], True), ((0, 1), 0, [], False), ((0, 1, 2), 0, [1], True),
        ((0, 1, 2), 2, [0, 1], False), ((2, 3), 2, [3], False), ((2, 3), 2, [2], False),
    ],
)  # fmt: skip
def test_what_helps_nothing_without_another_is_told(key, number, others, only):
    assert helps_only_beside(search(), key, number, others) == only


def test_only_what_is_certain_beside_what_may_be_none_becomes_doubtful():
    slope = Claim(0, {}, (), (), (), (), True, True, True, False, (0.9, 0.8, 1.0))
    claims = [slope, dataclasses.replace(slope, number=1)]
    sure, open_, zero = (
        Verdict(kind, "k", "", {}, (), "", "", Span(0.9, 0.8, 1.0), doubts=doubts)
        for kind, doubts in (
            ("confirmed", ()), ("ambiguous", ("rivals",)), ("ambiguous", ("may_be_zero",)),
        )
    )  # fmt: skip
    for verdicts, wanted in (((sure, zero), True), ((sure, open_), False), ((zero, zero), False)):
        first, second = in_company(search(), (0, 1), claims, verdicts)
        assert first.in_company == wanted and not second.in_company
        assert first.sure != wanted
