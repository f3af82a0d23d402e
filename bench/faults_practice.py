"""The suite judged on a robot of an independent plant, with and without faults.

bench/faults_practice.py --help says how.
"""

import sys

from faults.cli import main  # the package beside this file

from tomr_power_model.cli import run_main

if __name__ == "__main__":
    sys.exit(run_main(main))
