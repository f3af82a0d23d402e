"""The drive to record for a commissioning: a mission file, and what to see to."""

from tomr_power_model.effects.base import Phase
from tomr_power_model.effects.missions import PAUSE, move, spin
from tomr_power_model.files import plain_yaml
from tomr_power_model.robot import Robot

_GOLDEN = 137.508  # degrees: headings that never repeat
_MOVES = 36
_DURATIONS = (1.5, 2.5, 4.0)  # s
_SHARES = (1.0, 0.3, 0.6, 0.15)  # of the top speed, in turn

INSTRUCTIONS = """\
Record cmd_vel, joint_states, battery_state and the wheels' power (imu/data if there is one) while
the robot drives this, twice, on each floor that counts, warm and cold, in some square metres of
free space with a hand at the e-stop:
  tomr_simulate {out} --robot {robot} --out rehearsal    # what it will look like
then
  tomr_commission DRIVE1 DRIVE2 ... --robot {robot} --out commissioned"""


def mission_text(robot: Robot, top_speed: float) -> str:
    """A mission of about three minutes: headings, speeds, spins, starts, stops and rest.

    Args:
        robot: that is to drive it.
        top_speed: of the body [m/s].
    """
    rate = min(top_speed / robot.robot_radius, 1.5)
    phases: list[Phase] = [{"pause": 5.0}]
    for k in range(_MOVES):
        speed = top_speed * _SHARES[k % len(_SHARES)]
        phases.append(move(round(_GOLDEN * k, 1), round(speed, 3), _DURATIONS[k % 3]))
        if k % 3 == 2:
            phases.append(spin(round(rate * (-1.0) ** (k // 3) * _SHARES[k % 4], 3), 2.0))
        if k % 4 == 3:
            phases.append(PAUSE)
    phases.append({"pause": 10.0})
    mission = {
        "name": "commissioning",
        "description": "Headings, speeds, spins, starts, stops and rest.",
        "phases": phases,
    }
    return plain_yaml(mission)
