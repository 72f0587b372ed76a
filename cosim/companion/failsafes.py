"""The failsafe parameters of the autopilot for a lost companion: read and shown, never set."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from cosim.mavlink.wire.options import ProfileName

_REQUEST_PERIOD = 0.5  # s, between two requests of the missing parameters
_READ_TIMEOUT = 3.0  # s, from the first request on; an ArduSub does not answer requests of parameters that it lacks
_MAV_PARAM_TYPE_INT32 = 6

_FAILSAFE_ACTIONS = {0: "does nothing", 1: "warns", 2: "disarms"}
_ON_LOST_STICKS = {**_FAILSAFE_ACTIONS, 1: "warns and centers the sticks"}
_ON_GCS_LOSS = {**_FAILSAFE_ACTIONS, 3: "holds the depth", 4: "surfaces"}
_ON_LOST_SET_POINTS = {
    0: "changes to Position", 1: "changes to Altitude", 2: "changes to Stabilized", 3: "returns", 4: "lands",
    5: "holds", 6: "terminates", 7: "disarms",
}  # fmt: skip
_ON_LOST_LINK = {0: "does nothing", 1: "holds", 2: "returns", 3: "lands", 5: "terminates", 6: "disarms"}


@dataclass(frozen=True)
class Parameter:
    """A parameter of an autopilot, with its meaning, and that of its values if it is an enumeration."""

    name: str
    meaning: str
    choices: dict[int, str] | None = None


PARAMETERS: dict[ProfileName, tuple[Parameter, ...]] = {
    "ardusub": (
        Parameter("FS_PILOT_INPUT", "when sticks stop", _ON_LOST_STICKS),
        Parameter("FS_PILOT_TIMEOUT", "s until then"),
        Parameter("RC_OVERRIDE_TIME", "s for which the last sticks stay active, -1 for ever"),
        Parameter("FS_GCS_ENABLE", "on a ground station that falls silent", _ON_GCS_LOSS),
        Parameter("FS_GCS_TIMEOUT", "s until then"),
        Parameter("FS_EKF_ACTION", "on an unreliable estimate", _FAILSAFE_ACTIONS),
        Parameter("FS_EKF_THRESH", "variance above which the estimate is unreliable"),
        Parameter("FS_LEAK_ENABLE", "on a leak", {0: "does nothing", 1: "warns", 2: "surfaces"}),
        Parameter("FS_CRASH_CHECK", "on a crash", _FAILSAFE_ACTIONS),
        Parameter("BATT_FS_LOW_ACT", "on a low battery", {0: "does nothing", 2: "disarms", 3: "surfaces"}),
        Parameter("SYSID_MYGCS", "system whose sticks are accepted"),
        Parameter("MAV_GCS_SYSID", "system whose sticks are accepted, from 4.7 on"),
        Parameter("MAV_GCS_SYSID_HI", "last system of a range of such systems, 0 for none"),
        Parameter("JS_GAIN_DEFAULT", "pilot gain"),
        Parameter("RC3_TRIM", "us, of the vertical stick's pulse"),
        Parameter("JS_THR_GAIN", "gain of the vertical stick beside it"),
        Parameter("EK3_MAG_CAL", "when it learns the magnetic field, 2: never"),
        Parameter("ACRO_YAW_P", "yaw rate of a full stick, in 45 deg/s"),
        Parameter("ATC_ANGLE_MAX", "angle of a full stick of roll or pitch, in degrees"),
        Parameter("ANGLE_MAX", "the same before 4.7, in hundredths of a degree"),
        Parameter("ATC_ANG_PIT_P", "gain from pitch angle to pitch rate"),
        Parameter("ATC_RAT_PIT_P", "proportional gain of the pitch rate loop"),
        Parameter("ATC_RAT_PIT_I", "integral gain of the pitch rate loop"),
        Parameter("PILOT_SPEED_UP", "climb rate of a full vertical stick, in cm/s"),
        Parameter("PILOT_SPEED_DN", "its descent rate, in cm/s, 0 for the climb rate"),
    ),
    "px4": (
        Parameter("COM_OF_LOSS_T", "s until stopped set-points count as lost"),
        Parameter("COM_OBL_RC_ACT", "on lost set-points", _ON_LOST_SET_POINTS),
        Parameter("COM_RC_LOSS_T", "s until stopped sticks count as lost"),
        Parameter("NAV_RCL_ACT", "on lost sticks", _ON_LOST_LINK),
        Parameter("COM_DL_LOSS_T", "s until a ground station that falls silent counts as lost"),
        Parameter("NAV_DLL_ACT", "on a lost ground station", _ON_LOST_LINK),
        Parameter("UUV_THRUST_SAT", "maximum fraction of the force along each axis"),
        Parameter("UUV_TORQUE_SAT", "maximum fraction of the moment about each axis"),
    ),
    "generic": (),
}
# parameters of the reaction to a lost companion; at least one of them must be nonzero
_REACTIONS = {"ardusub": ("FS_PILOT_INPUT", "FS_GCS_ENABLE"), "px4": ("COM_OF_LOSS_T",)}
# absent in some versions: no warning without them
_OPTIONAL = (
    "SYSID_MYGCS", "MAV_GCS_SYSID", "MAV_GCS_SYSID_HI", "FS_GCS_TIMEOUT", "ATC_ANGLE_MAX", "ANGLE_MAX", "RC3_TRIM",
)  # fmt: skip
_TRIM_TOLERANCE = 30.0  # us, of RC3_TRIM
_HOLD_TIMES = ("RC_OVERRIDE_TIME", "FS_PILOT_TIMEOUT")  # times [s] the last sticks act: with a radio, and without one
_MAX_HOLD_TIME = 1.0  # s
_NEVER_LEARN = 2.0  # value of EK3_MAG_CAL: never learn the magnetic field
_STICK_MODES = (0.0, 1.0, 2.0)  # values of COM_OBL_RC_ACT: modes that need sticks; without them NAV_RCL_ACT applies
_SATURATION = "UUV_THRUST_SAT"


class Failsafes:
    """Requests and collects the failsafe parameters of one autopilot."""

    def __init__(self, profile: ProfileName) -> None:
        self._profile: ProfileName = profile
        self.values: dict[str, float] = {}
        self._first_request, self._last_request = math.inf, -math.inf  # our times [s] of the first and the last request

    def names_to_request(self, now: float) -> list[str]:
        """Return the names of missing parameters to request at our time `now` [s]; none for 0.5 s after a request."""
        if self.is_read(now) or now - self._last_request < _REQUEST_PERIOD:
            return []
        self._first_request = min(self._first_request, now)
        self._last_request = now
        return self._missing()

    def receive(self, message: Any) -> None:
        """Store the value of a PARAM_VALUE, if it is a finite one of the profile's parameters."""
        name, value = message.param_id, float(message.param_value)
        if name in {parameter.name for parameter in PARAMETERS[self._profile]}:
            if self._profile == "px4" and message.param_type == _MAV_PARAM_TYPE_INT32:  # PX4 sends its bits in a float
                (value,) = struct.unpack("<i", struct.pack("<f", value))
            if math.isfinite(value):
                self.values[name] = float(value)

    def is_read(self, now: float) -> bool:
        """Return True if all parameters were received, or the wait for the missing ones is over."""
        return not self._missing() or now - self._first_request > _READ_TIMEOUT

    def text(self) -> list[str]:
        """Return the received parameters as lines of text; the last ones are warnings."""
        lines = [self._line(parameter) for parameter in PARAMETERS[self._profile] if parameter.name in self.values]
        if self.values.get("FS_GCS_ENABLE") and "FS_GCS_TIMEOUT" not in self.values:
            lines.append("FS_GCS_TIMEOUT not answered: an ArduSub without it (4.5) uses 2.5 s")
        silent = [name for name in self._missing() if name not in _OPTIONAL]
        if silent:
            lines.append(f"not answered by the autopilot: {', '.join(silent)}")
        return [*lines, *(f"WARNING: {warning}" for warning in self._warnings())]

    def _warnings(self) -> Iterator[str]:
        values, reactions = self.values, _REACTIONS.get(self._profile, ())
        if reactions and all(values.get(name, 0.0) == 0.0 for name in reactions):
            yield f"no reaction is known if the companion fails: {', '.join(reactions)} are 0 or unknown"
        if values.get("FS_PILOT_INPUT") == 2.0:
            yield "FS_PILOT_INPUT 2 disarms a held vehicle after FS_PILOT_TIMEOUT, as nobody sends sticks; expected 1"
        lost = values.get("COM_OBL_RC_ACT")
        if lost in _STICK_MODES and values.get("NAV_RCL_ACT") == 0.0:
            yield (
                "without sticks, the last forces act for ever after set-points are lost: "
                f"COM_OBL_RC_ACT is {lost:g} and NAV_RCL_ACT 0; expected COM_OBL_RC_ACT 5, which holds"
            )
        saturation = values.get(_SATURATION, 1.0)
        if saturation < 1.0:
            yield f"{_SATURATION} is {saturation:g}, but the law counts on the thrusters' full force; expected 1"
        if warning := self.held_sticks_warning():
            yield warning

    def held_sticks_warning(self, accepts_unknown: bool = True) -> str:
        """Return the parameters by which the last sticks act for long after a lost link; empty if none is known."""
        if self.values.get("FS_PILOT_INPUT") == 0.0:
            return "the last sticks outlast a lost link: FS_PILOT_INPUT 0 disables FS_PILOT_TIMEOUT; expected 1"
        unknown = [name for name in self._missing() if name in ("FS_PILOT_INPUT", *_HOLD_TIMES)]
        if unknown and not accepts_unknown:
            return f"the last sticks may outlast a lost link: {', '.join(unknown)} not answered"
        hold_times = {name: self.values[name] for name in _HOLD_TIMES if name in self.values}
        if all(0.0 <= time <= _MAX_HOLD_TIME for time in hold_times.values()):
            return ""
        settings = ", ".join(f"{name} is {time:g}" for name, time in hold_times.items())
        return f"the last sticks outlast a lost link: {settings}; expected {_MAX_HOLD_TIME:g} s or less"

    def accepted_systems(self) -> range:
        """Return the system ids whose sticks the autopilot accepts; empty if they are not known."""
        first = self.values.get("MAV_GCS_SYSID", self.values.get("SYSID_MYGCS"))
        if first is None:
            return range(0)
        return range(round(first), round(max(first, self.values.get("MAV_GCS_SYSID_HI", first))) + 1)

    def ignored_sticks(self, system: int) -> str:
        """Return the parameters by which the autopilot ignores sticks of a system id; empty if none is known."""
        accepted = self.accepted_systems()
        if not accepted or system in accepted:
            return ""
        name = "MAV_GCS_SYSID" if "MAV_GCS_SYSID" in self.values else "SYSID_MYGCS"
        return f"{name} is {accepted[0]}" + (f", {name}_HI {accepted[-1]}" if accepted[-1] > accepted[0] else "")

    def misread_throttle(self) -> str:
        """Return the value of RC3_TRIM by which a resting vertical stick would push; empty if none is known."""
        # A resting stick is 1500 us: the middle between RC3_TRIM and 1900 us, from 4.7 on RC3_TRIM itself.
        trim = self.values.get("RC3_TRIM")
        if trim is None or not self.accepted_systems():
            return ""
        expected = 1500.0 if "MAV_GCS_SYSID" in self.values else 1100.0
        if abs(trim - expected) <= _TRIM_TOLERANCE:
            return ""
        push = "down" if trim > expected else "up"
        return (
            f"RC3_TRIM is {trim:g}: a resting vertical stick would push {push}; expected {expected:g} in this version"
        )

    def learns_magnetic_field(self) -> bool:
        """Return True if an ArduSub learns the magnetic field in flight; without a fix its heading then drifts."""
        return self.values.get("EK3_MAG_CAL", _NEVER_LEARN) != _NEVER_LEARN

    def _line(self, parameter: Parameter) -> str:
        value = self.values[parameter.name]
        action = (parameter.choices or {}).get(round(value))
        return f"{parameter.name} {value:g}: {parameter.meaning}" + (f" it {action}" if action else "")

    def _missing(self) -> list[str]:
        return [p.name for p in PARAMETERS[self._profile] if p.name not in self.values]
