"""A mission item as received."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ReceivedMissionItem:
    """The fields of MISSION_ITEM_INT; a station reads back what it wrote."""

    frame: int
    command: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int  # 1e-7 deg, or 1e-4 m
    y: int
    z: float  # m
