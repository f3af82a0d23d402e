"""The reality-gap tool on MuJoCo robots in which physics is concealed: see docs/concealed.md."""

import sys

from concealed.cli import main  # the package beside this file

from tomr_power_model.cli import run_main

if __name__ == "__main__":
    sys.exit(run_main(main))
