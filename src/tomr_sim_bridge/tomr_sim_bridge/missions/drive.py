"""Drive a mission through the simulation as fast as it goes."""

from collections.abc import Iterator

from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import Robot
from tomr_sim_bridge.missions.mission import Mission
from tomr_sim_bridge.plant.drivers import COMMAND_TIMEOUT
from tomr_sim_bridge.plant.samples import Sample, command_sample
from tomr_sim_bridge.plant.simulation import Simulation


def start_mission(mission: Mission, robot: Robot, seed: int = 0, start_ns: int = 0) -> Simulation:
    """A simulation with the loads, floor and jitter of a mission, at rest at `start_ns` [ns]."""
    return Simulation(
        robot,
        seed,
        start_ns=start_ns,
        floor_friction=mission.floor_friction or None,
        payload=mission.payload,
        stamp_jitter=mission.stamp_jitter,
        command_timeout=COMMAND_TIMEOUT,
    )


def drive(mission: Mission, simulation: Simulation, seed: int = 0) -> Iterator[list[Sample]]:
    """Yield the samples of a mission, command by command, cmd_vel among them.

    Faults take hold at the first boundary of the plant's time steps not before their start.
    """
    start_ns = simulation.stamp_ns
    plan = mission.plan(simulation.robot, seed)
    end_ns = start_ns + round(plan.duration * NANOSECONDS)
    switches = _switches(mission, start_ns, end_ns)
    for time, twist in plan.commands():
        stamp = start_ns + round(time * NANOSECONDS)
        samples: list[Sample] = []
        while switches and switches[0][0] <= stamp:
            samples.extend(_switch(simulation, *switches.pop(0)))
        samples.extend(simulation.step_to(stamp))
        simulation.command(*twist, stamp_ns=stamp)
        samples.append(command_sample(stamp, *twist))
        yield samples
    rest: list[Sample] = []
    for switch in switches:
        rest.extend(_switch(simulation, *switch))
    yield rest + simulation.step_to(end_ns)


def _switch(
    simulation: Simulation, stamp: int, fault_id: str, settings: dict[str, object]
) -> list[Sample]:
    samples = simulation.step_to(stamp)
    simulation.set_fault(fault_id, **settings)
    return samples


def _switches(
    mission: Mission, start_ns: int, end_ns: int
) -> list[tuple[int, str, dict[str, object]]]:
    """Times at which faults are set, in order; an end before a start at the same time."""
    switches: list[tuple[int, str, dict[str, object]]] = []
    for fault in mission.faults:
        begin = start_ns + round(fault.start * NANOSECONDS)
        switches.append((begin, fault.fault_id, dict(fault.settings)))
        if fault.end is not None:
            switches.append((start_ns + round(fault.end * NANOSECONDS), fault.fault_id, {}))
    switches.sort(key=lambda switch: (switch[0], bool(switch[2])))
    return [switch for switch in switches if switch[0] <= end_ns]
