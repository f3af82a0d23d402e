"""A simulated three-wheeled omni robot with faults to try on it, and players of recordings."""
