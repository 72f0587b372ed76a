"""The plant's FMU in FMPy alone: a dive in a current, by nothing but the FMI standard.

What one learns: the names of the FMU's variables, that parameters, start values and inputs are set as in
any FMU, and that FMPy's own solver can integrate it as well (model exchange). subreach is needed once, to make the
file, by a command of its own; where the file is used it need not be installed, nor any Python.
"""

import subprocess
import sys

import numpy as np
from fmpy import read_model_description, simulate_fmu

FMU = "bluerov2.fmu"
MAKE = [sys.executable, "-m", "plant_fmu", "build", "--vehicle", "bluerov2_heavy", "--fmi", "3", "--out", FMU]
if __name__ == "__main__":
    subprocess.run(MAKE, check=True, stdout=subprocess.DEVNULL)

    described = read_model_description(FMU)
    inputs, outputs = ([v.name for v in described.modelVariables if v.causality == c] for c in ("input", "output"))
    print(f"{described.modelName}, FMI {described.fmiVersion}: {len(inputs)} inputs, {len(outputs)} outputs")

    dive = np.zeros(4, dtype=[("time", float), *((name, float) for name in inputs)])
    dive["time"] = [0.0, 2.0, 2.0, 10.0]  # s
    dive["wrench.Z"] = [20.0, 20.0, 0.0, 0.0]  # N, downwards for two seconds
    start = {"position.z": 1.0, "current.x": 0.2}  # m of depth; m/s of the water, to the north

    end = {}
    for kind in ("CoSimulation", "ModelExchange"):
        result = simulate_fmu(FMU, fmi_type=kind, stop_time=10.0, start_values=start, input=dive, output=outputs)
        end[kind] = np.array([result[f"position.{axis}"][-1] for axis in "xyz"])
        north, _, depth = end[kind]
        print(f"{kind}: after 10 s {north:.3f} m north of the start, {depth:.3f} m deep")
    print(f"the two integrators end {1000.0 * np.linalg.norm(end['CoSimulation'] - end['ModelExchange']):.3f} mm apart")
