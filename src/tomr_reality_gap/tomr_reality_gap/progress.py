"""A bar that shows the stage and how far it is."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from shutil import get_terminal_size

from tqdm import tqdm

Progress = Callable[[str, float], None]  # stage, part of it that is done (0 to 1)

_FORMAT = "{desc:<20} {percentage:3.0f} % {bar} {elapsed}"


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """Progress on a terminal; nothing in a pipe or where quiet is asked for."""
    with tqdm(
        total=1.0,
        bar_format=_FORMAT,
        leave=False,
        delay=0.5,
        disable=True if quiet else None,
        ncols=get_terminal_size().columns - 1,  # some terminals say 0
    ) as bar:

        def show(stage: str, part: float) -> None:
            bar.set_description_str(stage, refresh=False)
            bar.update(part - bar.n)

        yield show
