"""Profiles: the autopilot that the vehicle imitates, with the numbers of its modes."""

from __future__ import annotations

from dataclasses import dataclass

from cosim.mavlink.wire.options import ProfileName
from cosim.simulation.commands.commands import MODES, Mode

SUBMARINE = 12  # MAV_TYPE_SUBMARINE

MODE_NAMES: dict[Mode, str] = {
    "manual": "Manual",
    "hold": "Position hold",
    "reach": "Region reaching",
    "mission": "Mission of regions",
    "surface": "Surface",
    "stabilize": "Stabilize",
    "depth_hold": "Depth hold",
}

# MAV_STANDARD_MODE of the modes; 0 for none
STANDARD_MODES: dict[Mode, int] = {
    "manual": 0,
    "hold": 1,
    "reach": 0,
    "mission": 6,
    "surface": 5,
    "stabilize": 0,
    "depth_hold": 4,
}

# MAV_MODE_FLAG: custom mode 1, auto 4, guided 8, stabilised 16, manual input 64
_BASE_MODES: dict[Mode, int] = {
    "manual": 65,
    "hold": 25,
    "reach": 25,
    "mission": 29,
    "surface": 29,
    "stabilize": 81,
    "depth_hold": 81,
}
# ArduSub's: each mode has the stabilized and manual input bits
_BASE_MODES_OF_ARDUSUB: dict[Mode, int] = {
    "manual": 81,
    "hold": 89,
    "reach": 89,
    "mission": 89,
    "surface": 81,
    "stabilize": 81,
    "depth_hold": 81,
}
_ARMED = 128
_CUSTOM = 1


@dataclass(frozen=True)
class Profile:
    """An autopilot that ground stations know.

    Attributes
    ----------
    autopilot : int
        MAV_AUTOPILOT.
    numbers : dict of str to int
        ``custom_mode`` of each mode.
    packed : bool
        True if a mode's number is PX4's: main mode shifted by 16 bits, sub-mode by 24.
    centred_stick : int
        Value of MANUAL_CONTROL's vertical stick at rest.
    full_tilt_stick : int
        Value of MANUAL_CONTROL's roll and pitch extensions at full deflection.
    home_is_first : bool
        True if item 0 of a mission is home, as in ArduPilot.
    stands_for : tuple of int or None
        Release of the imitated autopilot; None if none is imitated.
    """

    name: ProfileName
    autopilot: int
    numbers: dict[Mode, int]
    packed: bool
    centred_stick: int
    full_tilt_stick: int
    home_is_first: bool
    stands_for: tuple[int, int, int] | None = None

    def mode_of(self, number: int) -> Mode | None:
        """Return the mode with a ``custom_mode``, or None if there is none."""
        return next((mode for mode in MODES if self.numbers[mode] == number), None)

    def mode_of_command(self, first: int, second: int) -> Mode | None:
        """Return the mode that MAV_CMD_DO_SET_MODE selects, or None if there is none.

        Parameters
        ----------
        first, second : int
            Parameters 2 and 3 of the command: main mode and sub-mode of PX4, or ArduPilot's number. With sub-mode 0 a
            number of ArduSub is no other mode of PX4 here, except 1 and 7: ACRO and CIRCLE in ArduSub, MANUAL and
            STABILIZED in PX4.
        """
        if not self.packed:
            return self.mode_of(first)
        if not (0 <= first <= 0xFF and 0 <= second <= 0xFF):
            return self.mode_of(first) if second == 0 else None
        return self.mode_of(_px4(first, second))

    def is_return(self, number: int) -> bool:
        """Return True if a ``custom_mode`` is PX4's return, which is no mode here but a command to surface at home."""
        return self.packed and number == _RETURN

    def base_mode(self, mode: Mode, armed: bool) -> int:
        """Return MAV_MODE_FLAG bits: custom mode, the bits of the mode, and armed."""
        modes = _BASE_MODES_OF_ARDUSUB if self.name == "ardusub" else _BASE_MODES
        return modes[mode] | (_ARMED if armed else 0)


def is_custom(base_mode: int) -> bool:
    """Return True if a base mode has the custom mode bit."""
    return bool(base_mode & _CUSTOM)


def _px4(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


_RETURN = _px4(4, 5)
_ARDUSUB: dict[Mode, int] = {
    "manual": 19,
    "hold": 16,
    "reach": 4,
    "mission": 3,
    "surface": 9,
    "stabilize": 0,
    "depth_hold": 2,
}
_PX4: dict[Mode, int] = {
    "manual": _px4(1),
    "hold": _px4(4, 3),
    "reach": _px4(6),
    "mission": _px4(4, 4),
    "surface": _px4(4, 6),
    "stabilize": _px4(7),
    "depth_hold": _px4(2),
}

PROFILES: dict[ProfileName, Profile] = {
    "ardusub": Profile(
        "ardusub",
        3,
        _ARDUSUB,
        packed=False,
        centred_stick=500,
        full_tilt_stick=400,
        home_is_first=True,
        stands_for=(4, 5, 0),
    ),
    "px4": Profile(
        "px4",
        12,
        _PX4,
        packed=True,
        centred_stick=500,
        full_tilt_stick=1000,
        home_is_first=False,
        stands_for=(1, 15, 0),
    ),
    "generic": Profile("generic", 0, _PX4, packed=True, centred_stick=0, full_tilt_stick=1000, home_is_first=False),
}
