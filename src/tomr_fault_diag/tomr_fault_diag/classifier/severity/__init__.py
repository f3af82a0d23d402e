"""How bad a named fault is: a physical quantity with its interval."""

from tomr_fault_diag.classifier.severity.watch import Severity, SeverityWatch

__all__ = ["Severity", "SeverityWatch"]
