"""An FMU driven through FMPy's own calls, so that the tests share no code with the master."""

from __future__ import annotations

import atexit
import ctypes
import functools
import shutil
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi2 import defaultCallbacks as defaults
from fmpy.fmi3 import FMU3Model, FMU3Slave

from plant_fmu import Plant, build_fmu, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.vehicle import shipped_vehicles
from plant_fmu.vehicle_component import make_vehicle_component

STATES = [
    *(f"position.{a}" for a in "xyz"),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{a}" for a in "uvwpqr"),
]
WRENCH = [f"wrench.{a}" for a in "XYZKMN"]
EACH_VEHICLE = [pytest.param(v, marks=() if v == "odin" else pytest.mark.slow) for v in shipped_vehicles()]
EACH_FMI = pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3], ids=["fmi2", "fmi3"])
UNDAMPED = {f"{kind}_damping[{i}]": 0.0 for kind in ("linear", "quadratic") for i in range(1, 7)}


@functools.cache
def extracted(path, modified):
    """Return the folder of an FMU and its description, made once for all the tests of a process."""
    folder = extract(str(path))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder, read_model_description(folder)


@functools.cache
def coupled_odin():
    return make_vehicle_component(load_vehicle("odin"), coupled=True)


KINDS = {(2, "cs"): FMU2Slave, (3, "cs"): FMU3Slave, (2, "me"): FMU2Model, (3, "me"): FMU3Model}


class CoSimulationInstance:
    """An instance with variables by name; `said` collects what the FMU logs."""

    def __init__(self, path, interface="cs", logging_on=False, **events):
        self.folder, self.description = extracted(Path(path), Path(path).stat().st_mtime_ns)
        self.by_name = {v.name: v for v in self.description.modelVariables}
        self.fmi = int(self.description.fmiVersion[0])
        self.said = []
        self.fmu = KINDS[self.fmi, interface](
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="test",
        )
        if self.fmi == 2:
            callbacks = fmi2CallbackFunctions()
            callbacks.logger = fmi2CallbackLoggerTYPE(
                lambda env, name, status, category, text: self.said.append((status, text.decode()))
            )
            callbacks.allocateMemory, callbacks.freeMemory = defaults.allocateMemory, defaults.freeMemory
            self.fmu.instantiate(callbacks=callbacks, loggingOn=logging_on)
        else:
            self.fmu.instantiate(
                logMessage=lambda env, status, category, text: self.said.append((status, text.decode())),
                loggingOn=logging_on,
                **events,
            )
        self.time = 0.0
        # FMPy has FMI 3.0's names for those of FMI 2.0 too
        self.save, self.restore, self.free = self.fmu.getFMUState, self.fmu.setFMUState, self.fmu.freeFMUState
        self.deserialize = self.fmu.deserializeFMUState

    def set(self, **values):
        self.set_values(values)

    def set_values(self, values):
        by_type = {}
        for name, value in values.items():
            by_type.setdefault(self.by_name[name].type, {})[self.by_name[name].valueReference] = np.ravel(
                value
            ).tolist()
        for kind, numbers in by_type.items():
            getattr(self.fmu, f"set{kind}")(list(numbers), [x for items in numbers.values() for x in items])

    def get(self, *names):
        variables = [self.by_name[name] for name in names]
        types = {v.type for v in variables}
        if len(types) == 1:
            counts = [int(np.prod(v.shape)) for v in variables if v.shape]
            n = (sum(counts) + len(variables) - len(counts),) if counts else ()
            return getattr(self.fmu, f"get{types.pop()}")([v.valueReference for v in variables], *n)
        return [x for name in names for x in self.get(name)]

    def flag(self, name):
        return bool(self.get(name)[0])

    def jacobian(self, unknowns, knowns):
        """Column by column, from directional derivatives."""
        u, k = ([self.by_name[name].valueReference for name in names] for names in (unknowns, knowns))
        get = self.fmu.getDirectionalDerivative
        if self.fmi == 2:
            columns = [get(vUnknown_ref=u, vKnown_ref=[ref], dvKnown=[1.0]) for ref in k]
        else:
            columns = [get(unknowns=u, knowns=[ref], seed=[1.0], nSensitivity=len(u)) for ref in k]
        return np.array(columns).T

    def start(self, **values):
        self.set_values(values)
        return self.begin()

    def enter(self, time=0.0, stop=None):
        """Enter initialization at a time."""
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=time, stopTime=stop)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=time, stopTime=stop)

    def begin(self, time=0.0, stop=None):
        """Initialize at a time."""
        self.enter(time, stop)
        self.fmu.exitInitializationMode()
        self.time = time
        return self

    def step(self, h):
        results = self.fmu.doStep(self.time, h)
        self.time += h
        return results

    def serialize(self, state):
        return bytes(self.fmu.serializeFMUState(state))

    # ---- model exchange ----

    def update_discrete(self):
        """Return whether states changed, and the time of the next event or None."""
        if self.fmi == 2:
            _, _, _, changed, defined, time = self.fmu.newDiscreteStates()
        else:
            _, _, _, changed, defined, time = self.fmu.updateDiscreteStates()
        return bool(changed), time if defined else None

    def states(self):
        x = np.zeros(len(self.description.derivatives))
        pointer = x.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        self.fmu.getContinuousStates(pointer, x.size)
        return x

    def put_states(self, x):
        x = np.ascontiguousarray(x, dtype=float)
        self.fmu.setContinuousStates(x.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), x.size)

    def rates(self, n=None):
        x = np.zeros(n or len(self.description.derivatives))
        pointer = x.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        get = self.fmu.getDerivatives if self.fmi == 2 else self.fmu.getContinuousStateDerivatives
        get(pointer, x.size)
        return x

    def close(self):
        self.fmu.freeInstance()


