"""How the budget of processor time is shared, and what is said of what it was too short for."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from held import path

from residual.gap import clock as timing
from residual.gap import find_gap
from residual.gap.clock import Clock, OutOfTime
from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search import explain
from residual.gap.search.earlier import add_what_it_lacked, is_in_vain
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects import ConstantLoad, CoulombFriction, ViscousFriction
from sims.effects.friction import LoadDependentFriction
from sims.equations import EquationOfMotion
from sims.simulator import Channel


@pytest.fixture
def now(monkeypatch):
    """Seconds of processor time, to be set."""
    time = SimpleNamespace(seconds=0.0)
    fake = SimpleNamespace(process_time=lambda: time.seconds, perf_counter=lambda: time.seconds)
    monkeypatch.setattr(timing, "time", fake)
    return time


def test_later_searches_share_what_is_left_until_confirming_has_to_begin(now):
    clock = Clock(100 / 60)
    assert clock.search_until == 40
    now.seconds = 30
    with clock.once_more():
        assert clock.search_until == pytest.approx(30 + 0.65 * (80 - 30))
    now.seconds = 77
    assert not clock.searched
    now.seconds = 79
    assert clock.searched


def test_what_weighing_and_confirming_took_first_is_kept_for_later(now):
    clock = Clock(100 / 60)
    with clock.searching():
        now.seconds = 50  # ten beyond its time
    with clock.confirming():
        now.seconds = 54
    # 1.5 times 14 are kept: until 79.
    with clock.once_more():
        assert clock.search_until == pytest.approx(54 + 0.65 * (79 - 54))
    with clock.searching():
        now.seconds = 70  # thirty beyond
    with clock.once_more():
        assert clock.searched
        with clock.once_more(worth_it=True):
            assert not clock.searched


def test_a_later_search_is_given_up_in_time_and_the_first_never(now):
    clock, told = Clock(100 / 60), []
    tell = clock.checked(told.append)
    now.seconds = 500
    tell("the first")
    for worth_it, last in ((False, 85), (True, 200)):
        now.seconds = 60
        with clock.once_more(worth_it):
            now.seconds = last - 1
            tell("in time")
            now.seconds = last + 1
            with pytest.raises(OutOfTime):
                tell("too late")
    tell("afterwards")
    assert told == ["the first", "in time", "in time", "afterwards"]


class Slide(EquationOfMotion):
    """A slide on a screw, 2 kg."""

    dt = 0.02
    substeps = 4
    state_channels = (
        Channel("place", "m", "position", scale=1.0),
        Channel("speed", "m/s", "rate", rate_of="place", scale=2.0),
    )
    action_channels = (Channel("force", "N", "input", scale=20.0, low=-40.0, high=40.0),)

    def acceleration(self, q, v, u, force, p):
        return (u - 3.0 * v + force) / 2.0


def slides() -> list[Trajectory]:
    """Runs of a slide that loses 1.5 N and a tenth of its force, softened at rest."""
    rng, runs = np.random.default_rng(0), []

    def rates(_, x, u):
        brake = (1.5 + 0.1 * abs(u)) * np.tanh(x[1] / 1e-3)
        return [x[1], (u - 3.0 * x[1] - brake) / 2.0]

    for number in range(3):
        size = np.repeat(rng.uniform(1, 10 * (1 + number), 10), 15)
        force = size * np.repeat(rng.choice([-1, 1], 10), 15)
        true = path(rates, [0.0, 0.0], force[:-1], 0.02, method="LSODA")
        states = true + rng.normal(0, [5e-4, 5e-3], true.shape)
        runs.append(Trajectory(f"run {number}", 0.02 * np.arange(150), states, force[:-1, None]))
    return runs


@pytest.fixture(scope="module")
def runs() -> list[Trajectory]:
    return slides()


@pytest.mark.long
def test_what_there_is_no_time_for_is_one_note_and_leaves_the_form_open(runs, monkeypatch):
    monkeypatch.setattr(Clock, "searched", property(lambda _: True))
    result = find_gap(Slide(), runs, minutes=0.2)
    (sure,) = (v for v in result.verdicts if v.kind == "confirmed")
    assert sure.family == "dissipation" and "load_dependent_friction@place" in sure.form
    (note,) = (one.says for one in result.quality if "no time to look" in one.says)
    assert note.startswith("what is left may be load dependent friction")
    assert "a part on a spring" in note and note.endswith("give more --minutes")


def test_what_was_not_tried_in_its_place_leaves_an_effect_uncertain(runs, monkeypatch):
    # However fast the machine is, that time is over before anything is weighed.
    monkeypatch.setattr(explain, "WEIGHED", -np.inf)
    monkeypatch.setattr(explain, "AS_LONG", -2.0)
    monkeypatch.setattr(Clock, "searched", property(lambda _: True))
    result = find_gap(Slide(), runs, minutes=0.2)
    assert result.verdicts and not any(v.kind == "confirmed" for v in result.verdicts)
    assert any("no_time" in v.doubts for v in result.verdicts)


def test_a_search_begins_with_what_it_is_made_for(runs):
    ready = prepare(Slide(), runs, 0.5)
    few = [CoulombFriction("place"), ViscousFriction("place")]

    def search(effects):
        pool = candidates(Slide(), effects, ready.fitter.samples)
        return Search(Slide(), pool, ready.fitter)

    earlier = search(few)
    earlier.add({(0,): np.array([3.0])})
    later = search([*few, LoadDependentFriction("place")])
    later.add({(0,): np.array([3.0])})
    add_what_it_lacked(earlier, later)
    assert {(2,), (0, 2)} <= set(later.tried) and (1, 2) not in later.tried
    assert not is_in_vain(earlier, later)
    other = search([*few, ConstantLoad("place")])
    other.add({(0,): np.array([3.0])})
    add_what_it_lacked(earlier, other)
    assert (0, 2) in other.tried and is_in_vain(earlier, other)
    assert not is_in_vain(earlier, earlier)  # which lacks nothing
    assert later.error((0, 2)) < 0.5 * later.error((0,))
    again = search(few)
    add_what_it_lacked(earlier, again)
    assert list(again.tried) == [()]
