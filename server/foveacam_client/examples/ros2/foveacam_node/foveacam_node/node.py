"""Publishes the views of a rig and its point clouds, and fixates by an action.

Topics: wide, left and right (sensor_msgs/CompressedImage), cloud (sensor_msgs/PointCloud2). Action: fixate
(foveacam_interfaces/Fixate). Parameters: url, token_file, rate_hz. Frames: `rig` is the wide camera's optical
frame (x right, y down, z forward).
"""

import math
import threading
from array import array
from typing import Any

import rclpy
from foveacam_interfaces.action import Fixate
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from sensor_msgs.msg import CompressedImage, PointCloud2, PointField

import foveacam_client
from foveacam_client import ClientError, JobCancelled, PointCloud, Rig, models

VIEWS = ("wide", "left", "right")
FRAME = "rig"
KINDS = {"uint8": PointField.UINT8, "float32": PointField.FLOAT32}

Ros = Any
"""Any: an object of ROS, which ships no type hints."""


class FoveacamNode:
    """One rig as a ROS 2 node."""

    def __init__(self, node: Ros, rig: Rig) -> None:
        self._node = node
        self._rig = rig
        self._images = {view: node.create_publisher(CompressedImage, view, 1) for view in VIEWS}
        self._clouds = node.create_publisher(PointCloud2, "cloud", 1)
        rate_hz = node.get_parameter("rate_hz").value
        views = MutuallyExclusiveCallbackGroup()  # views go on while a fixation waits
        node.create_timer(1.0 / rate_hz, self.publish_views, callback_group=views)
        self._action = ActionServer(
            node,
            Fixate,
            "fixate",
            execute_callback=self.fixate,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def publish_views(self) -> None:
        """Publish the newest picture of each view that has one."""
        for view, publisher in self._images.items():
            message = CompressedImage()
            try:
                message.data = array("B", self._rig.api.views.snapshot(view).read())
            except ClientError as error:
                self._node.get_logger().warning(f"{view}: {error}", throttle_duration_sec=10.0)
                continue
            message.format = "jpeg"
            message.header.frame_id = view
            message.header.stamp = self._node.get_clock().now().to_msg()
            publisher.publish(message)

    def publish_clouds(self) -> None:
        """Publish every new point cloud, of any client's fixation, until the connection is closed."""
        for event in self._rig.events(kinds=["cloud.created"]):
            self.publish_cloud(str(event.data["id"]))

    def publish_cloud(self, cloud_id: str) -> None:
        """Publish one point cloud."""
        try:
            cloud = PointCloud(self._rig.api.clouds.ply(cloud_id).read())
        except ClientError as error:
            self._node.get_logger().warning(f"{cloud_id}: {error}")
        else:
            self._clouds.publish(self._cloud_message(cloud))

    def fixate(self, goal: Ros) -> Ros:
        """Fixate a pixel and publish the progress."""
        request = models.FixationRequest(pixel=models.Pixel(x_px=goal.request.x_px, y_px=goal.request.y_px))
        result = Fixate.Result()
        try:
            started = self._rig.api.fixations.create(request)
            fixation = self._rig.wait(
                started, on_progress=lambda progress: self._publish_feedback(goal, progress, started.id)
            )
            self._fill(result, fixation)
            goal.succeed()
        except JobCancelled as error:
            result.problem = str(error)
            goal.canceled() if goal.is_cancel_requested else goal.abort()
        except ClientError as error:
            result.problem = str(error)
            goal.abort()
        return result

    def _publish_feedback(self, goal: Ros, progress: models.JobProgress, job_id: str) -> None:
        """Publish feedback; cancel the job when the goal is cancelled."""
        feedback = Fixate.Feedback()
        feedback.done, feedback.total = progress.done, progress.total
        feedback.left_s = math.nan if progress.eta_s is None else progress.eta_s
        goal.publish_feedback(feedback)
        if goal.is_cancel_requested:
            self._rig.api.jobs.cancel(job_id)

    def _fill(self, result: Ros, fixation: models.FixationDocument) -> None:
        nothing = (math.nan, math.nan, math.nan)
        result.distance_m = math.nan if fixation.distance_m is None else fixation.distance_m
        result.distance_sigma_m = math.nan if fixation.distance_sigma_m is None else fixation.distance_sigma_m
        point = result.point.point
        point.x, point.y, point.z = fixation.point_rig_m or nothing
        result.point.header.frame_id = FRAME
        result.point.header.stamp = self._node.get_clock().now().to_msg()
        result.basis = fixation.basis or ""

    def _cloud_message(self, cloud: PointCloud) -> Ros:
        """Return a point cloud as a ROS message with the unchanged vertices of the PLY file."""
        vertices = cloud.vertices
        message = PointCloud2()
        message.header.frame_id = FRAME
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.height, message.width = 1, len(vertices)
        message.fields = [
            PointField(name=name, offset=offset, datatype=KINDS[kind.name], count=1)
            for name, (kind, offset, *_) in dict(vertices.dtype.fields or {}).items()
        ]
        message.is_bigendian, message.is_dense = False, True
        message.point_step, message.row_step = vertices.dtype.itemsize, vertices.nbytes
        message.data = array("B", vertices.tobytes())
        return message


def main() -> None:
    """Run the node until it is interrupted."""
    rclpy.init()
    node = rclpy.create_node("foveacam")
    node.declare_parameter("url", "http://127.0.0.1:8000")
    node.declare_parameter("token_file", "")
    node.declare_parameter("rate_hz", 5.0)
    url, token_file = (node.get_parameter(name).value for name in ("url", "token_file"))
    executor = MultiThreadedExecutor()
    with foveacam_client.connect(url, token_file=token_file or None) as rig:
        shown = FoveacamNode(node, rig)
        threading.Thread(target=shown.publish_clouds, daemon=True).start()
        executor.add_node(node)
        try:
            executor.spin()
        except KeyboardInterrupt:
            pass
        finally:
            node.destroy_node()
            rclpy.try_shutdown()


if __name__ == "__main__":
    main()
