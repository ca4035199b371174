"""A bridge skeleton to ROS 2: /cmd_vel in, /odom and /diagnostics out. Start it where rclpy and canhelm-client are.

The max2d cannot steer while it rolls. For a yaw rate it drives an arc, its pairs at atan(rate * wheelbase / 2 / x).
At each new direction or arc it stops, steers, goes on: both in steps of 5 degrees. What it cannot is logged."""

from math import atan2, copysign, cos, degrees, hypot, radians, sin

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from canhelm import client, errors


def drive(twist: Twist) -> None:
    x, y, rate = twist.linear.x, twist.linear.y, twist.angular.z
    arc = atan2(copysign(rate, rate * x) * 0.225, abs(x))
    way = [5 * round(degrees(angle) / 5) for angle in (atan2(y, x), arc)]
    try:  # good for half a second: the robot comes to rest when /cmd_vel falls silent
        robot.call("drive.set", direction_deg=way[0], steering_deg=way[1], speed_m_s=hypot(x, y), valid_for_ms=500)
    except errors.CanhelmError as error:
        node.get_logger().warning(str(error))


rclpy.init()
robot, node, told, health = client.Client(), rclpy.create_node("canhelm"), Odometry(), DiagnosticStatus(name="canhelm")
odometry = node.create_publisher(Odometry, "odom", 10)
diagnostics = node.create_publisher(DiagnosticArray, "diagnostics", 10)
node.create_subscription(Twist, "cmd_vel", drive, 10)
while rclpy.ok():
    rclpy.spin_once(node, timeout_sec=0.05)
    status, told.header.stamp, told.header.frame_id = robot.status(), node.get_clock().now().to_msg(), "odom"
    place, pose = status["vehicle"]["odometry"], told.pose.pose
    pose.position.x, pose.position.y, yaw_rad = place["x_m"], place["y_m"], radians(place["yaw_deg"])
    pose.orientation.z, pose.orientation.w = sin(yaw_rad / 2), cos(yaw_rad / 2)
    odometry.publish(told)
    health.message, faulty = status["state"], status["state"] in ("fault", "estop")
    health.level = health.ERROR if faulty else health.OK
    diagnostics.publish(DiagnosticArray(status=[health]))
