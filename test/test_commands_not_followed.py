"""A robot that is commanded to drive and stands: driver off, contactor open, collision monitor."""

from dataclasses import replace
from pathlib import Path

from tomr_fault_diag.diagnosis.offline import find_topics
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot
from tomr_sim_bridge.cli.simulate import main as tomr_simulate

MISSION = """\
name: standing
description: Nothing is done.
robot: reference
phases:
  - {pause: 9.0}
"""
STOPPED = (3.0, 6.0)  # s, in which it is commanded to drive


def test_it_is_said_within_half_a_second_and_taken_back(tmp_path: Path) -> None:
    mission = tmp_path / "standing.yaml"
    mission.write_text(MISSION)
    bag = tmp_path / "bag"
    assert tomr_simulate([str(mission), "--out", str(bag), "--quiet"]) == 0
    pipeline = Pipeline(load_robot("reference"), DiagnosisSettings.of({}, "test"))
    changes = []
    with open_recording(bag) as recording:
        topics = find_topics(recording, pipeline.inputs)
        for topic, _, message, receive_ns in recording.messages(topics):
            seconds = 1e-9 * (receive_ns - recording.start_ns)
            if topics[topic] == "cmd_vel" and STOPPED[0] <= seconds < STOPPED[1]:
                linear = replace(message.twist.linear, x=0.3)
                message = replace(message, twist=replace(message.twist, linear=linear))
            for diagnosis in pipeline.take(topics[topic], message, receive_ns).diagnoses:
                if diagnosis.changed:
                    at_s = 1e-9 * (diagnosis.stamp_ns - recording.start_ns)
                    changes.append((at_s, diagnosis.state.name))
    states = [state for at_s, state in changes if at_s > STOPPED[0] - 0.5]
    quiet = "not observable in this motion"
    assert states == ["normal", "does not follow its commands", quiet]
    said, taken_back = (at_s for at_s, _ in changes[-2:])
    assert said - STOPPED[0] < 0.5
    assert taken_back - STOPPED[1] < 2.5
