"""Effects of the vocabulary: electrical."""
