"""The environments: one flight, and several side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from controller.compiling.function import BoundCall, Described
from controller.law import Array
from cosim.batch.fused import require_fused
from cosim.batch.variation import Variation
from cosim.learning.control_period import (
    REGION,
    REWARD,
    TERMINATED,
    TRUNCATED,
    VEHICLE,
    Episode,
    advance_period,
    begin,
    call_each,
)
from cosim.scenario.law_factory import law_of, require_no_fmus
from cosim.scenario.scenario import Scenario, load_scenario
from cosim.scenario.true_vehicle import start_values
from cosim.simulation.bindings import BoundLaw, bind_rules
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.make_step import NoiseSource, exchanged_variables, make_data, make_model, step_signals
from cosim.simulation.stepped_plant import plant_calls
from cosim.step.score import FlightMetrics
from plant_fmu import Plant, PlantError

_SEEDS = 1 << 31  # number of seeds of a scenario


class _Setup:
    """What all flights of an environment have in common."""

    def __init__(
        self, scenario: Scenario | str | Path, overrides: Sequence[str], vary: Mapping[str, tuple[float, float]]
    ) -> None:
        base = scenario if isinstance(scenario, Scenario) else load_scenario(scenario, overrides)
        require_fused(base, "learning")
        require_no_fmus(base, "learning")
        self.variation = Variation(base, list(vary))
        self.low, self.high = np.array(list(vary.values()), dtype=float).reshape(-1, 2).T
        self.scale = greatest_wrench(base.vehicle)  # N, N m
        size = VEHICLE + REGION * (1 + len(base.regions)) + len(base.criteria)
        self.observations, self.actions = Box(-np.inf, np.inf, (size,)), Box(-1.0, 1.0, (6,))

    def draw(self, rng: np.random.Generator) -> Scenario:
        """Draw the scenario of an episode."""
        if not len(self.low):
            return self.variation.base
        return self.variation.scenario(rng.uniform(self.low, self.high).tolist(), int(rng.integers(_SEEDS)))


class _Flight:
    """The flight of one episode after another, with one plant; it writes into the arrays that it is given."""

    def __init__(self, setup: _Setup, wrench: Array, observation: Array, outcome: Array) -> None:
        self._setup, self._wrench, self._seen = setup, wrench, (observation, outcome)
        self._plant = Plant(setup.variation.base.vehicle)
        self.close = self._plant.close
        self._kept: list[Any] = []
        self._bound_law: BoundLaw | None = None

    def begin(self, rng: np.random.Generator) -> None:
        """Begin an episode."""
        scenario, plant = self._setup.draw(rng), self._plant
        plant.reset()
        plant.set(start_values(scenario) | {"seed": int(rng.integers(_SEEDS))})
        plant.initialize()
        # most of the time goes into binding C to arrays: those of the flight before are filled again, if they fit
        if not (self._kept and self._bound_law is None and self._refill(scenario)):
            self._bind(scenario)
        noise = NoiseSource(scenario, len(self.data.noise), rng)
        noise.draw(len(noise.values))
        self.data.noise[:] = noise.values
        self._start.call()
        if self.data.failed_step >= 0:
            raise PlantError(f"{scenario.name}: the plant has no outputs at the beginning")

    def _make(self, scenario: Scenario) -> tuple[Any, ...]:
        """Make the arguments of a period, but for those that are given."""
        inputs, outputs = exchanged_variables(scenario)
        calls = plant_calls(scenario.vehicle, self._plant.native(inputs, outputs), self._plant.native)
        model, self._signals = make_model(scenario, self.law), step_signals(scenario, self.law, inputs, outputs)
        noise = NoiseSource(scenario, 1 + scenario.steps // scenario.control_every)
        data = make_data(scenario, model, self.law, self._signals, inputs, outputs, noise.values)
        data.manual = True
        return model, data, calls, FlightMetrics(), np.zeros(len(inputs))

    def _bind(self, scenario: Scenario) -> None:
        self.scenario, self.law = scenario, law_of(scenario)
        made = self._make(scenario)
        self.model, self.data, calls, self.metrics, before = made
        self._kept = list(_leaves(made))
        self._first = [np.copy(leaf) for leaf in self._kept]
        self._rules = bind_rules(scenario.rules.system, self.data)
        self._skipped = {id(self.data.noise), id(self.data.calls)}
        episode = Episode(wrench=self._wrench, before=before)
        self._kept += [episode.storage(name) for name in ("approach", "violation")]
        self._first += [np.zeros(()), np.zeros(())]
        arguments = self.model, self.data, calls, self.metrics, episode, *self._seen
        known: Described = {}
        self._start, self.period = BoundCall(begin, arguments, known), BoundCall(advance_period, arguments, known)
        self._bound_law = None

    def _refill(self, scenario: Scenario) -> bool:
        """Give the arrays of the episode before the numbers of the next one; return False if they do not suffice."""
        before = self.scenario
        if (scenario.law, scenario.time, scenario.rules) != (before.law, before.time, before.rules):
            return False
        if scenario is not before:
            made = [*map(np.asarray, _leaves(self._make(scenario))), np.zeros(()), np.zeros(())]
            if [x.shape for x in made] != [np.shape(x) for x in self._kept]:
                return False
            if any(
                not (_is_writable(old) or np.array_equal(old, new)) for old, new in zip(self._kept, made, strict=True)
            ):
                return False
            self.scenario, self._first = scenario, made
        for leaf, first in zip(self._kept, self._first, strict=True):
            if _is_writable(leaf) and id(leaf) not in self._skipped:
                leaf[...] = first
        return True

    def advance_by_law(self) -> None:
        """Advance a control period with the forces of the scenario's law."""
        self._bound_law = self._bound_law or BoundLaw(self.law, self.model, self.data, self._signals)
        self.data.manual = False
        self.period.call()
        self.data.manual = True
        self._bound_law.raise_error()

    def info(self) -> dict[str, Any]:
        """Return facts of the episode so far."""
        least = min(self.metrics.min_clearance, self.metrics.min_angle)
        return {"time": float(self.data.now), "violated": bool(least < 0.0), "reached": self.metrics.first_inside >= 0}


