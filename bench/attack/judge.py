"""Running a try in a process of its own, and what to say of how it ended."""

import contextlib
import gc
import io
import json
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from attrs import frozen
from tqdm import tqdm

from attack import live
from attack.case import Attack
from tomr_fault_diag.classifier.states import FAULTLESS, UNKNOWN
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot

LONGEST = 60.0  # s
MOST_MEMORY = 2_000_000  # kB
_ADDRESSES = 12 << 30  # bytes: what a try may ask for before the machine suffers
_MADE, _POLL = 99, 0.02
MODULES = {
    "tomr_diagnose": "tomr_fault_diag.cli.diagnose",
    "tomr_calibrate": "tomr_power_model.calibrate_cli",
    "tomr_gap": "tomr_reality_gap.cli",
    "tomr_simulate": "tomr_sim_bridge.cli.simulate",
    "tomr_import_robotino": "tomr_sim_bridge.cli.import_robotino",
    "tomr_commission": "tomr_commission.cli",
    "tomr_odometry": "tomr_odometry.cli",
    "tomr_train": "tomr_training.train",
}
FURTHER: dict[str, Callable[[Sequence[str]], int]] = {
    "parameters": live.set_parameters,
    "live view": live.serve_clients,
}  # no commands of their own
_NODES = (
    "tomr_sim_bridge.nodes.sim_bridge_node",
    "tomr_power_model.nodes.power_model_node",
    "tomr_fault_diag.nodes.diagnosis_node",
    "tomr_fault_diag.nodes.power_residuals_node",
    "tomr_fault_diag.nodes.fault_classifier_node",
)
_ANSWERS = (0, 1, 2, 3)  # 3: nothing could be decided
_UNFLUSHED = 120  # exit code of an interpreter that cannot flush its streams
_LISTINGS = frozenset({"--parameters", "--help"})  # options that end a command before it works
_QUIET = ("note:", "warning:", "error:", "usage:", "interrupted")


@frozen
class Outcome:
    """How a try ended; `problem` is empty where it did as promised."""

    code: int
    seconds: float
    cpu: float  # s, of the command and of making its input
    memory: int  # kB
    problem: str
    line: str  # the last on stderr


def load_tools(recording: Path) -> None:
    """Import what all tries need and compile what they share, once: they are forked."""
    for module in (*MODULES.values(), *_NODES, "tomr_view.server", "rclpy"):
        import_module(module)
    tqdm.monitor_interval = 0  # no thread that might hold a lock while this process forks
    given = str(recording)
    with contextlib.redirect_stdout(io.StringIO()):
        import_module(MODULES["tomr_diagnose"]).main([given, "--json"])
        import_module(MODULES["tomr_calibrate"]).main(
            [given, "--robot", "reference", "--fit", "robot.mass"]
        )
        import_module(MODULES["tomr_gap"]).main(
            ["check", "--robot", "reference", "--real", given, "--quiet"]
        )
    gc.collect()
    gc.freeze()  # a collection in a child would copy all that it shares with this process


def run(make: Callable[[], Attack], folder: Path) -> tuple[Attack | None, Outcome]:
    """Make a try and run it, in a child each."""
    making = time.process_time()
    given = make()
    making = time.process_time() - making
    begun = time.monotonic()
    child = os.fork()
    if child == 0:
        _be_the_command(given, folder)
    status, usage, hung = _wait(child, given, begun)
    seconds = time.monotonic() - begun
    code = os.waitstatus_to_exitcode(status)
    errors = (folder / "stderr").read_text("utf-8", "replace")
    output = (folder / "stdout").read_text("utf-8", "replace")
    memory = int(usage.ru_maxrss)
    problem = "hang" if hung else problem_of(given, code, errors, output)
    if not problem and memory > MOST_MEMORY:
        problem = "memory"
    last = errors.strip().rpartition("\n")[2][:300]
    cpu = making + usage.ru_utime + usage.ru_stime
    return given, Outcome(code, seconds, cpu, memory, problem, last)


