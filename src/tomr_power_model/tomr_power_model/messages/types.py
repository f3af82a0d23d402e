"""Names of the message types that the suite reads and publishes."""

TWIST_STAMPED = "geometry_msgs/msg/TwistStamped"
TWIST = "geometry_msgs/msg/Twist"
# By the parameter cmd_vel_type; auto begins with the one that Jazzy's controllers take.
TWIST_TYPES = {"auto": TWIST_STAMPED, "twist_stamped": TWIST_STAMPED, "twist": TWIST}
JOINT_STATE = "sensor_msgs/msg/JointState"
BATTERY = "sensor_msgs/msg/BatteryState"
IMU = "sensor_msgs/msg/Imu"
MULTI_ARRAY = "std_msgs/msg/Float64MultiArray"
ODOMETRY = "nav_msgs/msg/Odometry"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
TF = "tf2_msgs/msg/TFMessage"
TEXT = "std_msgs/msg/String"
