"""The demo in the terminal: a live table, or plain lines where the output is no terminal."""

from collections.abc import Sequence
from typing import Protocol, Self

from attrs import define, frozen
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from tomr_demo.acts import Act
from tomr_demo.score import Named, Scoreboard, Stretch
from tomr_fault_diag.classifier.states import CONTROL, MOTOR, NORMAL, SLIP, STATES
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, TOTAL, ResidualFrame
from tomr_power_model.messages.plain import NANOSECONDS

PLAIN_WIDTH = 150  # of tables that go into a file
_EVIDENCE_LINES = 3
_LONGEST = 20  # columns of a state or an act
_WIDE = 110  # columns from which on the table has room for evidence
_STYLES = {
    STATES[NORMAL].name: "green",
    STATES[SLIP].name: "bright_blue",
    STATES[CONTROL].name: "magenta",
    **{state.name: "red" for state in STATES[MOTOR:]},
}
_VERDICTS = {True: ("PASS", "bold green"), False: ("FAIL", "bold red"), None: ("...", "dim")}
_CODES = {0: ("·", "dim"), 1: ("▲", "bold red"), -1: ("▼", "bold blue")}


@frozen
class Scene:
    """What there is to show at a moment."""

    acts: tuple[Act, ...]
    board: Scoreboard
    now_ns: int
    total: float  # s
    frame: ResidualFrame | None = None

    def seconds(self, stamp_ns: int) -> float:
        """A stamp [ns] as time since the truth was first published [s]."""
        start = self.board.stretches[0].start_ns if self.board.stretches else stamp_ns
        return max(0.0, (stamp_ns - start) / NANOSECONDS)


class View(Protocol):
    """A way to show the demo."""

    def starting(self, missing: str) -> None:
        """Say what is waited for."""

    def show(self, scene: Scene) -> None:
        """Show a moment of the play."""


def act_table(scene: Scene, width: int) -> Table:
    """One row per act: what was true, what was named, how late, verdict."""
    table = Table(expand=True, header_style="bold", border_style="dim")
    table.add_column("from", justify="right", no_wrap=True)
    table.add_column("true", min_width=_LONGEST)
    table.add_column("on /diagnostics", min_width=_LONGEST)
    table.add_column("p", justify="right", no_wrap=True)
    if width >= _WIDE:
        table.add_column("evidence when named", ratio=1, no_wrap=True, overflow="ellipsis")
    table.add_column("delay", justify="right", no_wrap=True)
    table.add_column("", justify="center", no_wrap=True, min_width=4)
    stretches = scene.board.stretches
    begin = 0.0
    for index in range(max(len(scene.acts), len(stretches))):
        if index < len(stretches):
            cells = _row(scene, stretches[index])
        else:
            cells = [Text(f"{begin:.1f} s"), Text(scene.acts[index].title), *[Text("")] * 5]
        if width < _WIDE:
            del cells[4]
        running = index == len(stretches) - 1 and stretches[index].end_ns is None
        style = "bold" if running else ("dim" if index >= len(stretches) else "")
        table.add_row(*cells, style=style)
        begin += scene.acts[index].duration if index < len(scene.acts) else 0.0
    return table


def _row(scene: Scene, stretch: Stretch) -> list[Text]:
    shown = _naming(stretch)
    share = "" if shown is None or shown.probability is None else f"{shown.probability:.2f}"
    state = state_text(shown)
    if stretch.strays:
        state.append(f" (also {', '.join(stretch.strays)})", style="yellow")
    delay = None if shown is stretch.before else stretch.delay_ns
    stated = shown.evidence if shown is not None and stretch.fault_id else ()
    evidence = "; ".join(line.partition(", band")[0] for line in stated)
    return [
        Text(f"{scene.seconds(stretch.start_ns):.1f} s"),
        Text(stretch.title),
        state,
        Text(share),
        Text(evidence, style="dim"),
        Text("" if delay is None else f"{delay / NANOSECONDS:.2f} s"),
        Text(*_VERDICTS[stretch.passed(scene.board.now_ns)]),
    ]


def _naming(stretch: Stretch) -> Named | None:
    """The diagnosis that a row shows: that which first named it, else the newest."""
    if stretch.right is not None:
        return stretch.right
    return stretch.named[-1] if stretch.named else stretch.before


