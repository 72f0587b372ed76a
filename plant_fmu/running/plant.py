"""A vehicle that is stepped from Python: its FMU, built where it is missing, with its state and its derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from plant_fmu.build import FMI_VERSIONS, cached_fmu
from plant_fmu.errors import PlantError
from plant_fmu.running.channels import DOUBLES
from plant_fmu.running.co_simulation_instance import CoSimulationInstance
from plant_fmu.running.native import Native, native_calls
from plant_fmu.running.state import Clock, State, from_bytes, to_bytes
from plant_fmu.vehicle import Vehicle, load_vehicle


class Plant(CoSimulationInstance):
    """A vehicle, or any co-simulation FMU, that is stepped from Python.

    Parameters
    ----------
    source : str, Path or Vehicle
        A shipped vehicle's name, a vehicle's TOML file, a vehicle, or a file that ends in .fmu.
    fmi : int
        FMI version of a vehicle's FMU, 2 or 3. An FMU file has its own version.

    Attributes
    ----------
    inputs : Channels
        Real scalar inputs. Write into ``inputs.values``; each step sends them.
    outputs : Channels
        Real scalar outputs after the last step; ``outputs.values`` cannot be written.
    flags : Channels
        Boolean outputs; `read_flags` updates ``flags.values``.
    time : float
        Present time [s].
    initialized : bool
        True if the plant can step.

    Raises
    ------
    PlantError
        If the FMU cannot be loaded, or there is no such FMI version.
    VehicleError, BuildError
        If there is no such vehicle, or no FMU of it can be made.

    Notes
    -----
    ``plant[name]`` reads any scalar variable; ``plant[name] = value`` sets an input for the next step, or another
    variable that `set` accepts. A plant belongs to one thread at a time; different plants are independent.

    Examples
    --------
    >>> from plant_fmu import Plant
    >>> plant = Plant("odin")
    >>> plant.set({"position.z": 2.0})
    >>> plant.initialize()
    >>> plant.step(0.1)
    >>> 0.0 < plant["position.z"] < 4.0
    True
    >>> plant.close()
    """

    def __init__(self, source: str | Path | Vehicle, fmi: int = 3) -> None:
        path = _locate_fmu(source, fmi)
        super().__init__(path, brief=str(path) != str(source))  # a vehicle's FMU is this package's own, and fast

    def save(self) -> State:
        """Save the present state: that of the FMU, the time and the inputs.

        Returns
        -------
        State
            State for `restore`, which can be used many times.

        Raises
        ------
        PlantError
            If the FMU does not support it.
        """
        self._require("state", "cannot save its state")
        self._instance.sweep()
        handle = self._instance.do(self._instance.fmu.getFMUState)
        clock = Clock(self._start, self._count, self._last_step)
        return State(self._instance, handle, clock, self.initialized, self.inputs.values.copy())

    def restore(self, state: State) -> None:
        """Restore a saved state of this plant, from which the simulation is the same to the last bit.

        Parameters
        ----------
        state : State
            State from `save` or `deserialize`.

        Raises
        ------
        PlantError
            If the state was freed, or is of another plant.
        """
        self._require_open()
        self._instance.sweep()
        self._instance.do(self._instance.fmu.setFMUState, state.handle(self._instance))
        self.inputs.values[:] = state.inputs
        self._given.clear()
        self._set_clock(state.clock, initialized=state.initialized)
        if self.initialized:
            self._read()

    def free(self, state: State) -> None:
        """Free a saved state now, rather than with its last reference. May be called twice."""
        if not self._instance.closed:
            state.free(self._instance)

    def serialize(self, state: State) -> bytes:
        """Return a saved state as bytes, for another plant of the same FMU, another process or a file.

        Raises
        ------
        PlantError
            If the FMU does not support it, or the state is of another plant.
        """
        self._require("serialize", "cannot serialize its state")
        return to_bytes(state, self._instance)

    def deserialize(self, data: bytes) -> State:
        """Return the state that `serialize` converted to the bytes `data`.

        Raises
        ------
        PlantError
            If the bytes are no state, of another FMU, or damaged.
        """
        self._require("serialize", "cannot serialize its state")
        return from_bytes(data, self._instance)

    def jacobian(self, unknowns: Sequence[str], knowns: Sequence[str]) -> NDArray[np.float64]:
        """Return the partial derivatives of some variables by others at the present state.

        Parameters
        ----------
        unknowns : sequence of str
            Names of `m` outputs or derivatives.
        knowns : sequence of str
            Names of `n` inputs or states; an FMU may accept further variables.

        Returns
        -------
        ndarray, shape (m, n)
            Derivatives, in row i and column j of unknown i by known j, in their units.

        Raises
        ------
        PlantError
            If a name is unknown, or the FMU has no such derivative.
        """
        self._require("derivatives", "provides no directional derivatives")
        self._require_initialized("has no derivatives")
        rows, columns = ([self._real(name) for name in names] for names in (unknowns, knowns))
        self._send()
        jacobian = np.zeros((len(rows), len(columns)))
        for j, column in enumerate(columns if rows else ()):
            try:
                jacobian[:, j] = self._instance.do(self._instance.fmu.getDirectionalDerivative, rows, [column], [1.0])
            except PlantError as error:
                raise PlantError(f"derivatives of {', '.join(unknowns)} by {knowns[j]}: {error}") from error
        return jacobian

    def native(self, inputs: Sequence[str], outputs: Sequence[str]) -> Native:
        """Return the C functions of an initialized plant for a compiled loop.

        Such a loop steps the FMU without this object: `time` and the channels do not change. Tell it by `count_steps`
        and `raise_failure`, or `reset` the plant, or close it, afterwards.

        Parameters
        ----------
        inputs, outputs : sequence of str
            Real scalar variables to be sent and read, in the order of the buffers.

        Returns
        -------
        Native
            Addresses and buffers.

        Raises
        ------
        PlantError
            If the plant is not initialized, or a variable is no real scalar.
        """
        self._require_initialized("cannot be stepped")
        return native_calls(self._instance, tuple(inputs), tuple(outputs))

    def native_channels(self) -> Native:
        """Return the C functions of `native` for all channels, with the plant's own buffers.

        Report the steps that were made with them by `count_steps`, or their failure by `raise_failure`.

        Raises
        ------
        PlantError
            As for `native`.
        """
        self._require_initialized("cannot be stepped")
        channels = self.inputs, self.outputs, self.flags
        native = native_calls(self._instance, *(channel.names for channel in channels))
        inputs, outputs, flags = (channel.values for channel in channels)
        return native._replace(inputs=inputs, outputs=outputs, flags=flags)

    def _real(self, name: str) -> int:
        """Return the value reference of a variable that has derivatives."""
        variable = self._variable(name)
        if variable.type not in DOUBLES or variable.shape:
            kind = "an array" if variable.shape else f"of type {variable.type}"
            raise PlantError(f"{name} is {kind}, expected a real scalar variable")
        return variable.reference

    def _require(self, capability: str, action: str) -> None:
        self._require_open()
        if capability not in self._instance.capabilities:
            raise PlantError(f"{self._instance.path}: this FMU {action}")


def _locate_fmu(source: str | Path | Vehicle, fmi: int) -> Path:
    if fmi not in FMI_VERSIONS:
        raise PlantError(f"FMI version is {fmi!r}, expected 2 or 3")
    if isinstance(source, Vehicle):
        return cached_fmu(source, fmi)
    if not isinstance(source, (str, Path)):
        raise PlantError(f"plant is {source!r}, expected a vehicle, its name, its TOML file or an FMU file")
    if Path(source).suffix == ".fmu":
        return Path(source)
    return cached_fmu(load_vehicle(source), fmi)
