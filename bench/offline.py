"""`offline.py MODE BAG`: CPU time of one pass over a recording, apart from the process's start.

MODE: `diagnose` runs tomr_diagnose; `all` and `read` merely deserialise with rosbags, all topics
or those that tomr_diagnose reads. Prints one JSON object with times in seconds.
"""

import io
import json
import sys
import time
from contextlib import redirect_stdout
from pathlib import Path

from rosbags.highlevel import AnyReader

from tomr_fault_diag.cli.diagnose import main as tomr_diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.robot import shipped_robot


def _diagnose(bag: Path) -> int:
    printed = io.StringIO()
    with redirect_stdout(printed):
        tomr_diagnose([str(bag), "--json"])
    return int(json.loads(printed.getvalue())["ticks"])


def _all(bag: Path) -> int:
    return _deserialise(bag, None)


def _read(bag: Path) -> int:
    pipeline = Pipeline(shipped_robot("reference"), DiagnosisSettings.of({}, "benchmark"))
    return _deserialise(bag, {f"/{item.topic}" for item in pipeline.inputs})


def _deserialise(bag: Path, topics: set[str] | None) -> int:
    count = 0
    with AnyReader([bag], default_typestore=jazzy_typestore()) as reader:
        wanted = [c for c in reader.connections if topics is None or c.topic in topics]
        for connection, _, data in reader.messages(wanted):
            reader.deserialize(data, connection.msgtype)
            count += 1
    return count


MODES = {"diagnose": _diagnose, "all": _all, "read": _read}


def main(mode: str, bag: Path) -> None:
    """One pass, timed."""
    startup = time.process_time()
    wall = time.perf_counter()
    count = MODES[mode](bag)
    times = {
        "cpu_s": time.process_time() - startup,
        "wall_s": time.perf_counter() - wall,
        "startup_cpu_s": startup,
        "count": count,
    }
    print(json.dumps(times))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
