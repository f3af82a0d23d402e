"""What of commissioning needs ROS."""
