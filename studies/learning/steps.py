"""The four steps of the loop - collect, fit, train, measure - each found again if it was kept."""

from __future__ import annotations

import dataclasses
import functools
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sklearn.base import BaseEstimator

from policy.evaluate import collect
from policy.learner import Algorithm
from policy.scaling import Scaling
from residual.corrected import CorrectedSimulator
from residual.difference import DifferenceModel
from residual.measured import fit_measured
from residual.trajectories import Transitions
from simgap_files.atomic import jsonable
from sims.episodes import refuse_ended_at_once
from sims.rates import refuse_unrelated_rates
from sims.simulator import Simulator
from sims.system import System
from studies.learning.described import modules_in, settings_of
from studies.learning.episodes import Episodes
from studies.learning.fingerprint import fingerprint
from studies.learning.measuring import anywhere, where_it_goes
from studies.learning.results import Measured, Model, Samples
from studies.learning.streams import seeded, stream
from studies.learning.testing import Tested, tested
from studies.learning.training import Kind, Training, exploration, train, transitions, visited
from studies.learning.warm_start import ReplayRule, WarmStart

if TYPE_CHECKING:
    from studies.learning.kept import OnDisk
    from studies.running.progress import Progress


@dataclasses.dataclass(frozen=True)
class Steps:
    """The steps for one system, estimator, algorithm and seed.

    Args:
        system: What is controlled.
        estimator: Learns the difference; cloned, never changed.
        algorithm: Learns the policies.
        seed: Everything random follows from it.
        keeper: Keeps the steps; None keeps none.
        progress: Told what is going on.
        replay: See ``WarmStart``.
        uncertainty_penalty: See ``residual.uncertainty_penalty``.
        smoothing: Learn the difference from smoothed paths where states are measured, not from
            one step to the next.
        scaled: Whether observations and rewards are brought to a size that networks learn from,
            see ``Scaling``, measured on the simulator at hand.
        described: Settings behind the system that its parts do not tell, plain values.
    """

    system: System
    estimator: BaseEstimator
    algorithm: Algorithm
    seed: int
    keeper: OnDisk | None
    progress: Progress
    replay: ReplayRule = "first"
    uncertainty_penalty: float = 0.0
    smoothing: bool = True
    scaled: bool = False
    described: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def collect(
        self, policy: Training, samples: int, update: int, known: Model | None = None
    ) -> Samples:
        """True transitions under a policy with exploration noise.

        Args:
            policy: The last one.
            samples: How many.
            update: Which update they are for.
            known: What was learnt of the difference, for the state that the policy sees.
        """

        settings: dict[str, Any] = {"policy": policy.key, "samples": samples, "update": update}
        if known:
            settings |= {"known": known.key, **self._estimator}
        episodes = self._episodes("collect", settings)

        def compute() -> Samples:
            seed = stream(self.seed, "collect", update)
            noise = exploration(self.system, self.algorithm, seed)
            env = self.system.true_environment(self.corrected(known) if known else None)
            with self.progress.task(f"collect {samples} true samples", samples) as tell:
                runs = collect(policy.policy, env, samples, seed, noise, episodes.roll, tell)
            steps = [(visited(self.system, run), run.actions) for run in runs]
            for refuse in (refuse_ended_at_once, refuse_unrelated_rates):
                refuse("the true system", self.system.nominal, steps)
            return Samples(transitions(self.system, runs))

        return self._kept("collect", settings, compute, Samples.load, episodes)

    def fit(self, samples: Sequence[Samples]) -> Model:
        """The difference model on all transitions so far."""
        unfitted = DifferenceModel(seeded(self.estimator, self.seed), self.system.nominal)

        def compute() -> Model:
            data = Transitions.join([part.data for part in samples])
            title = f"fit {type(self.estimator).__name__} to {len(data)}"
            with self.progress.task(title, 1) as tell:
                begin = time.perf_counter()
                if self.system.measurement and self.smoothing:
                    sigma = self.system.measurement.sigma(self.system.nominal)
                    data = fit_measured(unfitted, data, sigma)
                else:
                    unfitted.fit(data)
                seconds = time.perf_counter() - begin
                tell(1, "")
            return Model(unfitted, data, seconds)

        settings = {
            "samples": [part.key for part in samples], "smoothing": self.smoothing,
            **self._estimator,
        }  # fmt: skip
        load = functools.partial(Model.load, unfitted=unfitted)
        return self._kept("fit", settings, compute, load)

    def train(
        self,
        kind: Kind,
        steps: int,
        start: WarmStart | Training | None = None,
        on: Model | Simulator | None = None,
        update: int = 0,
    ) -> Training:
        """A policy that learns on the simulator, a corrected one or the true system, and its tests.

        Args:
            kind: ``"cold"`` and ``"warm"`` learn on the true system.
            steps: Of the environment.
            start: Where it starts from; by default from nothing.
            on: The difference model to add to the simulator, or another simulator.
            update: Which update it belongs to.
        """
        settings: dict[str, Any] = {"steps": steps, "update": update, "replay": self.replay}
        if isinstance(start, WarmStart):
            settings |= start.settings()
        elif start:
            settings["after"] = start.key
        if isinstance(on, Model):
            settings |= {"model": on.key, "uncertainty_penalty": self.uncertainty_penalty}
            settings |= self._estimator
        elif on is not None:
            settings["on"] = settings_of(on)

        def load(folder: Path, key: str) -> Training:
            env = self.system.environment(self.system.nominal)
            return Training.load(folder, key, self.algorithm, env)

        compute = functools.partial(train, self, kind, steps, start, on, update)
        learnt = self._kept(kind, settings, compute, load)
        # Apart: what a robot in trouble costs is a test, and no training.
        policy = {"policy": learnt.key}
        episodes = self._episodes("test", policy)
        testing = functools.partial(tested, self, kind, learnt, on, episodes.roll)
        return learnt.tested(self._kept("test", policy, testing, Tested.load, episodes))

    def measure(self, model: Model, policy: Training, update: int) -> Measured:
        """Accuracy of the model along fresh true rollouts of the policy trained on it."""
        settings = {"model": model.key, "policy": policy.key, "update": update, **self._estimator}
        episodes = self._episodes("measure", settings)

        def compute() -> Measured:
            corrected, acting = self.corrected(model), policy.policy
            seed, elsewhere = (stream(self.seed, name, update) for name in ("measure", "elsewhere"))
            accuracy, taken = where_it_goes(
                self.system, self.algorithm, acting, corrected, seed, episodes.roll
            )
            found: dict[str, Any] = {"visited": accuracy, "rollout_steps": taken}
            if accuracy_there := anywhere(self.system, corrected, elsewhere):
                found["uniform"] = accuracy_there
            return Measured(jsonable(found))

        return self._kept("measure", settings, compute, Measured.load, episodes)

    def corrected(self, model: Model) -> CorrectedSimulator:
        """The simulator at hand with a difference model."""
        return CorrectedSimulator(self.system.nominal, model.difference)

    @functools.cached_property
    def _estimator(self) -> dict[str, Any]:
        return {"estimator": settings_of(self.estimator)}

    @functools.cached_property
    def scaling(self) -> Scaling | None:
        """To what size observations and rewards are brought; None as they are."""
        # Of no seed: it is the system's. All policies of a trial are made with one.
        env = self.system.environment(self.system.nominal)
        return Scaling.measured(env) if self.scaled else None

    @functools.cached_property
    def _common(self) -> dict[str, Any]:
        """What every step depends on."""
        return {
            "system": fingerprint(self.system),
            "described": dict(self.described),
            "algorithm": settings_of(self.algorithm),
            "seed": self.seed,
            "scaled": self.scaled,
        }

    def _episodes(self, purpose: str, settings: Mapping[str, Any]) -> Episodes:
        """Episodes of a step, kept one by one if the true system can only be sampled."""
        sampled = self.keeper is not None and not isinstance(self.system.true, Simulator)
        keep = functools.partial(self._kept, "episode") if sampled else None
        return Episodes(keep, {"purpose": purpose, **settings})

    def _kept(
        self, name: str, settings: Any, compute: Any, load: Any, of: Episodes | None = None
    ) -> Any:
        """A step, found again or computed; the episodes that it is made of are then let go."""
        if self.keeper is None:
            return compute()
        everything = {**self._common, **settings}
        # The classes of the estimator and of whatever else settings tell are among the modules.
        roots = [Steps, self.algorithm.kind(), *self.system.code()]
        roots += sorted(modules_in(everything))
        found = self.keeper.run(name, everything, roots, compute, load)
        if of:
            self.keeper.forget(of.keys)
        return found
