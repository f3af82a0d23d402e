"""Faults of the explained robot in MuJoCo: what cannot be put into recordings honestly."""

from attrs import frozen

from tomr_commission.evidence import first_alarm
from tomr_commission.observed import Observed, frames_of, unit_of_motors
from tomr_commission.parallel import on_all_cores
from tomr_commission.rehearsal import Usage, robot_of
from tomr_commission.trials import Trial, smallest_found
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.errors import InputError
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_sim_bridge.faults import all_parameters
from tomr_sim_bridge.missions.mission import Mission
from tomr_sim_bridge.missions.schema import PlannedFault, RandomPhase, TwistPhase
from tomr_training.drives import Drive
from tomr_training.simulated_drive import START_NS, simulated_drive

_SEED = 81_000_000
_ONSET = 3.0  # s
_PHASES = 8
_DRY = "friction.coulomb"
_LEAST_FRICTION = 0.02  # N m, of a robot that describes none


@frozen
class SimulatedKind:
    """One fault of the simulator: which of its settings is made smaller and smaller."""

    fault: str
    label: str
    unit: str
    sizes: tuple[float, ...]  # the largest first
    setting: str = "severity"
    per_friction: bool = False  # sizes are shares of the robot's own dry friction


_SHARES = (1.0, 0.6, 0.4, 0.2, 0.1)
KINDS: tuple[SimulatedKind, ...] = (
    SimulatedKind("control_signal_lost", "control signal of a motor lost", "of it", _SHARES),
    SimulatedKind("encoder_lost", "encoder loses counts", "of them", _SHARES),
    SimulatedKind("floor_slippery", "slippery floor", "of the slipperiest", _SHARES),
    SimulatedKind("wheel_stuck", "wheel stuck", "", (1.0,)),
    SimulatedKind(
        "bearing_dragging",
        "bearing drags",
        "times the robot's own friction",
        (3.0, 1.0, 0.5, 0.33, 0.2),
        "torque",
        per_friction=True,
    ),
    SimulatedKind(
        "motor_resistance_high",
        "resistance of a motor up",
        "times its own on top",
        (2.0, 1.0, 0.5, 0.3, 0.15),
        "rise",
    ),
    SimulatedKind(
        "motor_torque_weak", "torque of a motor lost", "of it", (0.5, 0.35, 0.2, 0.1), "loss"
    ),
    SimulatedKind("commands_ignored", "commands not followed", "", (1.0,)),
)


@frozen
class SimulatedCase:
    """One fault at a wheel."""

    kind: SimulatedKind
    wheel: int | None  # 1..3
    seed: int


def cases() -> list[SimulatedCase]:
    """Every kind that the simulator can do, at every wheel that it can be at."""
    known = all_parameters()
    found: list[SimulatedCase] = []
    for kind in KINDS:
        if f"faults.{kind.fault}.{kind.setting}" not in known:
            continue
        at_wheels = f"faults.{kind.fault}.wheel" in known
        for wheel in (1, 2, 3) if at_wheels else (None,):
            found.append(SimulatedCase(kind, wheel, _SEED + len(found)))
    return found


def try_simulated(
    robot: str, bands: BandSettings, settings: ClassifierSettings, usage: Usage, unit: str
) -> list[Trial]:
    """Each fault at each wheel, downwards until it is not found, on all cores.

    Raises InputError for a robot that MuJoCo cannot do, or whose motors are not measured in `unit`.
    """
    jobs = [(robot, bands, settings, usage, unit, case) for case in cases()]
    return [trial for trials in on_all_cores(_tried, jobs) for trial in trials]


_Job = tuple[str, BandSettings, ClassifierSettings, Usage, str, SimulatedCase]


def _tried(job: _Job) -> list[Trial]:
    robot, bands, settings, usage, unit, case = job
    kind, wheel = case.kind, 0 if case.wheel is None else case.wheel - 1

    def attempt(size: float) -> Trial:
        seen = observed_simulation(simulated_fault(robot, usage, case, size))
        if unit_of_motors(seen) != unit:
            raise InputError(
                f"the recordings hold {unit} of the motors, the simulator {unit_of_motors(seen)}"
            )
        begin = _ONSET - (int(seen.stamp_ns[0]) - START_NS) / NANOSECONDS
        alarm = first_alarm(frames_of(seen, bands), settings, robot_of(robot), begin)
        name = f"{kind.label} (simulated)"
        return Trial.of(name, size, kind.unit, wheel=wheel, begin=begin, alarm=alarm)

    return smallest_found(kind.sizes, attempt)


def observed_simulation(drive: Drive) -> Observed:
    """A drive in MuJoCo as the residual stage sees it."""
    return Observed.of(drive.mission.name, list(simulated_drive(drive).frames))


def simulated_fault(robot: str, usage: Usage, case: SimulatedCase, size: float) -> Drive:
    """A drive in which the fault comes on after some seconds and stays."""
    described = robot_of(robot)
    kind = case.kind
    own = max(*described.everywhere(_DRY, "torque"), _LEAST_FRICTION)
    changed = size * own if kind.per_friction else size
    settings: dict[str, float | int] = {"severity": 1.0, kind.setting: changed}
    if case.wheel is not None:
        settings["wheel"] = case.wheel
    phase = RandomPhase(_PHASES, usage.speed, usage.yaw_rate, (0.8, 1.2), 0.0)
    mission = Mission(
        name=kind.fault,
        floor_friction=0.8,
        stamp_jitter=0.0005,
        seed=case.seed,
        phases=(TwistPhase((0.0, 0.0, 0.0), 1.0), phase),
        faults=(PlannedFault(kind.fault, _ONSET, None, settings),),
    )
    return Drive(case.seed, described, described, mission)
