"""The energy model of Wang, Zhang and Kim 2024, term by term."""

from tomr_power_model.wang2024.coefficients import WANG2024_PARAMETERS, Coefficients
from tomr_power_model.wang2024.fit import Samples, fit_wang2024
from tomr_power_model.wang2024.model import Wang2024Model

__all__ = ["WANG2024_PARAMETERS", "Coefficients", "Samples", "Wang2024Model", "fit_wang2024"]
