"""The one way in which YAML is read: plain values, within limits, every error with its line."""

from typing import Any

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode

from tomr_power_model.errors import InputError
from tomr_power_model.limits import limits, too_large

_LONGEST_NUMBER = 400  # characters: as many as a finite float can have

# What PyYAML's constructors raise for `!!int abc`, `!!bool x`, `!!timestamp x` and the like.
_MALFORMED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader that bounds nesting and size, aliases written out, before it builds."""

    def __init__(self, text: str, place: str) -> None:
        super().__init__(text)
        self._place = place
        self._depth = 0
        self._values = 0
        self._sizes: dict[int, int] = {}  # of finished nodes, by identity

    def compose_node(self, parent: Node | None, index: Any) -> Node | None:
        if self.check_event(yaml.AliasEvent):
            node = super().compose_node(parent, index)
            if id(node) not in self._sizes:
                mark = node.start_mark if node is not None else None
                raise yaml.composer.ComposerError(None, None, "an alias in what it names", mark)
            self._count(self._sizes[id(node)])
            return node
        self._depth += 1
        if self._depth > limits().yaml_depth:
            too_large(self._place, "nested too deeply", "yaml_depth")
        before = self._values
        self._count(1)
        node = super().compose_node(parent, index)
        self._depth -= 1
        self._sizes[id(node)] = self._values - before
        return node

    def _count(self, more: int) -> None:
        self._values += more
        if self._values > limits().yaml_values:
            too_large(self._place, "too many values", "yaml_values")

    def construct_object(self, node: Node, deep: bool = False) -> Any:
        if isinstance(node, ScalarNode) and node.tag in _NUMBERS:
            self._check_length(node)
        try:
            return super().construct_object(node, deep=deep)
        except _MALFORMED as error:
            if isinstance(error, InputError):
                raise
            kind = str(node.tag).rpartition(":")[2]
            raise yaml.constructor.ConstructorError(
                None, None, f"no {kind}", node.start_mark
            ) from None

    def _check_length(self, node: ScalarNode) -> None:
        if len(node.value) > _LONGEST_NUMBER:
            raise yaml.constructor.ConstructorError(
                None, None, f"a number of {len(node.value)} characters", node.start_mark
            )

    def construct_mapping(self, node: MappingNode, deep: bool = False) -> dict[Any, Any]:
        if isinstance(node, MappingNode):
            self._reject_repeated(node)
        return super().construct_mapping(node, deep=deep)

    def _reject_repeated(self, node: MappingNode) -> None:
        seen: set[tuple[str, str]] = set()
        for key, _ in node.value:
            if not isinstance(key, ScalarNode) or key.tag == "tag:yaml.org,2002:merge":
                continue
            if (key.tag, key.value) in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"{key.value!r} stands twice", key.start_mark
                )
            seen.add((key.tag, key.value))


def load_yaml(text: str, place: str) -> Any:
    """The document of a YAML text: numbers, texts, dates, lists and mappings, nothing else.

    Raises:
        InputError: no YAML, a value that is none of its tag, a key that stands twice, or more than
            the limits allow; names `place`, the line and the problem.
    """
    try:
        loader = _Loader(text, place)
        try:
            return loader.get_single_data()
        finally:
            loader.dispose()
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f" line {mark.line + 1}:" if mark is not None else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "not YAML"
        raise InputError(f"{place}:{line} {problem}: mend the YAML") from None


def plain_yaml(document: object) -> str:
    """Text of a document, in order; what occurs again in it is written out again."""
    return str(yaml.dump(document, Dumper=_Plain, sort_keys=False, default_flow_style=None))


class _Plain(yaml.SafeDumper):
    def ignore_aliases(self, data: object) -> bool:
        return True
