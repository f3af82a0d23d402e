"""The energy model of Wang, Zhang and Kim 2024, term by term; `fit` fits it to recordings."""

from tomr_power_model.wang2024.coefficients import WANG2024_PARAMETERS, Coefficients
from tomr_power_model.wang2024.model import Wang2024Model

__all__ = ["WANG2024_PARAMETERS", "Coefficients", "Wang2024Model"]
