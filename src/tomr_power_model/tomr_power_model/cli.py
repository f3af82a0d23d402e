"""What all commands share: exit codes and the form of an error."""

import sys
from collections.abc import Callable, Sequence

from tomr_power_model.errors import InputError

EXIT_OK = 0
EXIT_MISMATCH = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


def run_main(
    main: Callable[[Sequence[str] | None], int], arguments: Sequence[str] | None = None
) -> int:
    """Run a command's body and turn bad input into one line on stderr and exit code 2."""
    try:
        return main(arguments)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        # The reader of a pipe (`| head`) left: not an error of ours.
        sys.stderr.close()
        return EXIT_OK
