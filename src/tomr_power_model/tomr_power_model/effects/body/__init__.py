"""Effects of the vocabulary: body."""
