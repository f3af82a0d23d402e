"""Effects of the vocabulary: drivetrain."""
