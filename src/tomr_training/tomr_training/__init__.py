"""Training of the shipped network on simulated drives; needs torch, which the robot does not."""
