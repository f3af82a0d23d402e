"""The page in a real browser, without a window."""

import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tomr_view.recording import introduction, pictures_of
from tomr_view.server import Server

BAG = Path(__file__).parents[3] / "bags" / "circle_encoder_lost"
BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
OPTIONS = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"]
TIME = 5000  # ms of the page's own clock

pytestmark = pytest.mark.skipif(BROWSER is None, reason="no chromium on this machine")


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    robot, pictures = pictures_of(BAG, "reference")
    server = Server(introduction(robot, pictures, BAG.name), pictures)
    server.start("127.0.0.1", 0)
    yield server.address
    server.close()


@pytest.fixture
def browse(address: str, tmp_path: Path) -> Callable[[str], str]:
    """`browse("#t=1")`: the page as it stands after a while, as HTML."""

    def dump(place: str) -> str:
        found = subprocess.run(
            [
                str(BROWSER),
                *OPTIONS,
                f"--user-data-dir={tmp_path}",
                f"--virtual-time-budget={TIME}",
                "--dump-dom",
                address + place,
            ],
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
        )
        return found.stdout

    return dump


def test_a_moment_of_a_recording_is_shown(browse: Callable[[str], str]) -> None:
    page = browse("#t=12.3")
    state = re.search(r'<output id="state" data-level="(\d)">(.*?)</output>', page)
    assert state is not None
    assert state.groups() == ("2", "motor system fault 3 (wheel_3_joint)")
    assert re.search(r'data-t="12\.[23]\d*"', page)  # all was drawn without an error
    assert re.search(r"<li>wheel_3 power: .* above the modelled", page)
    assert "12.3 of 21.9 s" in page
    assert "connection lost" not in page
