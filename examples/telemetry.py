"""A run as a MAVLink vehicle: it streams over UDP to a listener of some lines with pymavlink.

What one learns: one argument makes a run a vehicle that QGroundControl, MAVProxy or a script can listen to.
"""

from pathlib import Path

from pymavlink import mavutil

from cosim import Mavlink, MavlinkOptions, load_scenario, parse_endpoint, run_scenario

if __name__ == "__main__":
    listener = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="common")
    port = listener.port.getsockname()[1]
    link = Mavlink((parse_endpoint(f"udpout:127.0.0.1:{port}"),), MavlinkOptions())
    scenario = load_scenario("paper-limited", ["time.duration=5.0", "arbiter.engine=closed"])
    run_scenario(scenario, Path("runs/streamed"), mavlink=link, report=False)
    received = []
    while message := listener.recv_match(timeout=0.5, blocking=True):
        received.append(message)
    last = next(m for m in reversed(received) if m.get_type() == "LOCAL_POSITION_NED")
    print(f"{len(received)} messages, {len({m.get_type() for m in received})} kinds")
    print(f"last seen at north {last.x:.2f} m, {last.z:.2f} m deep, {last.time_boot_ms / 1000:.1f} s after the start")
