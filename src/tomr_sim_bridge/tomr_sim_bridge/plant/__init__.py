"""The simulated robot: MuJoCo body, drivers, supply, sensors; no physics shared with the model."""
