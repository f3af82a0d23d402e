"""What a floor does to the odometry, learnt from drives with a known pose."""
