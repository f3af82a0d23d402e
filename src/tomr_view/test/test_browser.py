"""The page in a real browser, without a window, steered by its debugging protocol."""

import json
import shutil
import subprocess
import urllib.request
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from tomr_view.recording import introduction, pictures_of
from tomr_view.server import Server

BAG = Path(__file__).parents[3] / "bags" / "circle_encoder_lost"
BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
OPTIONS = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"]
TIMEOUT = 60.0  # s

pytestmark = pytest.mark.skipif(BROWSER is None, reason="no chromium on this machine")


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    robot, pictures = pictures_of(BAG, "reference")
    server = Server(introduction(robot, pictures, BAG.name), pictures)
    server.start("127.0.0.1", 0)
    yield server.address
    server.close()


@pytest.fixture
def evaluate(
    address: str, tmp_path: Path, wait_until: Callable[..., Any]
) -> Iterator[Callable[[str], Any]]:
    """`evaluate(script)`: its value in the page, opened at 12.3 s."""
    options = ["--remote-debugging-port=0", f"--user-data-dir={tmp_path}"]
    browser = subprocess.Popen(
        [str(BROWSER), *OPTIONS, *options, f"{address}#t=12.3"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        port_file = tmp_path / "DevToolsActivePort"
        wait_until(lambda: port_file.exists() and port_file.read_text(), "the browser", TIMEOUT)
        place = f"http://127.0.0.1:{port_file.read_text().split()[0]}/json/list"

        def page() -> str | None:
            with urllib.request.urlopen(place, timeout=TIMEOUT) as answer:
                found = [item for item in json.load(answer) if item["url"].startswith(address)]
            return found[0]["webSocketDebuggerUrl"] if found else None

        with connect(wait_until(page, "the page", TIMEOUT), max_size=None) as socket:
            numbers = count(1)

            def run(script: str) -> Any:
                number = next(numbers)
                wish = {"expression": script, "returnByValue": True}
                call = {"id": number, "method": "Runtime.evaluate", "params": wish}
                socket.send(json.dumps(call))
                while (answer := json.loads(socket.recv(TIMEOUT))).get("id") != number:
                    pass
                assert "exceptionDetails" not in answer["result"], answer
                return answer["result"]["result"].get("value")

            yield run
    finally:
        browser.terminate()
        browser.wait(TIMEOUT)


def test_a_recording_is_shown_and_scrubbed(
    evaluate: Callable[[str], Any], wait_until: Callable[..., Any]
) -> None:
    def drawn(time: float) -> bool:
        # Set when all has been drawn without an error.
        shown = evaluate("document.body?.dataset.t")
        return shown is not None and abs(float(shown) - time) < 0.11

    def text(name: str) -> str:
        return str(evaluate(f"document.getElementById('{name}').textContent"))

    wait_until(lambda: drawn(12.3), "the moment asked for by the address", TIMEOUT)
    assert text("state") == "motor system fault 3 (wheel_3_joint)"
    assert evaluate("document.getElementById('state').dataset.level") == "2"
    assert "wheel_3 power: " in text("evidence")
    assert text("severity").startswith("wheel speed shown -")
    assert "of 21.9 s" in text("moment")
    assert text("link") == ""
    assert evaluate("document.getElementById('faults').hidden") is True
    evaluate("{ const s = document.getElementById('scrub'); s.value = 30; s.oninput(); }")
    wait_until(lambda: drawn(3.0), "the moment scrubbed to", TIMEOUT)
    assert text("state").startswith("normal")
    evaluate("document.getElementById('play').click()")
    wait_until(lambda: drawn(4.0), "a second played", TIMEOUT)
