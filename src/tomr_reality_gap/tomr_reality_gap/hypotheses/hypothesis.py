"""One way in which reality may differ from a description."""

from collections.abc import Mapping

from attrs import field, frozen

from tomr_power_model.estimation.parameter import Parameter


@frozen
class Hypothesis:
    """One way in which reality may differ: an effect, or a wrong parameter, at a place."""

    effect: str  # of the vocabulary, or parameter.<key>
    where: tuple[str, ...]  # wheel names, or all_wheels, body, supply
    parameters: tuple[Parameter, ...]  # the first is the size
    start: Mapping[str, float] = field(kw_only=True, factory=dict)  # values that it brings along
    log_prior: float = field(kw_only=True, default=0.0)
    # Smallest size that data sampled like these can show.
    least: float = field(kw_only=True, default=0.0)
    stands_for: tuple[str, ...] = field(kw_only=True, default=())  # whose work it does alone

    @property
    def name(self) -> str:
        """E.g. `friction.viscous at wheel_1_joint`."""
        return f"{self.effect} at {', '.join(self.where)}"

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """Parameters that show where the effect has no size yet."""
        return tuple(item for item in self.parameters if not item.is_shape)

    @property
    def key(self) -> tuple[object, ...]:
        """What distinguishes it from others of its name: the shape that it starts from."""
        return (self.name, *self.start.items())
