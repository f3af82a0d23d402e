"""What every effect of the vocabulary must state, and its laws worked by hand."""

import math

import pytest
from effect_samples import LARGE, MODERATE, SCALES

from tomr_power_model.effects import EFFECTS, Effect, Wheel

WHEEL = Wheel(speed=2.0, load=50.0, transmitted=-0.4, angle=0.5, radius=0.05, gear_ratio=20.0)
BACK = WHEEL._replace(speed=-2.0)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_an_effect_states_all_of_itself(effect: type[Effect]) -> None:
    assert effect.__doc__
    assert effect.label[0].isupper()
    assert effect.mission
    for name, parameter in effect.parameters.items():
        for value in (parameter.neutral, parameter.start, parameter.default):
            assert value is None or parameter.minimum <= value <= parameter.maximum, name
        assert parameter.prior_std > 0.0
    if effect.prior is not None:
        assert all(size(SCALES) > 0.0 for size in effect.prior.sizes.values())
        for shape in effect.prior.shapes(SCALES):
            assert {*effect.prior.sizes, *shape} <= set(effect.parameters)


def test_every_effect_is_among_the_samples() -> None:
    assert set(MODERATE) == set(EFFECTS)
    assert set(LARGE) == {name for name in EFFECTS if not name.startswith("sensor.")}


def test_labels_distinguish_effects() -> None:
    assert len({effect.label for effect in EFFECTS.values()}) == len(EFFECTS)


@pytest.mark.parametrize(
    ("effect_id", "law", "arguments", "expected"),
    [
        ("friction.coulomb", "dry_torque", (0.06, WHEEL), 0.06),
        ("friction.stribeck", "dry_torque", (0.1, 2.0, WHEEL), 0.1 / math.e),
        ("friction.asymmetric", "dry_torque", (0.02, WHEEL), 0.02),
        ("friction.asymmetric", "dry_torque", (0.02, BACK), -0.02),
        ("friction.load_dependent", "dry_torque", (0.1, WHEEL), 0.04),
        ("friction.quadratic", "moving_torque", (0.01, WHEEL), 0.04),
        ("friction.quadratic", "moving_torque", (0.01, BACK), -0.04),
        ("contact.rolling_resistance", "dry_torque", (0.01, WHEEL), 0.025),
        ("drivetrain.torque_ripple", "moving_torque", (0.1, 3.0, 0.2, WHEEL), 0.1 * math.sin(1.7)),
        ("electrical.iron_loss", "dry_torque", (0.003, 0.0, WHEEL), 0.06),
        ("electrical.driver_standby", "driver_power", (1.2, 3.0), 1.2),
        ("electrical.switching_loss", "driver_power", (0.5, -3.0), 1.5),
        ("electrical.regeneration_loss", "supplied", (0.4, -10.0), -4.0),
        ("electrical.regeneration_loss", "supplied", (0.4, 10.0), 10.0),
    ],
)
def test_laws(effect_id: str, law: str, arguments: tuple[object, ...], expected: float) -> None:
    assert getattr(EFFECTS[effect_id], law)(*arguments) == pytest.approx(expected)


def test_a_ripple_without_an_angle_is_left_out() -> None:
    law = EFFECTS["drivetrain.torque_ripple"].moving_torque
    assert law(0.1, 3.0, 0.2, WHEEL._replace(angle=math.nan)) == 0.0
