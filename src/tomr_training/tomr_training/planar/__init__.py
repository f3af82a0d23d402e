"""A fast planar model of many robots at once: drives to train on, by the thousand."""
