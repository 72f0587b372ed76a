"""Run an FMU through the manoeuvre in it, compare with the reference results in it, and draw both.

    python examples/fmu_reference.py        writes fmu-reference.png here

Only the FMU and FMPy are used after the first line of main: what is done here, any FMI tool can do.
"""

import shutil
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from fmpy import extract, simulate_fmu
from fmpy.ssp.ssd import read_ssv
from fmpy.util import read_csv

from plant_fmu import build_fmu, load_vehicle

NAME = "bluerov2_heavy"
PANELS = {
    "position, m": ["position.x", "position.y", "position.z"],
    "quaternion": [f"quaternion.e{i}" for i in range(4)],
    "velocity, m/s": ["velocity.u", "velocity.v", "velocity.w"],
    "angular velocity, rad/s": ["velocity.p", "velocity.q", "velocity.r"],
}
COLORS = ("#0072b2", "#d55e00", "#009e73", "#8a5fbf")


def main() -> None:
    """Build, run, compare, draw."""
    fmu = build_fmu(load_vehicle(NAME), 3, Path(f"{NAME}.fmu"))
    unpacked = extract(str(fmu))
    folder = Path(unpacked) / "extra" / "org.fmi-standard.fmi-ls-ref"
    expected = read_csv(folder / f"{NAME}_out.csv")
    result = simulate_fmu(
        str(fmu),
        fmi_type="CoSimulation",
        stop_time=expected["time"][-1],
        output_interval=0.2,
        start_values={p.name: p.value for p in read_ssv(str(folder / f"{NAME}_start.ssv")).parameters},
        input=read_csv(folder / f"{NAME}_in.csv"),
        output=expected.dtype.names[1:],
    )
    shutil.rmtree(unpacked)
    states = [name for names in PANELS.values() for name in names]
    gaps = {name: float(np.abs(result[name] - expected[name]).max()) for name in states}
    worst = max(gaps, key=gaps.__getitem__)
    print(f"{NAME}: no state differs by more than {gaps[worst]:.1e} ({worst}) from its reference")

    figure, axes = plt.subplots(2, 2, figsize=(9.0, 5.4), sharex=True, layout="constrained")
    for panel, (title, names) in zip(axes.flat, PANELS.items(), strict=True):
        for name, color in zip(names, COLORS, strict=False):
            panel.plot(result["time"], result[name], color=color, linewidth=1.4, label=name.partition(".")[2])
            panel.plot(expected["time"][::4], expected[name][::4], "o", color=color, markersize=3.6, fillstyle="none")
        panel.set_ylabel(title)
        panel.grid(alpha=0.3)
        panel.legend(
            ncols=4, fontsize=8, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0
        )
    for panel in axes[-1]:
        panel.set_xlabel("time, s")
    figure.suptitle(f"{NAME}: the FMU (lines) and its reference, integrated apart from it (circles)", fontsize=11)
    figure.savefig("fmu-reference.png", dpi=90, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    main()
