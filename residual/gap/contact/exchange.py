"""Effects that nearly move the windows as a chosen one does, tried in its place.

The ranking of ``search`` condemns them unheard: the start states have settled for the chosen one.
On a walk of Leo with measured rates a supply 7 % lower, once chosen, keeps the friction out that
it imitates: by the quadratic model friction leaves 29 % more, refitted in full steps 2 % less.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.contact.quadratic import Quadratic, minimise
from residual.gap.contact.refine import renew
from residual.gap.contact.search import Key, Proposal, Search
from residual.gap.contact.student import weights

Array = NDArray[np.float64]

#: Cosine of two signatures above which effects are lookalikes; supply and friction have 0.78.
ALIKE = 0.7
#: At most so many lookalikes of each chosen effect are tried, with so many full steps.
RIVALS, STEPS = 2, 4


def exchange(search: Search, current: Key) -> Key:
    """The best of the current set and of those with a lookalike in the place of a member."""
    starts = search.tried[current].aimed.starts
    for proposal in lookalikes(search, current):
        if proposal.key not in search.tried:
            model = search.model(proposal.key)
            near = renew(model, proposal.theta, search.shots, starts, STEPS)
            search.refit(dataclasses.replace(proposal, theta=near.theta), near.aimed)
    return search.best(current)


def lookalikes(search: Search, current: Key) -> list[Proposal]:
    """The current set with one member replaced, the likest first for each member."""
    found, quadratic = search.signatures(current)
    alike = np.abs(cosines(quadratic))
    theta = search.tried[current].theta
    place = np.array([column.chosen for column in found])
    owner = np.array([column.candidate for column in found])
    proposals: dict[Key, Proposal] = {}
    for member in current:
        own = np.flatnonzero((place >= 0) & (owner == member))
        there, others = search.reduced(current, [i for i in current if i != member])
        likeness = np.where(place < 0, alike[own].max(axis=0), 0.0)
        likest = np.argsort(-likeness)[:RIVALS]
        sets = [(*others, int(j)) for j in likest if likeness[j] > ALIKE]
        if not sets:
            continue
        loss, coefficients = minimise(there, sets)
        for chosen, c, left in zip(sets, coefficients, loss, strict=True):
            proposal = search.proposal(chosen, c, found, theta, left)
            proposals.setdefault(proposal.key, proposal)
    return list(proposals.values())


def cosines(quadratic: Quadratic) -> Array:
    """Cosine of any two columns over all windows, start states projected out, (k, k)."""
    weight = weights(quadratic.c, quadratic.freedom)
    product = np.einsum("w,wij->ij", weight, quadratic.a)
    length = np.sqrt(np.maximum(np.diag(product), 1e-300))
    cosine: Array = product / np.outer(length, length)
    return cosine
