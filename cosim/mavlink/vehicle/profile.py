"""Profiles: the autopilot that the vehicle imitates, with the numbers of its modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from cosim.mavlink.wire.options import ProfileName
from cosim.simulation.commands.commands import MODES, Mode

SUBMARINE = 12  # MAV_TYPE_SUBMARINE
_ARMED = 128
_CUSTOM = 1


def _px4(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


_RETURN = _px4(4, 5)


class ModeEntry(NamedTuple):
    """A mode as ground stations know it."""

    # MAV_MODE_FLAG has the bits custom mode 1, auto 4, guided 8, stabilized 16, manual input 64; ArduSub sets the
    # stabilized and manual input bits in each mode.

    name: str
    standard: int  # MAV_STANDARD_MODE; 0 for none
    flags: int  # MAV_MODE_FLAG
    ardusub_flags: int
    ardusub_mode: int  # custom_mode
    px4_mode: int


MODE_TABLE: dict[Mode, ModeEntry] = {
    "manual": ModeEntry("Manual", 0, 65, 81, 19, _px4(1)),
    "hold": ModeEntry("Position hold", 1, 25, 89, 16, _px4(4, 3)),
    "reach": ModeEntry("Region reaching", 0, 25, 89, 4, _px4(6)),
    "mission": ModeEntry("Mission of regions", 6, 29, 89, 3, _px4(4, 4)),
    "surface": ModeEntry("Surface", 5, 29, 81, 9, _px4(4, 6)),
    "stabilize": ModeEntry("Stabilize", 0, 81, 81, 0, _px4(7)),
    "depth_hold": ModeEntry("Depth hold", 4, 81, 81, 2, _px4(2)),
}


@dataclass(frozen=True)
class Profile:
    """An autopilot that ground stations know."""

    name: ProfileName
    autopilot: int  # MAV_AUTOPILOT
    custom_modes: dict[Mode, int]  # ``custom_mode`` of each mode
    is_packed: bool  # true if a mode's number is PX4's: main mode shifted by 16 bits, sub-mode by 24
    centered_stick: int  # value of MANUAL_CONTROL's vertical stick at rest
    full_tilt_stick: int  # value of MANUAL_CONTROL's roll and pitch extensions at full deflection
    has_home_item: bool  # true if item 0 of a mission is home, as in ArduPilot
    has_parameter_hash: bool  # true if the list of parameters begins with its hash
    # true if stations send parameters of any type, as ArduPilot's do; otherwise only REAL32 is accepted
    casts_parameters: bool
    system_id_parameter: str  # name of the parameter of the system id
    imitated_release: tuple[int, int, int] | None  # release of the imitated autopilot; None if none is imitated

    def find_mode(self, number: int) -> Mode | None:
        """Return the mode with a ``custom_mode``, or None if there is none."""
        return next((mode for mode in MODES if self.custom_modes[mode] == number), None)

    def find_commanded_mode(self, first: int, second: int) -> Mode | None:
        """Return the mode that MAV_CMD_DO_SET_MODE selects, or None if there is none."""
        if not self.is_packed:
            return self.find_mode(first)
        if not (0 <= first <= 0xFF and 0 <= second <= 0xFF):
            return self.find_mode(first) if second == 0 else None
        return self.find_mode(_px4(first, second))

    def is_return(self, number: int) -> bool:
        """Return True if a ``custom_mode`` is PX4's return, which is no mode here but a command to surface at home."""
        return self.is_packed and number == _RETURN

    def base_mode(self, mode: Mode, armed: bool) -> int:
        """Return MAV_MODE_FLAG bits: custom mode, the bits of the mode, and armed."""
        entry = MODE_TABLE[mode]
        return (entry.ardusub_flags if self.name == "ardusub" else entry.flags) | (_ARMED if armed else 0)


def is_custom(base_mode: int) -> bool:
    """Return True if a base mode has the custom mode bit."""
    return bool(base_mode & _CUSTOM)


_ARDUSUB = {mode: entry.ardusub_mode for mode, entry in MODE_TABLE.items()}
_PX4 = {mode: entry.px4_mode for mode, entry in MODE_TABLE.items()}

PROFILES: dict[ProfileName, Profile] = {
    "ardusub": Profile("ardusub", 3, _ARDUSUB, False, 500, 400, True, False, True, "SYSID_THISMAV", (4, 5, 0)),
    "px4": Profile("px4", 12, _PX4, True, 500, 1000, False, True, False, "MAV_SYS_ID", (1, 15, 0)),
    "generic": Profile("generic", 0, _PX4, True, 0, 1000, False, False, False, "SYSID_THISMAV", None),
}


def find_profile(autopilot: int) -> Profile:
    """Return the profile of a MAV_AUTOPILOT; generic for another one."""
    return next((profile for profile in PROFILES.values() if profile.autopilot == autopilot), PROFILES["generic"])
