"""The demo on stage: wait until all nodes work, drive, bring the faults, keep the score."""

import contextlib
import time
from collections.abc import Mapping, Sequence
from typing import Any

from tomr_demo.acts import STOP, Act
from tomr_demo.director_node import Director
from tomr_demo.processes import Children, DemoFailure
from tomr_demo.score import (
    DIAGNOSTICS,
    NORMAL_STATE,
    Named,
    Scoreboard,
    named_in,
)
from tomr_demo.topics import OWN, Topic
from tomr_demo.view import Scene, View
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_fault_diag.residuals.messages import frame_of
from tomr_power_model.errors import InputError
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot.parameters import Value

START_TIMEOUT = 60.0  # s until every node works; a cold disk takes its time
ANSWER_TIMEOUT = 10.0  # s
STALL_TIMEOUT = 10.0  # s without a tick of /clock
VIEW_PERIOD = 0.2  # s
_PUBLISHERS = {DIAGNOSTICS: 3}  # that belong here, where there are several: all three stages
LAST_WORDS = 0.3  # s of data until the last decisions have come


class Play:
    """Directs the demo and watches over its processes."""

    def __init__(
        self,
        topics: Mapping[str, Topic],
        children: Children,
        view: View,
        signals: Sequence[int],
    ) -> None:
        """`signals`: a list in which signals to this process turn up."""
        self.board = Scoreboard()
        self._topics = topics
        self._children = children
        self._view = view
        self._signals = signals
        self._named: Named | None = None
        self._frame: ResidualFrame | None = None
        self._acts: tuple[Act, ...] = ()
        self._total = 0.0
        self._shown = 0.0
        self._ticked = (0, 0.0)
        self._director = Director(topics, self._take)

    def close(self) -> None:
        """Leave the graph."""
        self._director.close()

    def wait_until_ready(self) -> None:
        """Wait until every topic is alive and the state is normal.

        Raises DemoFailure if that takes too long, InputError if another robot is about.
        """
        end = time.monotonic() + START_TIMEOUT
        while (missing := self._missing()) is not None:
            self._view.starting(missing[1])
            if time.monotonic() > end:
                raise DemoFailure(self._not_ready(*missing))
            self._check_alone()
            self._turn()
        self._check_alone()

    def perform(self, acts: Sequence[Act], recording: RecordingWriter) -> None:
        """Play the acts and record; the score is in `board`."""
        director = self._director
        self._acts = tuple(acts)
        self._total = sum(act.duration for act in acts) + STOP
        if self._named is not None:
            self.board.diagnosis(self._named)
        director.recording = recording
        director.drive()
        try:
            for act in acts:
                if act.fault_id is not None:
                    self._set(act.begin)
                self._run(act.duration)
                if act.fault_id is not None:
                    self._set(act.end)
            director.halt()
            self._run(STOP)
            self._run(LAST_WORDS)
        finally:
            director.recording = None
        self.board.close()
        self._show()

    def drive_on(self) -> None:
        """Drive until a signal comes: faults are up to whoever watches."""
        self._acts = ()
        self._director.drive()
        with contextlib.suppress(KeyboardInterrupt):
            while True:
                self._turn()

    def scene(self) -> Scene:
        """What there is to show now."""
        return Scene(
            acts=self._acts,
            board=self.board,
            now_ns=max(self.board.now_ns, self._ticked[0]),
            total=self._total,
            frame=self._frame,
        )

    def _missing(self) -> tuple[str, str] | None:
        """The first process that does not do all it should, and what is missing; None: all well."""
        for name, topic in self._topics.items():
            if topic.process != OWN and not self._director.heard[name]:
                return topic.process, f"no {name} from {topic.process} yet"
        if not self._director.is_bridge_ready:
            return "sim_bridge", "no parameter service of sim_bridge yet"
        if self._named is None or self._named.state != NORMAL_STATE:
            state = "nothing" if self._named is None else self._named.state
            return "fault_classifier", f"the robot at rest is not yet called normal, but {state}"
        return None

    def _check_alone(self) -> None:
        for topic in self._topics:
            if self._director.count_publishers(topic) > _PUBLISHERS.get(topic, 1):
                raise InputError(
                    f"another process publishes {topic} in this domain: choose a domain of its "
                    "own for the demo, e.g. ROS_DOMAIN_ID=31"
                )

    def _not_ready(self, process: str, missing: str) -> str:
        return (
            f"not within {START_TIMEOUT:g} s: {missing}\n{self._children.named(process).report()}"
        )

    def _run(self, seconds: float) -> None:
        """Let the simulation's time pass."""
        end = self._director.now_ns + round(seconds * NANOSECONDS)
        while self._director.now_ns < end:
            self._turn()

    def _set(self, values: Mapping[str, Value]) -> None:
        """Set parameters of sim_bridge and wait until they are."""
        answer = self._director.request(values)
        end = time.monotonic() + ANSWER_TIMEOUT
        while not answer.done():
            if time.monotonic() > end:
                raise DemoFailure(f"sim_bridge has not set {dict(values)} in {ANSWER_TIMEOUT:g} s")
            self._turn()
        result = answer.result().result
        if not result.successful:
            raise DemoFailure(f"sim_bridge refused {dict(values)}: {result.reason}")

    def _turn(self) -> None:
        """Serve messages for a moment and look after everything else."""
        self._director.spin()
        if self._signals:
            raise KeyboardInterrupt
        self._children.check()
        wall, now = time.monotonic(), self._director.now_ns
        if now != self._ticked[0]:
            self._ticked = (now, wall)
        elif now and wall - self._ticked[1] > STALL_TIMEOUT:
            raise DemoFailure(
                f"/clock has stood still for {STALL_TIMEOUT:g} s\n"
                + self._children.named("sim_bridge").report()
            )
        if self._acts and wall - self._shown > VIEW_PERIOD:
            self._shown = wall
            self._show()

    def _show(self) -> None:
        self._view.show(self.scene())

    def _take(self, topic: str, message: Any, stamp_ns: int) -> None:
        if topic == DIAGNOSTICS:
            self._named = named_in(message, stamp_ns) or self._named
        if topic == "/residuals":
            self._frame = frame_of(message, stamp_ns)
        elif self._director.recording is not None:
            self.board.take(topic, message, stamp_ns)
