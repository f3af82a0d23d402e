"""tomr_gap beside a plain refit and sparse regression: see docs/others.md."""

import sys

from others.cli import main  # the package beside this file

from tomr_power_model.cli import run_main

if __name__ == "__main__":
    sys.exit(run_main(main))
