"""Screening: how each candidate effect would move the predicted windows, and what it would gain.

A candidate is tried at small values; from the change that it makes to every window, whatever free
start states and effects already chosen can imitate is projected out.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.contract import Fit
from residual.gap.fitting.intervals import at_bound
from residual.gap.model.candidates import Candidate, Trial

Array = NDArray[np.float64]

#: Part of what a pair leaves that a third effect has to take off for the three to be tried at once.
TOGETHER = 0.2
#: What a triple leaves over that of the best one, up to which it is tried, too: sizes are such that
#: the linear picture is a rough one.
MATCH = 2.0
#: Cosine between what two effects do from which on they say something of each other.
ALIKE = 0.1
#: The pairs of a triple.
_SIDES = ([0, 1], [0, 2], [1, 2])


@dataclasses.dataclass(frozen=True)
class Variant:
    """One candidate at trial values.

    Attributes:
        candidate: Its number in the list of candidates.
        trial: Values of its knobs that make the columns.
        columns: Which columns of the signature matrix belong to it.
        linear: Which knobs scale with the coefficient; the others keep their trial value.
    """

    candidate: int
    trial: Trial
    columns: tuple[int, ...]
    linear: NDArray[np.bool_]

    def start(self, coefficients: Array) -> Array:
        """Start value of the knobs from linear coefficients of the variant's columns."""
        start = self.trial.values[0].copy()
        # A secant far from one times itself says little about the true size.
        trusted = np.clip(coefficients, -3, 3) if len(coefficients) == 1 else coefficients
        start[self.linear] = trusted @ self.trial.values[:, self.linear]
        return start


@dataclasses.dataclass(frozen=True)
class Signatures:
    """Signature columns around a fit.

    Attributes:
        variants: One or more for each candidate.
        matrix: Columns, start states and chosen effects projected out, (rows, c).
        residual: The residual, projected likewise, (rows,).
    """

    variants: tuple[Variant, ...]
    matrix: Array
    residual: Array

    def rows_of(self, channels: Sequence[int], measured: int) -> NDArray[np.bool_]:
        """Which rows are of some channels, by their places among so many measured, (rows,)."""
        return np.isin(np.arange(len(self.residual)) % measured, channels)

    @property
    def strengths(self) -> Array:
        """Squared norm of every column."""
        return np.einsum("rc,rc->c", self.matrix, self.matrix)


def flatten(values: Array, weights: Array) -> Array:
    """(W, R, c) or (W, R) with the root of the window weights -> (W R, c) or (W R,)."""
    shaped = values * np.sqrt(weights).reshape(-1, *([1] * (values.ndim - 1)))
    return shaped.reshape(values.shape[0] * values.shape[1], *values.shape[2:])


def project_out(basis: Array, columns: Array) -> Array:
    """``columns`` less what the columns of ``basis`` can imitate."""
    if basis.shape[1] == 0:
        return columns
    size = np.sqrt(np.maximum((basis**2).sum(axis=0), 1e-300))
    q, _ = np.linalg.qr(basis / size)
    return columns - q @ (q.T @ columns)


def beside_starts(fit: Fit, columns: Array) -> Array:
    """Columns of every window, (W, R, c), less what its start state can imitate."""
    return columns - fit.basis @ (fit.basis.transpose(0, 2, 1) @ columns)


def signatures(fit: Fit, variants: Sequence[Variant], columns: Array) -> Signatures:
    """Signatures from what each variant adds to the whitened output of every window.

    A number that has come to its bound can imitate nothing more, so that what moves like it is
    seen: drag that is 40 % off beside a parameter that may be 3 % off.

    Args:
        fit: The fitted model around which they were computed.
        variants: Whose columns they are.
        columns: shape (W, R, c).
    """
    columns = beside_starts(fit, columns)
    free = [j for j in range(len(fit.theta)) if not at_bound(fit, j)]
    chosen = flatten(fit.by_knob[..., free], fit.weights)
    residual = flatten(fit.projected, fit.weights)
    return Signatures(
        tuple(variants),
        project_out(chosen, flatten(columns, fit.weights)),
        project_out(chosen, residual[:, None])[:, 0],
    )


def trials(candidates: Sequence[Candidate]) -> list[Variant]:
    """Variants of candidates at all their trial values, columns numbered in that order."""
    found, total = [], 0
    for number, candidate in enumerate(candidates):
        for trial in candidate.trials:
            places = tuple(range(total, total + len(trial.values)))
            found.append(Variant(number, trial, places, candidate.linear))
            total += len(places)
    return found


@dataclasses.dataclass(frozen=True)
class Gain:
    """What adding one or two variants would take off the cost, in the linear picture.

    Attributes:
        variants: Numbers of the variants.
        value: Fall of the cost.
        values: Start value of every knob of each variant's candidate.
    """

    variants: tuple[int, ...]
    value: float
    values: tuple[Array, ...]


def gains(
    found: Signatures, residual: Array | None = None, matrix: Array | None = None
) -> list[Gain]:
    """Linear gain of every variant alone, best first."""
    residual = found.residual if residual is None else residual
    matrix = found.matrix if matrix is None else matrix
    out = []
    for number, variant in enumerate(found.variants):
        value, coefficients = constrained(
            matrix[:, variant.columns], residual, variant.trial.one_sided
        )
        out.append(Gain((number,), value, (variant.start(coefficients),)))
    return sorted(out, key=lambda g: -g.value)


