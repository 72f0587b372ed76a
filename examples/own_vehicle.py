"""A custom vehicle, from a TOML file to an FMU and a run.

What one learns: the few keys that make a vehicle, the variables of its FMU, and that a scenario takes it by the file's
name. The vehicle is a made-up open frame of 20 kg with four vectored horizontal thrusters and two vertical ones: it can
turn its heading but neither roll nor pitch, and stays upright because its weight hangs below its buoyancy. When run
it writes frame.toml, frame.fmu, pool.toml and runs/frame here.
"""

from pathlib import Path

from cosim import load_scenario, run_scenario
from plant_fmu import Plant, build_fmu, load_vehicle

FRAME = """
name = "frame"                         # of the FMU too
title = "Open frame"
source = "Made up, to show what a vehicle file needs."

[rigid_body]
mass = 20.0                            # kg
inertia = [0.6, 0.8, 0.9]              # kg m2
center_of_gravity = [0.0, 0.0, 0.05]   # m, below the origin
weight = 196.2                         # N

[hydrostatics]
buoyancy = 197.2                       # N: comes up by itself
center_of_buoyancy = [0.0, 0.0, 0.0]

[hydrodynamics]                        # surge, sway, heave, roll, pitch, yaw
added_mass = [8.0, 14.0, 18.0, 0.2, 0.3, 0.2]
linear_damping = [6.0, 8.0, 8.0, 0.3, 0.3, 0.3]
quadratic_damping = [25.0, 35.0, 50.0, 1.5, 1.5, 1.5]

[thrusters]                            # a column each: force (3), then moment about the origin (3)
matrix = [
    [0.7071, 0.7071, -0.7071, -0.7071, 0.0, 0.0],
    [-0.7071, 0.7071, -0.7071, 0.7071, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, -1.0, -1.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-0.2, 0.2, 0.2, -0.2, 0.0, 0.0],
]
force_min = -30.0                      # N, each
force_max = 30.0
"""
POOL = """
title = "The frame in a pool"
vehicle = "frame.toml"                 # beside this file

[time]
duration = 30.0                        # s
step = 0.01                            # s

[initial]
position = [0.0, 0.0, 1.0]             # m: north, east, down

[goal]
type = "sphere"
center = [3.0, 1.0, 2.0]
radius = 0.3                           # m

[law]
name = "pd"

[actuation]
through = "thrusters"
"""

if __name__ == "__main__":
    Path("frame.toml").write_text(FRAME)

    vehicle = load_vehicle(Path("frame.toml"))  # refuses an invalid value, and names its key
    fmu = build_fmu(vehicle, 3, Path("frame.fmu"))
    print(f"{vehicle.title}: {vehicle.n_thrusters} thrusters, {fmu.name} of {fmu.stat().st_size / 1024:.0f} kB")

    with Plant(fmu) as plant:
        plant.set({"position.z": 2.0})
        plant.initialize()
        plant.step(5.0)
        print(f"left alone it comes up from 2.00 m to {plant['position.z']:.2f} m in 5 s")

    Path("pool.toml").write_text(POOL)
    said = run_scenario(load_scenario("pool.toml"), Path("runs/frame"), report=False).summary
    print(f"{said['law']} law: in the goal after {said['reach_time']:.1f} s, for good: {said['settled']};", end=" ")
    print(f"asked for {said['max_force_asked']:.0f} N, of which the thrusters gave {said['max_force']:.0f} N")
