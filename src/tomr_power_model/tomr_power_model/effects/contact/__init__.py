"""Effects of the vocabulary: contact."""
