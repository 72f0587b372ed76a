"""A fuzzy arbiter of prioritised criteria, which decides to what degree each one matters now."""

from fuzzy_arbiter.arbiter import ENGINES, Arbiter
from fuzzy_arbiter.definition import SECTION_VI, Criterion, Rule, Term, hierarchical_rules
from fuzzy_arbiter.errors import ArbiterError, DefinitionError, MembershipError
from fuzzy_arbiter.membership import ramp

__all__ = [
    "ENGINES",
    "SECTION_VI",
    "Arbiter",
    "ArbiterError",
    "Criterion",
    "DefinitionError",
    "MembershipError",
    "Rule",
    "Term",
    "hierarchical_rules",
    "ramp",
]
