"""Damage to bytes and to settings, and how an attempt to read what came of it may end."""

from __future__ import annotations

import numpy as np

#: A refusal that was promised; the values as they were; others, and a finding that says so; others
#: that the file, which is a sound one of its kind, really holds.
REFUSED, SAME, TOLD, OTHER = "refused", "as it was", "told", "another sound file"


class Defect(AssertionError):
    """Something was accepted, or raised, that must not be."""


def places(tree: dict | list) -> list[tuple[dict | list, str | int]]:
    """Every place in nested settings: what holds a value, and the key or number of the value."""
    found: list[tuple[dict | list, str | int]] = []
    for key in tree if isinstance(tree, dict) else range(len(tree)):
        found.append((tree, key))
        if isinstance(tree[key], dict | list):
            found += places(tree[key])
    return found


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """The bytes with one to three accidents; headers, at the front, are hit half of the time."""
    out = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        end = len(out) if rng.random() < 0.5 else min(len(out), 2000)
        at = int(rng.integers(max(end, 1)))
        if rng.random() < 0.2:  # many formats keep their index at the end
            at = max(0, len(out) - 1 - int(rng.integers(400)))
        some = rng.integers(0, 256, rng.integers(1, 9), dtype=np.uint8).tobytes()
        match rng.integers(7):
            case 0 if out:
                out[at] ^= 1 << int(rng.integers(8))
            case 1:
                out[at : at + len(some)] = some
            case 2:
                del out[at:]
            case 3:
                out[at:at] = some
            case 4:
                out[at : at + 64] = bytes(len(out[at : at + 64]))
            case 5:
                out[at:at] = out[at : at + 64]
            case 6:
                del out[at : at + len(some)]
    return bytes(out)
