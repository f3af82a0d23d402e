"""How bad a named fault is, and how a robot that is well has changed: quantities with intervals."""

from tomr_fault_diag.classifier.severity.interval import Severity
from tomr_fault_diag.classifier.severity.watch import SeverityWatch

__all__ = ["Severity", "SeverityWatch"]
