"""What the page of tomr_view costs, and how many of its pictures come late.

bench/page.py --seconds 600
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib.resources import as_file, files
from itertools import pairwise
from pathlib import Path

from processes import command_path, cpu_seconds, resident_mb, running
from websockets.sync.client import connect

from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError

LATE = 0.2  # s after the picture before; they come every 0.1 s
_START_TIMEOUT = 30.0  # s


def _address(log: Path) -> str:
    end = time.monotonic() + _START_TIMEOUT
    while time.monotonic() < end:
        _, found, rest = log.read_text(errors="replace").partition("watch at http://")
        if found:
            return rest.split("/")[0]
        time.sleep(0.1)
    raise InputError("tomr_view does not say where it is; run it by hand to see why")


def _bench(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="default: %(default)s")
    options = parser.parse_args(arguments)
    described = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")
    with tempfile.TemporaryDirectory() as name, as_file(described) as file:
        logs, ros = Path(name), ["--ros-args", "--params-file", str(file)]
        commands = {
            "sim_bridge": [str(command_path("sim_bridge")), *ros],
            "tomr_diagnosis": [str(command_path("tomr_diagnosis")), *ros],
            "tomr_view": [str(command_path("tomr_view")), "--port", "0"],
        }
        with running(commands, logs) as processes:
            view = processes["tomr_view"].pid
            with connect(f"ws://{_address(logs / 'tomr_view.log')}/socket", max_size=None) as page:
                while json.loads(page.recv(_START_TIMEOUT))["kind"] != "picture":
                    pass
                begin, before, heard = time.monotonic(), cpu_seconds(view), [time.monotonic()]
                while heard[-1] - begin < options.seconds:
                    page.recv(_START_TIMEOUT)
                    heard.append(time.monotonic())
                cpu = (cpu_seconds(view) - before) / (heard[-1] - begin)
                late = sum(later - earlier > LATE for earlier, later in pairwise(heard))
                print(
                    f"{len(heard) - 1} pictures in {heard[-1] - begin:.0f} s, {late} late "
                    f"({late / (len(heard) - 1):.2%}); {cpu:.3f} of a core, "
                    f"{resident_mb(view):.0f} MB"
                )
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_bench))
