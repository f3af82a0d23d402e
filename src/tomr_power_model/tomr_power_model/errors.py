"""Errors that a user can mend."""

_MOST = 1500  # characters of a line


class InputError(ValueError):
    """Bad input: one line that names the value, the place and the remedy."""


def one_line(text: object) -> str:
    """A text as one line that a terminal or a log can show, shortened in its middle.

    What an error quotes may hold line breaks, control characters or a megabyte.
    """
    line = " ".join(str(text).split())
    if len(line) > _MOST:
        line = f"{line[: _MOST // 2]} ... {line[-_MOST // 2 :]}"
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in line)


def counted(number: int, noun: str) -> str:
    """So many of something, as 1 message or 3 messages."""
    return f"{number:,} {noun}" + ("" if number == 1 else "s")
