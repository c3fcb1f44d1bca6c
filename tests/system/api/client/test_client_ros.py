"""The client's ROS 2 example, on the simulated rig and a stand-in of ROS 2."""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import foveacam_client
from foveacam_client import Rig
from tests.support.servers.ros_stand_ins import Goal, Node, modules
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]

PACKAGE = Path(foveacam_client.__file__).parent / "examples" / "ros2" / "foveacam_node" / "foveacam_node"


@pytest.fixture(scope="module")
def client_rig(api_server: Running) -> Iterator[Rig]:
    with foveacam_client.connect(f"http://127.0.0.1:{api_server.port}") as found:
        yield found


@pytest.fixture
def ros_node(
    client_rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> tuple[Any, Node]:  # Any: the example's class
    for name, module in modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("ros_example", PACKAGE / "node.py")
    assert spec is not None
    assert spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    node = Node()
    return example.FoveacamNode(node, client_rig), node


def test_the_node_of_ros_publishes_views_and_clouds(ros_node: tuple[Any, Node], client_rig: Rig) -> None:
    shown, node = ros_node
    fixation = client_rig.fixate(720, 540)
    cloud = client_rig.cloud(fixation)

    shown.publish_views()
    shown.publish_cloud(client_rig.api.fixations.get(fixation.id).cloud_id)

    assert node.timers_s == [0.2]
    for view in ("wide", "left", "right"):
        (image,) = node.published[view]
        assert (image.format, image.header.frame_id) == ("jpeg", view)
        assert bytes(image.data).startswith(b"\xff\xd8")
    (message,) = node.published["cloud"]
    assert (message.height, message.width, message.row_step) == (
        1,
        len(cloud.vertices),
        cloud.vertices.nbytes,
    )
    assert [(field.name, field.offset, field.datatype) for field in message.fields][:4] == [
        ("x", 0, 7),
        ("y", 4, 7),
        ("z", 8, 7),
        ("red", 12, 2),
    ]
    assert bytes(message.data) == cloud.vertices.tobytes()


def test_the_node_of_ros_fixates_by_an_action(ros_node: tuple[Any, Node]) -> None:
    goal = Goal(720.0, 540.0)

    result = ros_node[0].fixate(goal)

    assert goal.ended == "succeeded"
    assert result.basis == "both_foveae"
    assert 0.0 < result.distance_sigma_m < result.distance_m
    assert goal.feedback[-1].total >= goal.feedback[-1].done


def test_the_node_of_ros_says_why_it_cannot(ros_node: tuple[Any, Node], client_rig: Rig) -> None:
    client_rig.api.stop.engage()
    goal = Goal(720.0, 540.0)

    result = ros_node[0].fixate(goal)
    client_rig.api.stop.release()

    assert goal.ended == "aborted"
    assert "stop" in result.problem


def test_a_cancelled_goal_of_ros_cancels_the_job(ros_node: tuple[Any, Node], client_rig: Rig) -> None:
    goal = Goal(720.0, 540.0, cancelled=True)

    ros_node[0].fixate(goal)

    assert goal.ended in ("canceled", "succeeded")  # it may have ended before the order came
    assert client_rig.api.jobs.list(limit=1)[0].state in ("cancelled", "succeeded")
