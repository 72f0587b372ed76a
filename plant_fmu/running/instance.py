"""One instance of a co-simulation FMU, FMI 2.0 or 3.0, loaded through FMPy: life cycle, messages, variables."""

from __future__ import annotations

import contextlib
import functools
import io
import logging
import os
import threading
import weakref
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi2 import defaultCallbacks as default_callbacks
from fmpy.fmi3 import FMU3Slave

from plant_fmu.archive import make_archive, temporary_folder
from plant_fmu.errors import FmuFileError, PlantError
from plant_fmu.unpacking import DESCRIPTION, library_names, unpack

log = logging.getLogger(__name__)

WARNING = 1  # the highest status that is no failure, in FMI 2.0 and 3.0

_LOADING = threading.Lock()  # FMPy changes the working folder of the whole process while it loads a library

# capability: attribute of CoSimulation in FMI 2.0 and in FMI 3.0; FMPy does not read all of them
_CAPABILITIES = {
    "state": ("canGetAndSetFMUstate", "canGetAndSetFMUState"),
    "serialize": ("canSerializeFMUstate", "canSerializeFMUState"),
    "derivatives": ("providesDirectionalDerivative", "providesDirectionalDerivatives"),
}


class Messages:
    """Messages of an FMU. The object has no reference to the instance, so that callbacks keep nothing alive."""

    def __init__(self) -> None:
        self._failures: deque[str] = deque(maxlen=4)

    def receive(self, status: int, message: bytes) -> None:
        """Log a message, and keep it if its status is a failure."""
        text = message.decode("utf-8", "replace")
        log.debug("FMU: %s", text)
        if status > WARNING:
            self._failures.append(" ".join(text.split()))

    def take_failures(self) -> str:
        """Return the failures since the last call, joined by semicolons, and clear them; "" for none."""
        text = "; ".join(self._failures)
        self._failures.clear()
        return text


class Instance:
    """An instantiated FMU in a temporary folder, which is removed with it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.messages = Messages()
        self._states: dict[int, Any] = {}  # handles to free, by address
        self._dropped: deque[int] = deque()  # addresses of states without references
        extracted = contextlib.ExitStack()
        folder = extracted.enter_context(temporary_folder("plant_fmu-"))
        loaded: list[Any] = []
        self._end = weakref.finalize(self, _release, loaded, self._states, extracted)
        try:
            self._load(path, folder, loaded)
        except PlantError:
            self._end()
            raise
        except Exception as error:
            self._end()
            raise PlantError(f"{path}: {self.messages.take_failures() or _message_of(error)}") from error
        except BaseException:
            self._end()
            raise

    def _load(self, path: Path, folder: Path, loaded: list[Any]) -> None:
        platforms = (fmpy.platform, fmpy.platform_tuple)
        try:
            root = unpack(path, folder, platforms)
        except FmuFileError as error:
            raise PlantError(str(error)) from error
        self.fmi = int(root.get("fmiVersion", "")[0])
        interface = root.find("CoSimulation")
        if interface is None:
            raise PlantError(f"{path}: offers no co-simulation, expected the element CoSimulation")
        self.capabilities = {
            name for name, keys in _CAPABILITIES.items() if interface.get(keys[self.fmi - 2]) in ("true", "1")
        }

        description = _parse_description(Path(folder, DESCRIPTION).read_bytes())
        self.name, self.token = description.modelName, description.guid
        self.variables = {v.name: v for v in description.modelVariables}
        identifier = description.coSimulation.modelIdentifier
        library = library_names(root, platforms)["CoSimulation"]
        if not Path(folder, library).is_file():
            raise PlantError(f"{path}: has no binary for this machine, expected {library}")
        with _LOADING:
            working_folder = os.getcwd()
            try:
                kind = FMU2Slave if self.fmi == 2 else FMU3Slave
                self.fmu = kind(
                    guid=self.token, unzipDirectory=folder, modelIdentifier=identifier, instanceName=self.name
                )
            finally:
                os.chdir(working_folder)
        loaded.append(self.fmu)
        if self.fmi == 2:
            self.fmu.instantiate(callbacks=_callbacks_fmi2(self.messages))
        else:
            receive = self.messages.receive
            self.fmu.instantiate(logMessage=lambda environment, status, category, message: receive(status, message))

    # ---- calls ----

    def do(self, call: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        """Call one of FMPy's methods; raise its error as a PlantError with the FMU's own message."""
        try:
            return call(*arguments, **named)
        except Exception as error:
            raise PlantError(self.messages.take_failures() or _message_of(error)) from error

    def get(self, variable: Any) -> Any:
        """Return the value of a scalar variable, as a float, int, bool or str."""
        value = self.do(getattr(self.fmu, f"get{self._type(variable)}"), [variable.valueReference])[0]
        if isinstance(value, bytes):  # FMPy decodes strings of FMI 3.0 alone
            return value.decode("utf-8", "replace")
        return bool(value) if variable.type == "Boolean" else value

    def set(self, variables: list[Any], values: list[Any]) -> None:
        """Set scalar variables that are all of one type, in one call."""
        references = [v.valueReference for v in variables]
        self.do(getattr(self.fmu, f"set{self._type(variables[0])}"), references, values)

    def _type(self, variable: Any) -> str:
        return ("Integer" if self.fmi == 2 else "Int64") if variable.type == "Enumeration" else str(variable.type)

    # ---- FMU states ----

    def keep(self, handle: Any) -> Any:
        """Store a state's handle, so that `close` frees it at the latest, and return it."""
        self._states[handle.value] = handle
        return handle

    def drop(self, address: int) -> None:
        """Mark a state for `sweep`. Any thread may call this; the state is freed in the instance's own thread."""
        self._dropped.append(address)

    def sweep(self) -> None:
        """Free the marked states."""
        while self._dropped:
            self.free(self._dropped.popleft())

    def free(self, address: int) -> None:
        """Free a state, once."""
        if address in self._states:
            self.do(self.fmu.freeFMUState, self._states.pop(address))

    # ---- the end ----

    @property
    def closed(self) -> bool:
        """True after `close`."""
        return not self._end.alive

    def close(self) -> None:
        """Free states and instance, unload the library, remove the folder. May be called twice."""
        self._end()


@functools.lru_cache(maxsize=16)
def _parse_description(xml: bytes) -> Any:
    """Return FMPy's parsed model description, which is not to be changed; parsing is half of an instance's start."""
    # FMPy reads FMUs only, so the text is packed into one without other files.
    return fmpy.read_model_description(io.BytesIO(make_archive({DESCRIPTION: xml})))


def _release(loaded: list[Any], states: dict[int, Any], extracted: contextlib.ExitStack) -> None:
    try:
        for fmu in loaded:
            if fmu.component:
                for handle in states.values():
                    fmu.freeFMUState(handle)
                fmu.freeInstance()
            else:
                fmu.freeLibrary()
    except Exception as error:  # noqa: BLE001 -- an FMU that cannot end well must not keep the folder
        log.warning("FMU not freed: %s", _message_of(error))
    finally:
        states.clear()
        extracted.close()


def _message_of(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _callbacks_fmi2(messages: Messages) -> fmi2CallbackFunctions:
    # not through FMPy's logger proxy, which formats variadic messages but serves one instance in the whole process
    def receive(environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
        messages.receive(status, message)

    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(receive)
    callbacks.allocateMemory = default_callbacks.allocateMemory
    callbacks.freeMemory = default_callbacks.freeMemory
    return callbacks
