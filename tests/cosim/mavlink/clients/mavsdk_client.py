"""Run by the tests in an environment that has MAVSDK, 4 or older: does what a user does, prints a JSON object.

python mavsdk_client.py udpin://127.0.0.1:PORT
"""

import asyncio
import contextlib
import json
import math
import os
import socket
import sys

try:  # MAVSDK 4: in this process
    from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
    from mavsdk.asyncio.plugins.action import ActionAsync
    from mavsdk.asyncio.plugins.info import InfoAsync
    from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
    from mavsdk.asyncio.plugins.offboard import OffboardAsync
    from mavsdk.asyncio.plugins.param import ParamAsync
    from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
    from mavsdk.plugins.info import InfoError
    from mavsdk.plugins.mission_raw import MissionItem
    from mavsdk.plugins.offboard import PositionNedYaw
    from mavsdk.plugins.param import ParamError
except ImportError:
    Mavsdk = None
    from mavsdk import System
    from mavsdk.info import InfoError
    from mavsdk.mission_raw import MissionItem
    from mavsdk.offboard import PositionNedYaw
    from mavsdk.param import ParamError

PATIENCE = 60.0  # s, for a step
SETTLED = 0.05
FAR, NEARER = 4e-5, 1e-5  # deg, about 4.4 m and 1.1 m


class Vehicle:
    """What both generations of the API have in common."""

    async def connect(self, address):
        if Mavsdk is None:
            with socket.socket() as free:  # of several servers at once each needs a port of its own
                free.bind(("127.0.0.1", 0))
                port = free.getsockname()[1]
            self.system = System(port=port)
            await self.system.connect(system_address=address)
            await first(self.system.core.connection_state(), lambda state: state.is_connected)
            for name in ("telemetry", "param", "action", "mission_raw", "offboard", "info"):
                setattr(self, name, getattr(self.system, name))
            return
        self.mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        await self.mavsdk.add_any_connection(address)
        system = await self.mavsdk.first_autopilot(PATIENCE)
        assert system is not None, "no autopilot"
        self.telemetry, self.param, self.action = TelemetryAsync(system), ParamAsync(system), ActionAsync(system)
        self.mission_raw, self.offboard, self.info = MissionRawAsync(system), OffboardAsync(system), InfoAsync(system)

    def stream(self, name):
        return getattr(self.telemetry, name if Mavsdk is None else f"subscribe_{name}")()


async def first(stream, wanted=lambda value: True):
    """Return the first value that is wanted."""
    async for value in stream:
        if wanted(value):
            return value
    raise AssertionError("the stream ended")


def fields(value, *names):
    return [getattr(value, name) for name in names]


async def steps(vehicle, address):  # noqa: C901 - one step after the other
    """Yield each step's name and what does it."""
    yield "connect", vehicle.connect(address)
    yield "health", first(vehicle.stream("health_all_ok"), bool)

    async def position():
        there = await first(vehicle.stream("position"))
        return fields(there, "latitude_deg", "longitude_deg", "relative_altitude_m", "absolute_altitude_m")

    async def ned():
        there = await first(vehicle.stream("position_velocity_ned"))
        return fields(there.position, "north_m", "east_m", "down_m")

    async def attitude():
        return fields(await first(vehicle.stream("attitude_euler")), "roll_deg", "pitch_deg", "yaw_deg")

    async def mode(name=None):
        return (await first(vehicle.stream("flight_mode"), lambda mode: name in (None, mode.name))).name

    async def params():
        found = await vehicle.param.get_all_params()
        return {p.name: p.value for p in [*found.float_params, *found.int_params]}

    async def gain():
        return next(p for p in (await vehicle.param.get_all_params()).float_params if p.name.startswith("LAW_"))

    async def change_param():
        before = await gain()
        await vehicle.param.set_param_float(before.name, before.value * 1.25)
        after = await vehicle.param.get_param_float(before.name)
        await vehicle.param.set_param_float(before.name, before.value)
        return [before.name, before.value, after, await vehicle.param.get_param_float(before.name)]

    async def refused_param():
        """Ask for what is out of range."""
        before = await gain()
        try:
            await vehicle.param.set_param_float(before.name, -1e30)
        except ParamError as error:
            return [str(error), before.value, await vehicle.param.get_param_float(before.name)]
        return ["taken", before.value, await vehicle.param.get_param_float(before.name)]

    async def unknown_param():
        try:
            return await vehicle.param.get_param_float("NO_SUCH_PARAM")
        except ParamError as error:
            return str(error)

    async def arm():
        await vehicle.action.arm()
        return await first(vehicle.stream("armed"), bool)

    async def disarm():
        await vehicle.action.disarm()
        return await first(vehicle.stream("armed"), lambda armed: not armed)

    async def go_to():
        there = await first(vehicle.stream("position"))
        target = there.latitude_deg + FAR, there.longitude_deg
        await vehicle.action.goto_location(*target, there.absolute_altitude_m, math.nan)
        closer = await first(vehicle.stream("position"), lambda p: abs(p.latitude_deg - target[0]) < 0.5 * FAR)
        return [there.latitude_deg, closer.latitude_deg, target[0]]

    async def hold():
        await vehicle.action.hold()
        return await mode("HOLD")

    async def offboard():
        there = await ned()
        target = PositionNedYaw(there[0] + 0.5, there[1], there[2], 0.0)
        await vehicle.offboard.set_position_ned(target)
        await vehicle.offboard.start()
        shown = await mode("OFFBOARD")
        await vehicle.offboard.stop()
        return shown

    async def missions():
        return len(await vehicle.mission_raw.download_mission())

    async def mission():
        """Upload regions about where it is, read them back, and set out."""
        there = await first(vehicle.stream("position"))
        items = [
            MissionItem(i, 6, 16, int(i == 0), 1, 0.0, 1.0, 0.0, math.nan,
                        round(1e7 * (there.latitude_deg + i * NEARER)), round(1e7 * there.longitude_deg), -3.0, 0)
            for i in range(3)
        ]  # fmt: skip
        await vehicle.mission_raw.upload_mission(items)
        back = await vehicle.mission_raw.download_mission()
        await vehicle.mission_raw.start_mission()
        shown = await mode("MISSION")
        await vehicle.mission_raw.clear_mission()
        return [[fields(item, "command", "x", "y", "z") for item in some] for some in (items, back)] + [shown]

    async def speed():
        """Return the clock's speed once its estimate, which needs some messages, is close to 1."""
        while True:
            with contextlib.suppress(InfoError):
                if abs((factor := await vehicle.info.get_speed_factor()) - 1.0) < SETTLED:
                    return factor
            await asyncio.sleep(0.2)

    for step in (position, ned, attitude, mode, params, change_param, refused_param, unknown_param, missions, speed,
                 arm, go_to, mission, hold, offboard, disarm):  # fmt: skip
        yield step.__name__, step()


async def main(address):
    """Do all steps; a step that fails does not hinder the next ones."""
    done = {}
    async for name, work in steps(Vehicle(), address):
        try:
            done[name] = await asyncio.wait_for(work, PATIENCE)
        except Exception as error:  # noqa: BLE001  any error is reported, and the next step is tried
            done[name] = {"error": f"{type(error).__name__}: {error}"}
            if name == "connect":
                break
    return done


if __name__ == "__main__":
    sys.stdout.write(json.dumps(asyncio.run(main(sys.argv[1]))))
    sys.stdout.flush()
    os._exit(0)  # neither library always lets go of its threads
