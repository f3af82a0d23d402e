"""What of the view knows ROS."""
