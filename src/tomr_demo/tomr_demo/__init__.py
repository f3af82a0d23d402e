"""`tomr_demo`: the robot drives, faults come and go, the suite names them while you watch."""