def state_text(named: Named | None) -> Text:
    """A state in its colour."""
    if named is None:
        return Text("nothing yet", style="dim")
    return Text(named.state, style=_STYLES.get(named.state, "dim"))


def residual_text(frame: ResidualFrame | None) -> Text:
    """The ten residuals as arrows: above, within (a dot) or below their band."""
    if frame is None:
        return Text("none yet", style="dim")
    groups: tuple[tuple[str, Sequence[int]], ...] = (
        ("total", (TOTAL,)),
        ("power", MOTORS),
        ("speed", SPEEDS),
        ("power against encoders", ENCODERS),
    )
    text = Text()
    for label, places in groups:
        text.append(f"{label} ", style="dim")
        for place in places:
            residual = frame.residuals[place]
            text.append(*(("?", "yellow") if residual.stale else _CODES[residual.code]))
        text.append("   ")
    return text


def now_panel(scene: Scene) -> Panel:
    """What is going on right now."""
    stretches, latest = scene.board.stretches, scene.board.latest
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column()
    grid.add_row("true", stretches[-1].title if stretches else "")
    state = state_text(latest)
    if latest is not None and latest.probability is not None:
        state.append(f"   p {latest.probability:.2f}", style="default")
    grid.add_row("named", state)
    grid.add_row("residuals", residual_text(scene.frame))
    evidence = list(latest.evidence[:_EVIDENCE_LINES]) if latest is not None else []
    evidence += [""] * (_EVIDENCE_LINES - len(evidence))
    for index, line in enumerate(evidence):
        grid.add_row(
            "evidence" if index == 0 else "", Text(line, overflow="ellipsis", no_wrap=True)
        )
    elapsed = scene.seconds(scene.now_ns)
    bar = ProgressBar(total=scene.total, completed=min(elapsed, scene.total))
    title = f"{elapsed:.1f} s of {scene.total:.0f} s"
    return Panel(Group(grid, bar), title=title, title_align="left", border_style="dim")


@define
class LiveView:
    """A table that changes in place."""

    console: Console
    live: Live

    @classmethod
    def on(cls, console: Console) -> Self:
        """A view on a terminal."""
        return cls(console, Live(console=console, auto_refresh=False, transient=True))

    def __enter__(self) -> Self:
        self.live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.live.stop()

    def starting(self, missing: str) -> None:
        self.live.update(Spinner("dots", f"starting the nodes: {missing}"), refresh=True)

    def show(self, scene: Scene) -> None:
        parts: list[RenderableType] = [act_table(scene, self.console.width), now_panel(scene)]
        self.live.update(Group(*parts), refresh=True)


@define
class PlainView:
    """A line for everything that happens."""

    console: Console
    _missing: str = ""
    _shown: int = 0
    _state: str = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def starting(self, missing: str) -> None:
        if missing != self._missing:
            self._missing = missing
            self.console.print(f"starting the nodes: {missing}", style="dim", soft_wrap=True)

    def show(self, scene: Scene) -> None:
        stretches = scene.board.stretches
        for stretch in stretches[self._shown :]:
            self._line(scene, stretch.start_ns, f"true: {stretch.title}")
        self._shown = len(stretches)
        latest = scene.board.latest
        if latest is None or not stretches or latest.state == self._state:
            return
        self._state = latest.state
        share = "" if latest.probability is None else f", p {latest.probability:.2f}"
        delay = stretches[-1].delay_ns if latest is stretches[-1].right else None
        after = f", after {delay / NANOSECONDS:.2f} s" if delay else ""
        self._line(scene, latest.stamp_ns, f"/diagnostics: {latest.state}{share}{after}")
        for line in latest.evidence[:_EVIDENCE_LINES]:
            self.console.print(f"{'':15}{line}", highlight=False, soft_wrap=True)

    def _line(self, scene: Scene, stamp_ns: int, text: str) -> None:
        self.console.print(
            f"{scene.seconds(stamp_ns):8.2f} s  {text}", highlight=False, soft_wrap=True
        )


def view_on(console: Console) -> LiveView | PlainView:
    """The view that fits where the output goes."""
    return LiveView.on(console) if console.is_terminal else PlainView(console)


def make_console() -> Console:
    """A console of the terminal's width, or a fixed one for files and pipes."""
    console = Console()
    return console if console.is_terminal else Console(width=PLAIN_WIDTH)