def constrained(
    columns: Array, residual: Array, one_sided: NDArray[np.bool_]
) -> tuple[float, Array]:
    """Least squares with some coefficients not negative; fall of the cost and coefficients."""
    gram, right = columns.T @ columns, columns.T @ residual
    return constrained_gram(gram, right, one_sided)


def constrained_gram(
    gram: Array, right: Array, one_sided: NDArray[np.bool_]
) -> tuple[float, Array]:
    """The same from the normal equations."""
    k = len(right)
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    alive = np.diag(gram) > 1e-12
    best = np.zeros(k)
    for _ in range(k + 1):
        best[:] = 0.0
        if not alive.any():
            return 0.0, best
        scaled = gram[np.ix_(alive, alive)] / np.outer(size[alive], size[alive])
        scaled = scaled + 1e-9 * np.eye(int(alive.sum()))
        best[alive] = np.linalg.solve(scaled, right[alive] / size[alive]) / size[alive]
        wrong = alive & one_sided & (best < 0)
        if not wrong.any():
            break
        alive = alive & ~wrong
    return max(float(2 * best @ right - best @ gram @ best), 0.0), best


def pair_gains(
    found: Signatures,
    top: int = 40,
    residual: Array | None = None,
    matrix: Array | None = None,
    without: Sequence[int] = (),
) -> list[Gain]:
    """Linear gain of every pair of variants of different candidates, best first.

    Args:
        found: Signatures.
        top: How many pairs are returned.
        residual, matrix: By default those with the chosen effects projected out.
        without: Candidates that take no part.
    """
    residual = found.residual if residual is None else residual
    matrix = found.matrix if matrix is None else matrix
    gram = matrix.T @ matrix
    right = matrix.T @ residual
    out = []
    for i, first in enumerate(found.variants):
        if first.candidate in without:
            continue
        for j in range(i + 1, len(found.variants)):
            second = found.variants[j]
            if second.candidate == first.candidate or second.candidate in without:
                continue
            columns = list(first.columns + second.columns)
            sides = np.append(first.trial.one_sided, second.trial.one_sided)
            value, c = constrained_gram(gram[np.ix_(columns, columns)], right[columns], sides)
            k = len(first.columns)
            starts = (first.start(c[:k]), second.start(c[k:]))
            out.append(Gain((i, j), value, starts))
    return sorted(out, key=lambda g: -g.value)[:top]


def triple_gains(found: Signatures, top: int, without: Sequence[int] = ()) -> list[Gain]:
    """Linear gain of three effects of one number each that help most together, best first.

    A triple counts if it leaves clearly less than each of the pairs in it: any third effect beside
    a good pair gains a trifle; and not much more than the best triple does. Effects that move
    different things, as those of two joints may, add up and need no triple. One with a coefficient
    of a forbidden sign is a pair, and left out.

    Args:
        found: Signatures.
        top: How many triples are returned at the most.
        without: Candidates that take no part.
    """
    ones = [
        number
        for number, variant in enumerate(found.variants)
        if len(variant.columns) == 1 and variant.candidate not in without
    ]
    columns = [found.variants[number].columns[0] for number in ones]
    own = np.array([found.variants[number].candidate for number in ones], dtype=int)
    one_sided = np.array([found.variants[n].trial.one_sided[0] for n in ones], dtype=bool)
    matrix = found.matrix[:, columns]
    size = np.maximum(np.sqrt(np.einsum("rc,rc->c", matrix, matrix)), 1e-150)
    gram = matrix.T @ matrix / np.outer(size, size) + 1e-9 * np.eye(len(ones))
    right = matrix.T @ found.residual / size
    triples = np.array(list(itertools.combinations(range(len(ones)), 3)), dtype=int).reshape(-1, 3)
    differ = [own[triples[:, i]] != own[triples[:, j]] for i, j in _SIDES]
    triples = triples[np.logical_and.reduce(differ)]
    value, c = _solved(gram, right, triples)
    linked = np.sum([np.abs(gram[tuple(triples[:, s].T)]) > ALIKE for s in _SIDES], axis=0) >= 2
    allowed = linked & ~(one_sided[triples] & (c < 0)).any(axis=1)
    pairs = np.max([_solved(gram, right, triples[:, side])[0] for side in _SIDES], axis=0)
    left = float(found.residual @ found.residual)
    together = left - value < (1 - TOGETHER) * (left - pairs)
    rows = np.flatnonzero(allowed & together)
    best = rows[np.argsort(-value[rows], kind="stable")][:top]
    best = best[left - value[best] <= MATCH * np.maximum(left - value[best[:1]], 1e-9 * left)]
    out = []
    for row in best:
        variants = tuple(ones[place] for place in triples[row])
        sizes = c[row] / size[triples[row]]
        starts = [found.variants[v].start(sizes[i : i + 1]) for i, v in enumerate(variants)]
        out.append(Gain(variants, float(value[row]), tuple(starts)))
    return out


def _solved(gram: Array, right: Array, places: NDArray[np.int64]) -> tuple[Array, Array]:
    """Falls of the cost and coefficients of many sets of columns, (n,) and (n, k)."""
    its = right[places]
    solved = np.linalg.solve(gram[places[:, :, None], places[:, None, :]], its[..., None])
    c = np.asarray(solved[..., 0], float)
    return np.asarray(np.einsum("nk,nk->n", c, its), float), c
