"""What an FMU holds beside its description, its sources and its binaries."""

from __future__ import annotations

from plant_fmu.vehicle import Vehicle


def contents(vehicle: Vehicle, fmi: int) -> dict[str, bytes]:
    """Return further members of an FMU.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    fmi : int
        2 or 3.

    Returns
    -------
    dict of str to bytes
        Contents by name in the archive.
    """
    return {}
