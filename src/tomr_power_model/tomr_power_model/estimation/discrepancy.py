"""The error model of the simulator: how exact it is taken to be, in one place.

No simulator is exact, and a recording of minutes has samples enough to show it. What a fit finds
counts only beyond these shares.
"""

from attrs import frozen


@frozen(kw_only=True)
class SimulatorDiscrepancy:
    """Errors of the simulator itself, each a share of what it is written beside."""

    motion: float = 2e-3  # of the standard deviation of a speed: floor of its noise
    power: float = 0.03  # of the standard deviation of a power: counts as explained
    torque: float = 0.006  # of the power's standard deviation: less is not worth a correction
    parameter: float = 0.02  # of a fitted offset: added to its interval
    log_evidence_per_sample: float = 0.003  # that a finding must bring
    named: float = 0.01  # of the log evidence of all findings: what one of them must bring
    left: float = 0.2  # of what is left: what brings as much is a finding beside any others
    unmodelled: float = 0.12  # the same, of an effect without a name
    temper: float = 3.0  # root of the odds: likelihoods are not exact either


SIMULATOR = SimulatorDiscrepancy()
