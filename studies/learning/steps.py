"""The four steps of the loop - collect, fit, train, measure - each found again if it was kept."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sklearn.base import BaseEstimator

from policy.evaluate import collect
from policy.learner import Algorithm
from policy.scaling import Scaling
from policy.selection import Point
from residual.corrected import CorrectedSimulator
from residual.difference import DifferenceModel
from residual.measured import fit_measured
from residual.trajectories import Transitions
from residual.uncertainty_penalty import PenalisedTask
from simgap_files import jsonable
from sims.episodes import refuse_ended_at_once
from sims.rates import refuse_unrelated_rates
from sims.simulator import Simulator
from sims.system import System
from studies.learning.described import modules_in, settings_of
from studies.learning.fingerprint import fingerprint
from studies.learning.measuring import anywhere, where_it_goes
from studies.learning.results import Measured, Model, Samples
from studies.learning.streams import seeded, stream
from studies.learning.training import Training, exploration, train, transitions, visited
from studies.learning.warm_start import Recorder, ReplayRule, WarmStart

if TYPE_CHECKING:
    from studies.learning.kept import OnDisk
    from studies.running.progress import Progress

# Policies learnt from nothing begin with random actions, the baselines too.
RANDOM_STEPS = 1000

Kind = Literal["idealised", "difference", "control", "corrected", "cold", "warm"]
_TITLES = {
    "idealised": "train on the simulator",
    "difference": "train on the corrected simulator",
    "control": "train on, no difference model",
    "corrected": "train on what was corrected by name",
    "cold": "cold start on the true system",
    "warm": "warm start on the true system",
}


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

        def compute() -> Samples:
            seed = stream(self.seed, "collect", update)
            noise = exploration(self.system, self.algorithm, seed)
            env = self.system.true_environment(self._corrected(known) if known else None)
            with self.progress.task(f"collect {samples} true samples", samples) as tell:
                runs = collect(policy.policy, env, samples, seed, noise)
                tell(samples, "")
            steps = [(visited(self.system, run), run.actions) for run in runs]
            for refuse in (refuse_ended_at_once, refuse_unrelated_rates):
                refuse("the true system", self.system.nominal, steps)
            return Samples(transitions(self.system, runs))

        settings: dict[str, Any] = {"policy": policy.key, "samples": samples, "update": update}
        if known:
            settings |= {"known": known.key, **self._estimator}
        code = (self.estimator,) if known else ()
        return self._kept("collect", settings, compute, Samples.load, *code)

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
        return self._kept(
            "fit",
            settings,
            compute,
            lambda folder, key: Model.load(folder, key, unfitted),
            self.estimator,
        )

    def train(
        self,
        kind: Kind,
        steps: int,
        start: WarmStart | Training | None = None,
        on: Model | Simulator | None = None,
        update: int = 0,
    ) -> Training:
        """A policy that learns on the simulator, on a corrected one or on the true system.

        Args:
            kind: ``"cold"`` and ``"warm"`` learn on the true system.
            steps: Of the environment.
            start: Where it starts from; by default from nothing.
            on: The difference model to add to the simulator, or another simulator.
            update: Which update it belongs to.
        """
        settings: dict[str, Any] = {"steps": steps, "update": update, "replay": self.replay}
        code: tuple[Any, ...] = ()
        if isinstance(start, WarmStart):
            settings |= start.settings()
        elif start:
            settings["after"] = start.key
        if isinstance(on, Model):
            settings |= {"model": on.key, "uncertainty_penalty": self.uncertainty_penalty}
            settings |= self._estimator
            code = (self.estimator,)
        elif on is not None:
            settings["on"] = settings_of(on)
            code = (on,)

        def compute() -> Training:
            return self._train(kind, steps, start, on, update)

        def load(folder: Path, key: str) -> Training:
            env = self.system.environment(self.system.nominal)
            return Training.load(folder, key, self.algorithm, env)

        return self._kept(kind, settings, compute, load, *code)

    def measure(self, model: Model, policy: Training, update: int) -> Measured:
        """Accuracy of the model along fresh true rollouts of the policy trained on it."""
        settings = {"model": model.key, "policy": policy.key, "update": update, **self._estimator}
        return self._kept(
            "measure",
            settings,
            lambda: self._measure(model, policy, update),
            Measured.load,
            self.estimator,
        )

    def _train(
        self,
        kind: Kind,
        steps: int,
        start: WarmStart | Training | None,
        on: Model | Simulator | None,
        update: int,
    ) -> Training:
        on_true = kind in ("cold", "warm")
        simulator, task, difference = self.system.nominal, self.system.task, None
        if isinstance(on, Model):
            difference = on.difference
            simulator = self._corrected(on)
            if self.uncertainty_penalty:
                task = PenalisedTask.around(task, difference, on.data, self.uncertainty_penalty)
        elif on is not None:
            simulator = on
        env, tested = (
            self.system.true_environment() if on_true else self.system.environment(simulator, task)
            for _ in range(2)
        )
        sigma = self.system.cold_noise_sigma if start is None else None
        seed = stream(self.seed, "train", kind, update)
        learner = self.algorithm.make(env, seed, sigma, self._scaling)
        recorder = None
        if isinstance(start, WarmStart):
            if start.rows:
                with self.progress.task("take up what was simulated", start.rows) as tell:
                    again = isinstance(on, Simulator)
                    start.fill(learner, env, again, lambda done: tell(done, ""))  # type: ignore[arg-type]
            learner.restore(start.last.learner.networks())
        elif start:
            learner.restore(start.learner.networks())
        if not on_true and (self.replay == "all" or kind in ("difference", "control")):
            recorder = Recorder(env)  # type: ignore[arg-type]
        with self.progress.task(_TITLES[kind], steps) as tell:

            def report(point: Point) -> None:
                numbers = {"return": point.deterministic}
                tell(point.step, f"return {point.deterministic:.4g}", numbers)

            done = train(
                self.system,
                learner,
                recorder or env,
                tested,
                steps,
                stream(self.seed, "select", kind, update),
                # Of no kind and no update: what differs between policies is not where they began.
                stream(self.seed, "test starts"),
                report,
                on_true,
                RANDOM_STEPS if start is None else 0,
                # One of its own: what the filter steps is not what was trained on and held.
                self._corrected(on) if isinstance(on, Model) else simulator,
            )
        held = simulator.held if isinstance(simulator, CorrectedSimulator) else 0
        taken = None
        if recorder:
            taken = recorder.taken(difference if self.replay == "all" else None)
        return dataclasses.replace(done, simulated=taken, summary=done.summary | {"held": held})

    def _measure(self, model: Model, policy: Training, update: int) -> Measured:
        corrected, acting = self._corrected(model), policy.policy
        seed, elsewhere = (stream(self.seed, name, update) for name in ("measure", "elsewhere"))
        found = {"visited": where_it_goes(self.system, self.algorithm, acting, corrected, seed)}
        if accuracy := anywhere(self.system, corrected, elsewhere):
            found["uniform"] = accuracy
        return Measured(jsonable(found))

    def _corrected(self, model: Model) -> CorrectedSimulator:
        return CorrectedSimulator(self.system.nominal, model.difference)

    @cached_property
    def _estimator(self) -> dict[str, Any]:
        return {"estimator": settings_of(self.estimator)}

    @cached_property
    def _scaling(self) -> Scaling | None:
        # Of no seed: it is the system's. All policies of a trial are made with one.
        env = self.system.environment(self.system.nominal)
        return Scaling.measured(env) if self.scaled else None

    @cached_property
    def _common(self) -> dict[str, Any]:
        """What every step depends on."""
        return {
            "system": fingerprint(self.system),
            "described": dict(self.described),
            "algorithm": settings_of(self.algorithm),
            "seed": self.seed,
            "scaled": self.scaled,
        }

    def _kept(self, name: str, settings: Any, compute: Any, load: Any, *code: Any) -> Any:
        if self.keeper is None:
            return compute()
        everything = {**self._common, **settings}
        roots = [Steps, self.algorithm.kind(), *self.system.code(), *code]
        roots += sorted(modules_in(everything))
        return self.keeper.run(name, everything, roots, compute, load)
