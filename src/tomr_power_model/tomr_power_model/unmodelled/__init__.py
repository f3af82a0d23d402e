"""What has no name: smooth terms of a few variables that were learnt, and how a robot runs with
them. Adding a family of terms is adding a file to `families`.
"""

import tomr_power_model.unmodelled.families  # noqa: F401 -- fills the registry
from tomr_power_model.unmodelled.base import FAMILIES, Acts, Axis, Family
from tomr_power_model.unmodelled.motion import Motion, motion_of
from tomr_power_model.unmodelled.term import Actions, LearntTerm

__all__ = [
    "FAMILIES",
    "Actions",
    "Acts",
    "Axis",
    "Family",
    "LearntTerm",
    "Motion",
    "motion_of",
]
