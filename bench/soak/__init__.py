"""An hour with a simulated robot, its nodes and all that can happen to them: see soak.py."""
