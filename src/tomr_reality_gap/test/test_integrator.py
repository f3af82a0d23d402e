"""Which way the drivers sum their error, once what was left out is named."""

from pathlib import Path
from shutil import copytree

import pytest
from attrs import evolve

from tomr_power_model.estimation.parameter import per_wheel
from tomr_power_model.robot import read_description, shipped_robot
from tomr_reality_gap import explain
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.integrator import INTEGRATOR, summed_otherwise, sums_otherwise
from tomr_reality_gap.prepared import prepared
from tomr_reality_gap.progress import Progress
from tomr_reality_gap.request import Request

from .test_alignment import simulation  # noqa: F401 -- the fixture
from .test_forward_selection import searched

SQUARE = Path(__file__).parents[3] / "bags" / "square"
TRIED = ("body.payload", "parameter.controller.proportional")


@pytest.mark.parametrize("way", ["backward", "forward"])
def test_a_payload_does_not_pass_for_another_loop(
    simulation: RecordingSimulation,  # noqa: F811
    way: str,
) -> None:
    """The described way is found wrong, or right, beside a third of the mass more."""
    robot = simulation.robot
    controller = evolve(robot.controller, integrator=way)
    real = evolve(robot, mass=1.3 * robot.mass, controller=controller)
    dataset, found = searched(simulation, simulation.predict([real])[0], TRIED)
    assert "body.payload_mass" in {item.effect for item in found.best.model.hypotheses}
    assert sums_otherwise(dataset, found) is (way != robot.controller.integrator)


def test_there_are_two_ways() -> None:
    robot = shipped_robot("reference")
    base = per_wheel(dict(read_description("reference")), robot.wheel_names, "reference")
    other = summed_otherwise(base)
    assert {base.robot.controller.integrator, other.values[INTEGRATOR]} == {"forward", "backward"}
    assert summed_otherwise(other).robot == base.robot


@pytest.mark.parametrize("is_known", [False, True])
def test_the_way_is_asked_once_where_no_simulation_shows_it(
    is_known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def otherwise(*given: object) -> bool:
        asked.append(given)
        return True

    monkeypatch.setattr(explain, "sums_otherwise", otherwise)
    request = Request("reference", (SQUARE,))
    ready = prepared(request)
    silent: Progress = lambda stage, part: None  # noqa: E731
    monkeypatch.setattr(
        explain, "refined_at_itself", lambda data, best, *rest, tick: evolve(best, chi2=-1.0)
    )
    found = explain._analysed(request, ready, silent, is_loop_known=is_known)
    assert found.found.best.chi2 == -1.0
    expected = ready if is_known else ready.summed_otherwise()
    assert len(asked) == (not is_known)
    assert found.base == expected.base
    assert found.robot.controller.integrator == expected.base.values[INTEGRATOR]


@pytest.mark.parametrize("is_simulated", [False, True])
def test_a_simulation_of_the_user_shows_the_way(
    is_simulated: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Asked(Exception):
        """Nothing need be analysed."""

    def analysed(*given: object, is_loop_known: bool) -> None:
        raise Asked(is_loop_known)

    monkeypatch.setattr(explain, "_analysed", analysed)
    simulated = copytree(SQUARE, tmp_path / "simulated") if is_simulated else None
    with pytest.raises(Asked) as asked:
        explain.explain(Request("reference", (SQUARE,), sim=simulated))
    assert asked.value.args == (is_simulated,)


def test_a_gain_that_only_makes_up_for_the_way_does_not_count(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """Described the other way, a gain explains as much; without it the right way costs less."""
    robot = simulation.robot
    way = "forward" if robot.controller.integrator == "backward" else "backward"
    real = evolve(robot, controller=evolve(robot.controller, integrator=way))
    dataset, found = searched(simulation, simulation.predict([real])[0], TRIED[1:])
    assert [item.effect for item in found.best.model.hypotheses] == [TRIED[1]]
    assert sums_otherwise(dataset, found)
