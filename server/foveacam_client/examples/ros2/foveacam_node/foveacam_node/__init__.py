"""The ROS 2 node of a FoveaCam Duo rig."""
