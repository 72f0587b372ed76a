"""One instance of a co-simulation FMU, FMI 2.0 or 3.0, loaded through FMPy: life cycle, messages, variables."""

from __future__ import annotations

import contextlib
import ctypes
import logging
import math
import os
import threading
import weakref
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from plant_fmu.archive import temporary_folder
from plant_fmu.errors import FmuFileError, PlantError
from plant_fmu.model_variables import ModelVariable, model_variables
from plant_fmu.running.messages import Messages, fmi2_callbacks
from plant_fmu.unpacking import library_names, unpack

log = logging.getLogger(__name__)

_ERROR, _FATAL = 3, 4  # status, in FMI 2.0 and 3.0

_LOADING = threading.Lock()  # FMPy changes the working folder of the whole process while it loads a library

# capability: attribute of CoSimulation in FMI 2.0 and in FMI 3.0; FMPy does not read all of them
_CAPABILITIES = {
    "state": ("canGetAndSetFMUstate", "canGetAndSetFMUState"),
    "serialize": ("canSerializeFMUstate", "canSerializeFMUState"),
    "derivatives": ("providesDirectionalDerivative", "providesDirectionalDerivatives"),
    "varying step": ("canHandleVariableCommunicationStepSize",) * 2,
}


class _Life:
    """What has to be ended with an instance. The object has no reference to it, so that it keeps nothing alive."""

    def __init__(self) -> None:
        self.fmu: Any = None  # of FMPy, once its library is loaded
        self.states: dict[int, Any] = {}  # handles to free, by address
        self.running = False  # True from the initialization to the end, or to an error: it can be terminated
        self.fatal = False  # True after a fatal error, which leaves nothing to be called

    def note(self, status: int) -> None:
        """Note the status of a call."""
        self.running = self.running and status < _ERROR
        self.fatal = self.fatal or status == _FATAL


class Instance:
    """An instantiated FMU in a temporary folder, which is removed with it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.messages = Messages()
        self.life = _Life()
        self.no_rollback: Any = None  # argument of `doStep`: True while no state is kept
        self._dropped: deque[int] = deque()  # addresses of states without references
        extracted = contextlib.ExitStack()
        folder = extracted.enter_context(temporary_folder("plant_fmu-"))
        self._end = weakref.finalize(self, _release, self.life, extracted)
        try:
            self._load(path, folder)
        except PlantError:
            self._end()
            raise
        except Exception as error:
            self._end()
            raise PlantError(f"{path}: {self.messages.take_failures() or _message_of(error)}") from error
        except BaseException:
            self._end()
            raise

    def _load(self, path: Path, folder: Path) -> None:
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
        self.no_rollback = (ctypes.c_int if self.fmi == 2 else ctypes.c_bool)(True)
        self.fixed_step = _number(interface.get("fixedInternalStepSize"))  # s

        self.name = root.get("modelName", "")
        self.token = root.get("guid" if self.fmi == 2 else "instantiationToken", "")
        self.variables = model_variables(root)
        identifier = interface.get("modelIdentifier")
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
        self.life.fmu = self.fmu
        # with logging on, without which many FMUs do not say why they fail; some do not either for a list of categories
        if self.fmi == 2:
            self.fmu.instantiate(callbacks=fmi2_callbacks(self.messages), loggingOn=True)
        else:
            receive = self.messages.receive
            log_message = lambda environment, status, category, message: receive(status, message)  # noqa: E731
            self.fmu.instantiate(loggingOn=True, logMessage=log_message)

    # ---- calls ----

    def do(self, call: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        """Call one of FMPy's methods; raise its error as a PlantError with the FMU's own message."""
        try:
            return call(*arguments, **named)
        except Exception as error:
            self.life.note(getattr(error, "status", 0))
            raise PlantError(self.messages.take_failures() or _message_of(error)) from error

    def get(self, variable: ModelVariable) -> Any:
        """Return the value of a variable, as a float, int, bool or str; an array as a NumPy array."""
        get, shape = getattr(self.fmu, f"get{self._type(variable)}"), variable.shape
        if shape:
            return np.array(self.do(get, [variable.reference], math.prod(shape))).reshape(shape)
        value = self.do(get, [variable.reference])[0]
        if isinstance(value, bytes):  # FMPy decodes strings of FMI 3.0 alone
            return value.decode("utf-8", "replace")
        return bool(value) if variable.type == "Boolean" else value

    def set(self, variables: list[ModelVariable], values: list[Any]) -> None:
        """Set variables that are all of one type, in one call; values are those of all, side by side."""
        references = [v.reference for v in variables]
        self.do(getattr(self.fmu, f"set{self._type(variables[0])}"), references, values)

    def _type(self, variable: ModelVariable) -> str:
        return ("Integer" if self.fmi == 2 else "Int64") if variable.type == "Enumeration" else variable.type

    # ---- FMU states ----

    def keep(self, handle: Any) -> Any:
        """Store a state's handle, so that `close` frees it at the latest, and return it."""
        self.life.states[handle.value] = handle
        self.no_rollback.value = False
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
        if address in self.life.states:
            self.do(self.fmu.freeFMUState, self.life.states.pop(address))
            self.no_rollback.value = not self.life.states

    # ---- the end ----

    @property
    def closed(self) -> bool:
        """True after `close`."""
        return not self._end.alive

    def close(self) -> None:
        """Terminate, free states and instance, unload the library, remove the folder. May be called twice."""
        self._end()


def _number(text: str | None) -> float:
    """Return an optional attribute as a number above 0, else NaN."""
    try:
        number = float(text or "nan")
    except ValueError:
        return math.nan
    return number if number > 0.0 else math.nan


def _release(life: _Life, extracted: contextlib.ExitStack) -> None:
    fmu = life.fmu
    try:
        if fmu is None or life.fatal:
            return
        if not fmu.component:
            fmu.freeLibrary()
            return
        if life.running:
            with contextlib.suppress(FMICallException):
                fmu.terminate()
        for handle in life.states.values():
            fmu.freeFMUState(handle)
        fmu.freeInstance()
    except Exception as error:  # noqa: BLE001 -- an FMU that cannot end well must not keep the folder
        log.warning("FMU not freed: %s", _message_of(error))
    finally:
        life.states.clear()
        extracted.close()


def _message_of(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
