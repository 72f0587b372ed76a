"""Verify a system from its definition alone: completeness, consistency, exclusivity, gaps.

Imports: engines.
"""

from fuzzy_arbiter.verification.checks import verify
from fuzzy_arbiter.verification.report import Verification

__all__ = [
    "Verification",
    "verify",
]
