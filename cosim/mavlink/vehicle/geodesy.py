"""Conversion between local and global positions, by the plane tangent to the WGS84 ellipsoid at an origin."""

from __future__ import annotations

import math

from cosim.scenario.region_tables import Vector3

_SEMI_MAJOR = 6_378_137.0  # m, WGS84
_ECCENTRICITY_SQUARED = 6.69437999014e-3
_MIN_COSINE = 1e-6  # keeps longitudes finite at the poles


class LocalFrame:
    """Positions about an origin at the surface [m, NED] as latitude and longitude [deg] and altitude [m]."""

    def __init__(self, latitude: float, longitude: float, altitude: float = 0.0) -> None:
        self.latitude, self.longitude, self.altitude = latitude, longitude, altitude
        sine, cosine = math.sin(math.radians(latitude)), math.cos(math.radians(latitude))
        inside = 1.0 - _ECCENTRICITY_SQUARED * sine * sine
        meridian = _SEMI_MAJOR * (1.0 - _ECCENTRICITY_SQUARED) / inside**1.5
        normal = _SEMI_MAJOR / math.sqrt(inside)
        self._north = math.radians(1.0) * meridian  # m in a degree of latitude
        self._east = math.radians(1.0) * normal * max(cosine, _MIN_COSINE)  # m in a degree of longitude

    def to_global(self, position: Vector3) -> Vector3:
        """Return latitude and longitude [deg] and altitude [m] of a position [m, NED]; NaN stays."""
        north, east, down = position
        return self.latitude + north / self._north, self.longitude + east / self._east, self.altitude - down

    def to_local(self, latitude: float, longitude: float, altitude: float) -> Vector3:
        """Return the position [m, NED] of a latitude and longitude [deg] and an altitude [m]; NaN stays."""
        around = longitude - self.longitude
        if math.isfinite(around):
            around = math.remainder(around, 360.0)
        return (latitude - self.latitude) * self._north, around * self._east, self.altitude - altitude