def _wait(child: int, given: Attack, begun: float) -> tuple[int, Any, bool]:
    """The child's status and usage; it is killed when its time is over."""
    signalled = hung = False
    while True:
        found, status, usage = os.wait4(child, os.WNOHANG)
        if found:
            return status, usage, hung
        passed = time.monotonic() - begun
        if given.signal_after is not None and passed > given.signal_after and not signalled:
            os.kill(child, signal.SIGTERM)
            signalled = True
        if passed > LONGEST and not hung:
            os.kill(child, signal.SIGKILL)
            hung = True
        time.sleep(_POLL)


def _be_the_command(given: Attack, folder: Path) -> None:
    """Run the command as its process would, and end."""
    code = _MADE
    try:
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        for number, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(folder / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        # Of this process' own they would be buffered as its parent's are.
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
        sys.stderr = os.fdopen(2, "w", 1, encoding="utf-8", closefd=False)
        os.chdir(folder)
        os.environ.update(given.environment)
        resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES, _ADDRESSES))
        if given.largest_file is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (given.largest_file, given.largest_file))
        sys.argv = [given.tool, *given.arguments]
        main = FURTHER.get(given.tool) or import_module(MODULES[given.tool]).main
        code = int(main(list(given.arguments)))
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else _MADE
    except BaseException:  # noqa: BLE001 what the command would end with
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError:
                code = _UNFLUSHED  # as the interpreter ends
        os._exit(code & 0xFF)


def problem_of(given: Attack, code: int, errors: str, output: str) -> str:
    """What is wrong with how a try ended, empty if nothing."""
    # A full disk takes what is said as well.
    if "Traceback" in errors or code in (70, _MADE):
        return "traceback"
    if code < 0:
        return f"ended by signal {-code}"
    ended = given.largest_file is not None and code == 74
    ended = ended or (given.signal_after is not None and code == 143)
    if code not in _ANSWERS and not ended:
        return f"code {code}"
    half = _half(given.outputs)
    if half:
        return half
    lines = [line for line in errors.splitlines() if line.strip()]
    usage = any(line.startswith("usage:") for line in lines)
    strict = given.largest_file is None and given.tool != "tomr_import_robotino" and not usage
    said = sum(line.startswith("error:") for line in lines)
    several = given.tool == "tomr_diagnose" and said > 0  # a line for each recording
    if strict and code == 2 and said != 1 and not several:
        return "no line"
    if strict and any(not line.startswith(_QUIET) for line in lines):
        return "other lines"
    return _false_word(given, code, output)


def _half(outputs: tuple[Path, ...]) -> str:
    """What is wrong with the files that a command left."""
    for path in outputs:
        if path.is_dir():
            try:
                with open_recording(path) as recording:
                    for _ in recording.raw_messages():
                        pass
            except InputError as error:
                if "holds no messages" not in str(error):
                    return f"half a recording ({error})"[:200]
        elif path.suffix == ".html" and path.exists():
            text = path.read_text()
            if text != "old" and not text.rstrip().endswith("</html>"):
                return "half a page"
        elif path.exists() and path.read_text() != "old":
            try:
                load_robot(path)
            except InputError as error:
                return f"half a file ({error})"[:200]
    return ""


def _false_word(given: Attack, code: int, output: str) -> str:
    if given.tool == "tomr_gap" and code == 1 and given.names is not None and not given.names:
        return "false word: mismatch"
    if given.tool != "tomr_diagnose" or code not in (0, 1) or "--json" not in given.arguments:
        return ""
    if not _LISTINGS.isdisjoint(given.arguments):
        return ""
    try:
        found = json.loads(output)
    except ValueError:
        return "output is no JSON"
    done = found.get("recordings", [found])  # of a folder that holds several
    if code == 0 and not any(item["ticks"] for item in done):
        return "silence"
    if given.names is None or code == 0:
        return ""
    named = {name for item in done for name in item["shares"]}
    wrong = named - FAULTLESS - {UNKNOWN.name} - given.names
    return f"false word: {', '.join(sorted(wrong))}" if wrong else ""
