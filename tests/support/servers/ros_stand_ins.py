"""Stand-ins of what the ROS 2 example uses: rclpy and messages, which cannot be installed from PyPI."""

import types
from types import SimpleNamespace
from unittest.mock import MagicMock


class Message(SimpleNamespace):
    """A message of ROS: fields come into being when they are named."""

    def __getattr__(self, name: str) -> "Message":
        found = Message()
        setattr(self, name, found)
        return found


class PointField(Message):
    UINT8, FLOAT32 = 2, 7


class Fixate:
    Result = Feedback = Message


class Goal:
    """A goal of the action, as rclpy hands it to the server."""

    def __init__(self, x_px: float, y_px: float, *, cancelled: bool = False) -> None:
        self.request = SimpleNamespace(x_px=x_px, y_px=y_px)
        self.is_cancel_requested = cancelled
        self.feedback: list[Message] = []
        self.ended = ""

    def publish_feedback(self, message: Message) -> None:
        self.feedback.append(message)

    def succeed(self) -> None:
        self.ended = "succeeded"

    def abort(self) -> None:
        self.ended = "aborted"

    def canceled(self) -> None:
        self.ended = "canceled"


class Node:
    """A node of ROS that keeps what is published."""

    def __init__(self) -> None:
        self.published: dict[str, list[Message]] = {}
        self.timers_s: list[float] = []

    def create_publisher(self, _: type, topic: str, depth: int) -> SimpleNamespace:
        return SimpleNamespace(publish=self.published.setdefault(topic, []).append)

    def create_timer(self, period_s: float, callback: object, **_: object) -> None:
        self.timers_s.append(period_s)

    def get_parameter(self, name: str) -> SimpleNamespace:
        return SimpleNamespace(value={"rate_hz": 5.0}[name])

    def get_clock(self) -> MagicMock:
        return MagicMock()

    def get_logger(self) -> MagicMock:
        return MagicMock()


def modules() -> dict[str, types.ModuleType]:
    """Return the modules that the example imports."""
    contents: dict[str, dict[str, object]] = {
        "rclpy": {},
        "rclpy.action": {"ActionServer": MagicMock(), "CancelResponse": MagicMock()},
        "rclpy.callback_groups": {"MutuallyExclusiveCallbackGroup": MagicMock()},
        "rclpy.executors": {"MultiThreadedExecutor": MagicMock()},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"CompressedImage": Message, "PointCloud2": Message, "PointField": PointField},
        "foveacam_interfaces": {},
        "foveacam_interfaces.action": {"Fixate": Fixate},
    }
    found = {name: types.ModuleType(name) for name in contents}
    for name, module in found.items():
        vars(module).update(contents[name])
    return found
