"""The diagnosis to look at, in a browser: live, or of a recording."""
