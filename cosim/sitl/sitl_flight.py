"""One run that an autopilot flies: plant, record and folder, stepped by a server."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

from cosim.results.recorder import Recorder
from cosim.results.run_result import Run
from cosim.run.run_folder import claim, conclude
from cosim.scenario.scenario import Scenario
from cosim.simulation.master import Master
from cosim.sitl.law import AutopilotLaw
from cosim.sitl.motion import Lowering, Motion, MotionReader, with_vertical_motion
from cosim.sitl.rangefinder import Rangefinder


class Flight:
    """A run from its first frame to its summary; record_rate [Hz]."""

    def __init__(self, scenario: Scenario, law: AutopilotLaw, out: Path | None, record_rate: float) -> None:
        self.scenario = scenario
        with contextlib.ExitStack() as undo:
            self._master = undo.enter_context(Master(scenario, law))
            self._claimed = claim(out, scenario)
            undo.callback(self._claimed.discard)
            self.folder = self._claimed.path
            self._recorder = Recorder(self.folder, self._master.signals.columns)
            self._reader = MotionReader(self._master.plant, Rangefinder(scenario))
            undo.pop_all()
        self._every = max(1, round(1.0 / (record_rate * scenario.time.step)))
        self._started = time.perf_counter()
        self._wall_time: float | None = None
        self.steps = self.waited = 0
        self._lowering = Lowering(scenario.initial.position[2])

    @property
    def done(self) -> bool:
        """True if the scenario's time is over."""
        return self.steps >= self.scenario.steps

    def step(self) -> Motion:
        """Make the next step with the present outputs of the law, and record it if a row is due."""
        self._master.step(self.steps)
        self._record()
        self.steps += 1
        return self.motion()

    @property
    def can_start(self) -> bool:
        """True if the vehicle is at the start of the scenario: lowering is over, or has not begun."""
        return self.waited == 0 or self._lowering.is_over(self.waited * self.scenario.time.step)

    def wait(self) -> Motion:
        """Return the motion in the next frame of lowering the vehicle to its start and holding it there."""
        self.waited += 1
        return with_vertical_motion(self.motion(), *self._lowering.at(self.waited * self.scenario.time.step))

    def motion(self) -> Motion:
        """Return the present motion of the vehicle, at the autopilot's time."""
        return self._reader.read((self.waited + self.steps) * self.scenario.time.step)

    def _record(self) -> None:
        """Record the row of the last step, if one is due."""
        if self.steps % self._every == 0:
            with self._claimed.writing():
                try:
                    self._recorder.observe(self.steps, self._master.row)
                except OSError:
                    self.end()  # so that the error says what is kept
                    raise

    def end(self) -> None:
        """Close plant and record; raise RunError if it cannot be written. May be called twice."""
        if self._wall_time is not None:
            return
        self._wall_time = time.perf_counter() - self._started
        try:
            if self.done:  # the last row, at the end time
                self._master.step(self.steps)
                self._record()
        finally:
            self._master.close()
            with self._claimed.writing():
                self._claimed.keep(self._recorder)

    def conclude(self, status: str, report: bool) -> Run:
        """Write the summary of a flight that has ended after at least one step."""
        with self._claimed.writing():
            return conclude(self.folder, self.scenario, status, self._wall_time, report)
