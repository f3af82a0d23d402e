"""Effects of the vocabulary: sensor."""
