"""A plant's saved state: the FMU's own, with clock and inputs; as bytes too."""

from __future__ import annotations

import hashlib
import struct
import weakref
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_fmu.errors import PlantError
from plant_fmu.running.instance import Instance

_HEADER = struct.Struct("<8s8sI")  # magic, FMU, checksum of the body
_BODY_HEADER = struct.Struct("<?dqdI")  # initialized, clock, number of inputs; inputs and the FMU's own bytes follow
_MAGIC = b"PLANTST1"


@dataclass(frozen=True)
class Clock:
    """The time of a plant: `count` steps of `step` after `start`, so that no rounding adds up."""

    start: float  # s
    count: int  # number of steps
    step: float  # s, NaN before the first step

    @property
    def time(self) -> float:
        """Time [s]."""
        return self.start + self.count * self.step if self.count else self.start


class State:
    """A state from `Plant.save`. `Plant.free` frees it, else its last reference does."""

    def __init__(
        self, instance: Instance, handle: Any, clock: Clock, initialized: bool, inputs: NDArray[np.float64]
    ) -> None:
        self._instance, self._handle = instance, instance.keep(handle)
        self.clock, self.initialized, self.inputs = clock, initialized, inputs
        self._finalizer = weakref.finalize(self, instance.drop, handle.value)
        self._finalizer.atexit = False

    @property
    def time(self) -> float:
        """Time at which it was saved [s]."""
        return self.clock.time

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise PlantError("a state cannot be copied or pickled, expected plant.serialize(state)")

    def handle(self, instance: Instance) -> Any:
        """Return the FMU's handle, for its own `instance`."""
        if self._instance is not instance:
            raise PlantError("the state is of another plant; serialize it there, and deserialize it here")
        if not self._finalizer.alive:
            raise PlantError("the state was freed")
        return self._handle

    def free(self, instance: Instance) -> None:
        """Free the state now, in its own `instance`; a second call does nothing."""
        if self._finalizer.alive:
            self.handle(instance)
            self._finalizer.detach()
            instance.free(self._handle.value)


def to_bytes(state: State, instance: Instance) -> bytes:
    """Serialize a state to bytes that any plant with the same FMU can read, on the same kind of machine."""
    fmu_state: bytes = instance.do(instance.fmu.serializeFMUState, state.handle(instance))
    clock, inputs = state.clock, state.inputs.astype("<f8")
    header = _BODY_HEADER.pack(state.initialized, clock.start, clock.count, clock.step, len(inputs))
    body = header + inputs.tobytes() + fmu_state
    return _HEADER.pack(_MAGIC, _fmu_digest(instance), zlib.crc32(body)) + body


def from_bytes(data: bytes, instance: Instance) -> State:
    """Return the state that `to_bytes` wrote."""
    if len(data) < _HEADER.size + _BODY_HEADER.size or not data.startswith(_MAGIC):
        raise PlantError(f"got {len(data)} bytes, expected a serialized state of a plant")
    _, fmu_digest, checksum = _HEADER.unpack_from(data)
    if fmu_digest != _fmu_digest(instance):
        raise PlantError(f"the serialized state is of another FMU than {instance.path}")
    body = data[_HEADER.size :]
    if zlib.crc32(body) != checksum:
        raise PlantError("the serialized state is damaged: its checksum is wrong")
    initialized, start, count, step, n = _BODY_HEADER.unpack_from(body)
    inputs = np.frombuffer(body, "<f8", n, _BODY_HEADER.size).astype(np.float64)
    handle = instance.do(instance.fmu.deserializeFMUState, body[_BODY_HEADER.size + 8 * n :])
    return State(instance, handle, Clock(start, count, step), initialized, inputs)


def _fmu_digest(instance: Instance) -> bytes:
    """Return an 8-byte digest that identifies the FMU: its FMI version and token."""
    return hashlib.sha256(f"{instance.fmi} {instance.token}".encode()).digest()[:8]
