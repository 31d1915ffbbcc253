import pytest

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

from mapspeak.links.dds.endpoints import (
    dds_topic,
    dds_type,
    reply_topic,
    request_topic,
    ros_type,
    service_of,
    topic_of,
)
from mapspeak.links.endpoints import is_hidden, whole_type


def test_a_topic_and_its_type_are_named_as_ros_names_them_in_dds() -> None:
    assert dds_topic("/robot1/map") == "rt/robot1/map"
    assert dds_type("nav_msgs/msg/OccupancyGrid") == "nav_msgs::msg::dds_::OccupancyGrid_"
    assert dds_type("nav_msgs/OccupancyGrid") == "nav_msgs::msg::dds_::OccupancyGrid_"


def test_a_service_has_a_topic_for_requests_and_one_for_answers() -> None:
    assert request_topic("/robot/get_state") == "rq/robot/get_stateRequest"
    assert reply_topic("/robot/get_state") == "rr/robot/get_stateReply"
    assert (
        dds_type("lifecycle_msgs/srv/GetState_Response")
        == "lifecycle_msgs::srv::dds_::GetState_Response_"
    )


@pytest.mark.parametrize("name", ["/map", "/robot1/navigate_to_pose/_action/status"])
def test_a_topic_is_found_by_its_name_in_dds(name: str) -> None:
    assert topic_of(dds_topic(name)) == name


def test_what_is_no_topic_and_no_service_of_ros_is_nothing() -> None:
    assert topic_of("ros_discovery_info") is None
    assert service_of("rt/map") is None
    assert ros_type("DDS::String") is None
    assert ros_type("HelloWorld") is None


def test_types_are_read_from_those_of_their_parts() -> None:
    assert ros_type("std_srvs::srv::dds_::SetBool_Response_") == "std_srvs/srv/SetBool_Response"
    assert whole_type("std_srvs/srv/SetBool_Response") == "std_srvs/srv/SetBool"
    action = "nav2_msgs/action/NavigateToPose"
    for part in ("SendGoal_Response", "GetResult_Request", "FeedbackMessage"):
        assert whole_type(f"{action}_{part}") == action


def test_the_parts_of_actions_are_hidden() -> None:
    assert is_hidden("/navigate_to_pose/_action/send_goal")
    assert not is_hidden("/map_server/load_map")
