"""Odometry that knows of slip: where the robot really is, from encoders, motor power and an IMU."""