def _leaves(value: Any) -> Iterator[Any]:
    """Yield the arrays and numbers of records of records."""
    if isinstance(value, tuple):
        for item in value:
            yield from _leaves(item)
    else:
        yield value


def _is_writable(leaf: Any) -> bool:
    return isinstance(leaf, np.ndarray) and leaf.flags.writeable


class RegionEnv(gymnasium.Env[Any, Any]):
    """Steer the vehicle of a scenario by wrenches; ``gymnasium.make("subreach/Region-v0", scenario="docking")``.

    An episode is a run of the scenario, a step a control period of it. It ends when the vehicle has been in the goal
    for ten seconds, or the plant fails; it is truncated at the scenario's end.

    Parameters
    ----------
    scenario : Scenario, str or Path
        The scenario, or its name or file.
    overrides : sequence of str
        Changes ``key=value`` of a scenario by name or file.
    vary : mapping of str to (float, float), optional
        Least and greatest value, by key, of numbers that each episode draws anew, as those of a sweep.

    Attributes
    ----------
    action_space : Box
        Wrench X, Y, Z, K, M, N in the body frame, as fractions of what the thrusters give along and about each axis.
    observation_space : Box
        Goal's center from the vehicle [m, body], direction down [body], velocity [m/s, rad/s, body]; of the goal and of
        each region the clearance [m or rad], and the direction [body] in which it grows; the arbiter's weights.
        They are what the scenario's sensing measures; 0 for what is not known.

    Notes
    -----
    The reward is the approach to the goal region [m], plus the time within it [s], less ten times the weighted
    violation [m s] of `cosim.results`.

    Raises
    ------
    ScenarioError, RunError
        If a key is unknown, or the scenario has an engine or an order of exchange that flights without a record lack.

    Examples
    --------
    >>> import gymnasium
    >>> import cosim.learning
    >>> env = gymnasium.make("subreach/Region-v0", scenario="docking")
    >>> observation, info = env.reset(seed=1)
    >>> env.action_space.shape, info["time"]
    ((6,), 0.0)
    >>> env.close()
    """

    metadata = {"render_modes": []}  # noqa: RUF012 -- as Gymnasium annotates it

    def __init__(
        self,
        scenario: Scenario | str | Path = "docking",
        overrides: Sequence[str] = (),
        vary: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self._setup = _Setup(scenario, overrides, vary or {})
        self.observation_space, self.action_space = self._setup.observations, self._setup.actions
        self._seen, self._outcome = np.zeros(self.observation_space.shape or ()), np.zeros(3)
        self._wrench = np.zeros(6)
        self._flight = _Flight(self._setup, self._wrench, self._seen, self._outcome)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begin an episode, drawn by `seed`; return its first observation and info; `options` are passed over."""
        super().reset(seed=seed)
        self._flight.begin(self.np_random)
        return self._observed(), self._flight.info()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold the wrench `action`, in [-1, 1], for a control period; return observation, reward, ends and info."""
        self._wrench[:] = np.clip(action, -1.0, 1.0) * self._setup.scale
        return self._step(self._flight.period.call)

    def step_by_law(self) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Let the scenario's law steer for a control period, as a baseline; return what `step` returns."""
        return self._step(self._flight.advance_by_law)

    def close(self) -> None:
        """Free the plant."""
        self._flight.close()

    def _step(self, advance: Any) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        advance()
        reward, terminated, truncated = self._outcome.tolist()
        return self._observed(), reward, terminated > 0.0, truncated > 0.0, self._flight.info()

    def _observed(self) -> Array:
        return self._seen.astype(np.float32)


class RegionVectorEnv(VectorEnv[Any, Any, Any]):
    """Several `RegionEnv` side by side in one process; ``gymnasium.make_vec("subreach/Region-v0", num_envs=16)``."""

    # parameters are those of `RegionEnv`; an episode that has ended begins anew in the next step, with a reward of 0

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(self, num_envs: int = 1, **parameters: Any) -> None:
        self.num_envs = num_envs
        arguments = {"scenario": "docking", "overrides": (), "vary": {}} | parameters
        self._setup = _Setup(arguments.pop("scenario"), arguments.pop("overrides"), arguments.pop("vary") or {})
        if arguments:
            _refuse(arguments)
        self.single_observation_space, self.single_action_space = self._setup.observations, self._setup.actions
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._seen = np.zeros((num_envs, *(self.single_observation_space.shape or ())))
        self._outcomes, self._ended = np.zeros((num_envs, 3)), np.zeros(num_envs, np.bool_)
        self._wrenches: Array = np.zeros((num_envs, 6))
        arrays = zip(self._wrenches, self._seen, self._outcomes, strict=True)
        self._flights = [_Flight(self._setup, *own) for own in arrays]
        self._calls = np.zeros(2 * num_envs, np.int64)
        self._random: list[Any] = [None] * num_envs
        self._advance = BoundCall(call_each, (self._calls,))

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin all episodes; return their first observations (flights, n)."""
        seeds = seed if isinstance(seed, list) else [None if seed is None else seed + i for i in range(self.num_envs)]
        for i, one in enumerate(seeds):
            if one is not None or self._random[i] is None:
                self._random[i] = np.random.default_rng(one)
            self._begin(i)
        self._ended[:] = False
        return self._seen.astype(np.float32), {}

    def step(self, actions: Array) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Hold wrenches (flights, 6) for a control period; return what `RegionEnv.step` returns, as arrays."""
        np.multiply(np.minimum(np.maximum(actions, -1.0), 1.0), self._setup.scale, out=self._wrenches)
        ended = self._ended.nonzero()[0] if self._ended.any() else ()
        self._advance.call()
        for i in ended:
            self._begin(int(i))
        terminated, truncated = self._outcomes[:, TERMINATED] > 0.0, self._outcomes[:, TRUNCATED] > 0.0
        self._ended = terminated | truncated
        return self._seen.astype(np.float32), self._outcomes[:, REWARD].copy(), terminated, truncated, {}

    def close_extras(self, **_: Any) -> None:
        """Free the plants."""
        for flight in self._flights:
            flight.close()

    def _begin(self, i: int) -> None:
        self._flights[i].begin(self._random[i])
        period = self._flights[i].period
        self._calls[2 * i : 2 * i + 2] = period.address, period.words
        self._outcomes[i, REWARD] = 0.0


def _refuse(arguments: Mapping[str, Any]) -> NoReturn:
    raise TypeError(f"{', '.join(arguments)}: unknown, expected num_envs, scenario, overrides or vary")
