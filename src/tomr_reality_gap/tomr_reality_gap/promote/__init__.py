"""From a law that was learnt to an effect of the vocabulary: a Python file and its test."""
