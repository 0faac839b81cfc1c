"""The city as ROS 2 sees it: a part that speaks rmw_zenoh's wire format, without ROS."""
