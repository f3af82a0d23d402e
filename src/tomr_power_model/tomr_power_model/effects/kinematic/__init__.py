"""Effects of the vocabulary: kinematic."""
