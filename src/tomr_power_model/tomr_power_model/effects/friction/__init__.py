"""Effects of the vocabulary: friction."""
