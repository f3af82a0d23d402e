"""ROS nodes of the simulator; the only place, with the launch files, that imports rclpy."""
