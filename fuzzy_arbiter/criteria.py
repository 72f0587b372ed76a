"""Prioritized criteria: which of several needs matters now, as a human pilot decides it; latches against noise."""

from fuzzy_arbiter.hierarchy import SECTION_VI, Criterion, prioritized
from fuzzy_arbiter.hysteresis import HysteresisArbiter
from fuzzy_arbiter.membership import ramp

__all__ = ["SECTION_VI", "Criterion", "HysteresisArbiter", "prioritized", "ramp"]
