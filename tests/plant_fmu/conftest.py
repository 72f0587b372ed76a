"""An FMU driven through FMPy's own calls, so that the tests share no code with the master."""

from __future__ import annotations

import shutil

import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi2 import defaultCallbacks as defaults
from fmpy.fmi3 import FMU3Slave

from plant_fmu import cached_fmu, load_vehicle

STATES = [
    *(f"position.{a}" for a in "xyz"),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{a}" for a in "uvwpqr"),
]
WRENCH = [f"wrench.{a}" for a in "XYZKMN"]


class Slave:
    """A co-simulation instance with variables by name; `said` collects what the FMU logs."""

    def __init__(self, path, instance_name="test"):
        self.folder = extract(str(path))
        self.description = read_model_description(self.folder)
        self.by_name = {v.name: v for v in self.description.modelVariables}
        self.fmi = int(self.description.fmiVersion[0])
        self.said = []
        kind = FMU2Slave if self.fmi == 2 else FMU3Slave
        self.fmu = kind(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=instance_name,
        )
        if self.fmi == 2:
            callbacks = fmi2CallbackFunctions()
            callbacks.logger = fmi2CallbackLoggerTYPE(
                lambda env, name, status, category, text: self.said.append((status, text.decode()))
            )
            callbacks.allocateMemory, callbacks.freeMemory = defaults.allocateMemory, defaults.freeMemory
            self.fmu.instantiate(callbacks=callbacks)
        else:
            self.fmu.instantiate(logMessage=lambda env, status, cat, text: self.said.append((status, text.decode())))
        self.time = 0.0

    def set(self, **values):
        self.set_values(values)

    def set_values(self, values):
        references = [self.by_name[name].valueReference for name in values]
        setter = self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64
        setter(references, list(values.values()))

    def get(self, *names):
        references = [self.by_name[name].valueReference for name in names]
        return (self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64)(references)

    def flag(self, name):
        return bool(self.fmu.getBoolean([self.by_name[name].valueReference])[0])

    def start(self, **values):
        self.set_values(values)
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        return self

    def step(self, h):
        self.fmu.doStep(self.time, h)
        self.time += h

    def close(self):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder)


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request):
    return request.param


@pytest.fixture
def make_slave():
    """Return a function that makes slaves, closed when the test ends."""
    slaves = []

    def make(vehicle="odin", fmi=3):
        slaves.append(Slave(cached_fmu(load_vehicle(vehicle), fmi)))
        return slaves[-1]

    yield make
    for slave in slaves:
        slave.close()
