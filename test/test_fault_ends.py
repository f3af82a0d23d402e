"""Normal is named soon after a fault has ended: a moment of a long drive in which it was not."""

from tomr_demo.acts import twist_at
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.plant.samples import command_sample
from tomr_sim_bridge.plant.simulation import Simulation

TICK = NANOSECONDS // 20
BEGIN = 1_700_001_080 * NANOSECONDS
COMES, RESTS, GOES_ON, ENDS = 11.95, 16.32, 20.32, 21.9  # s, of the fault and of the robot
AHEAD = NANOSECONDS // 5  # by which commands are early


def test_normal_is_named_within_a_second_and_a_half_of_a_lost_encoder_s_end() -> None:
    """The other wheels feel the one that catches up: it took 2.0 s."""
    robot = shipped_robot("reference")
    simulation = Simulation(robot, 5, start_ns=BEGIN)
    pipeline = Pipeline(robot, DiagnosisSettings.of({}, ""))
    topics, said = {item.topic for item in pipeline.inputs}, []
    for count in range(round(24.0 * 20)):
        time, stamp = 0.05 * count, BEGIN + TICK * count
        if abs(time - COMES) < 1e-6 or abs(time - ENDS) < 1e-6:
            simulation.set_fault("encoder_lost", wheel=1, severity=float(time < ENDS - 1e-6))
        still = RESTS <= time < GOES_ON
        twist = (0.0, 0.0, 0.0) if still else twist_at((stamp + AHEAD) / NANOSECONDS % 1e5)
        command = command_sample(stamp + AHEAD, *twist)
        simulation.command(*twist, stamp_ns=stamp + AHEAD)
        pipeline.take(command.topic, to_bag(command.message), stamp)
        for sample in simulation.step_to(stamp + TICK):
            if sample.topic in topics:
                step = pipeline.take(sample.topic, to_bag(sample.message), sample.stamp_ns)
                said += [((d.stamp_ns - BEGIN) / NANOSECONDS, d.state.name) for d in step.diagnoses]
    before = [name for time, name in said if time <= ENDS]
    assert before[-1] == "motor system fault 1"
    back = next(time for time, name in said if time > ENDS and name == "normal")
    assert back - ENDS < 1.5
