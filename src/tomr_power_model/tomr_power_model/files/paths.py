"""Where a path leads."""

import os
from pathlib import Path


def real_path(path: Path) -> Path:
    """The absolute path without links, as far as they lead.

    `Path.resolve` raises a RuntimeError for links that lead in a circle (Python up to 3.12).
    """
    return Path(os.path.realpath(path))
