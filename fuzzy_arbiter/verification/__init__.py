"""Verify a system from its definition alone: completeness, consistency, exclusivity, gaps.

Imports: engines.
"""

from fuzzy_arbiter.verification.report import Verification
from fuzzy_arbiter.verification.system_checks import verify

__all__ = [
    "Verification",
    "verify",
]