def members(fmu):
    """Return the files in an FMU by name."""
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(path, files):
    """Write files by name as an FMU, and return its path."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def refused(slave, call, *words, status=3):
    """Require that an FMU refuses a call with this status or a worse one, and logs the words with it."""
    slave.said.clear()
    with pytest.raises(FMICallException) as caught:
        call()
    text = " ".join(message for _, message in slave.said)
    assert caught.value.status >= status and all(logged >= status for logged, _ in slave.said)
    assert slave.said and all(word in text for word in words), text


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request):
    return request.param


@pytest.fixture(scope="session")
def all_platforms(once):
    """Return a function that builds ODIN's FMU for all platforms, once a session."""
    pytest.importorskip("ziglang", reason="the build extra is not installed: no binaries for other platforms")

    def built(fmi):
        def make(folder):
            build_fmu(load_vehicle("odin"), fmi, folder / "odin.fmu", "all")

        return once(f"all-platforms-{fmi}", make) / "odin.fmu"

    return built


@pytest.fixture
def make_slave():
    """Return a function that makes slaves, closed when the test ends."""
    slaves = []

    def make(vehicle="odin", fmi=3, coupled=False, **more):
        what = coupled_odin() if coupled else load_vehicle(vehicle)
        slaves.append(CoSimulationInstance(cached_fmu(what, fmi), **more))
        return slaves[-1]

    yield make
    for slave in slaves:
        slave.close()


@pytest.fixture
def make_model(make_slave, fmi):
    """Return a function that makes a model for model exchange in continuous-time mode."""

    def make(**values):
        model = make_slave(fmi=fmi, interface="me", logging_on=True).start(**values)
        model.update_discrete()
        model.fmu.enterContinuousTimeMode()
        return model

    return make


@pytest.fixture
def make_plant():
    """Return a function that makes plants, closed when the test ends."""
    plants = []

    def make(source="odin", fmi=3, *, start=True, **values):
        plants.append(Plant(source, fmi))
        plants[-1].set(values)
        if start:
            plants[-1].initialize()
        return plants[-1]

    yield make
    for plant in plants:
        plant.close()


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """Return a folder in which all temporary folders of the test are made."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def drive(plant, steps=50, step=0.01):
    """Step under inputs that follow from the time; return all outputs of all steps."""
    rows = []
    for _ in range(steps):
        plant.inputs.values[:] = 10.0 * np.sin(plant.time + np.arange(len(plant.inputs)))
        plant.step(step)
        rows.append([*plant.outputs.values, *plant.read_flags()])
    return np.array(rows)
