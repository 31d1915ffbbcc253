"""The services of rosapi: answers about the robot's graph, by the name of the service."""

import contextlib
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Dialect, bare_type, write_stamp
from mapspeak.rosbridge_server.hub import ROSBRIDGE_NODE, Topic
from mapspeak.rosbridge_server.interfaces import ROS2_DISTRIBUTION, RosSystem, Service, Values
from mapspeak.rosbridge_server.parameters import Parameters

Answers = dict[str, Callable[[Values], Values]]
ROSAPI_NODE = "/rosapi"
HIDDEN = "/_action/"
OTHER_TYPES = {"action_servers": "GetActionServers", "get_ros_version": "GetROSVersion"}
"""Services whose type is not called as they are."""
NEVER_ANSWERED_ON_ROS2 = ("message_details", "get_param_names")
"""On ROS 2 these end or hang rosapi: clients must not count on an answer."""


def add_rosapi(system: RosSystem, parameters: Parameters, clock: Callable[[], float]) -> None:
    """Add rosapi's services to those there are; the clock gives robot time in seconds."""
    answers = (
        _about_topics(system)
        | _about_nodes_and_services(system)
        | _about_types(system)
        | _about_parameters(parameters)
    )
    answers["get_time"] = lambda _: {"time": write_stamp(clock(), dialect=system.dialect)}
    package = "rosapi"
    silent: tuple[str, ...] = ()
    if system.dialect is Dialect.ROS2:
        package, silent = "rosapi_msgs", NEVER_ANSWERED_ON_ROS2
        answers |= _only_on_ros2(system)
    for name, answer in answers.items():
        last = OTHER_TYPES.get(name) or name.title().replace("_", "")
        system.offer(
            f"/rosapi/{name}",
            f"{package}/{last}",
            node=ROSAPI_NODE,
            answer=None if name in silent else answer,
        )


def _about_topics(system: RosSystem) -> Answers:
    hub, interfaces = system.hub, system.interfaces

    def find(args: Values) -> Topic | None:
        return hub.find(_text(args, "topic"))

    def list_all(_args: Values) -> Values:
        shown = _shown(system)
        return {
            "topics": [topic.name for topic in shown],
            "types": [interfaces.said(topic.type) for topic in shown],
        }

    def list_with_texts(args: Values) -> Values:
        texts = [
            interfaces.full_text(topic.type) if interfaces.knows(topic.type) else ""
            for topic in _shown(system)
        ]
        return {**list_all(args), "typedefs_full_text": texts}

    return {
        "topics": list_all,
        "topics_for_type": lambda args: {"topics": _names_of_type(args, _shown(system))},
        "topics_and_raw_types": list_with_texts,
        "topic_type": lambda args: {
            "type": interfaces.said(topic.type) if (topic := find(args)) else ""
        },
        "publishers": lambda args: {
            "publishers": hub.publishers_of(topic) if (topic := find(args)) else []
        },
        "subscribers": lambda args: {
            "subscribers": hub.subscribers_of(topic) if (topic := find(args)) else []
        },
    }


def _about_nodes_and_services(system: RosSystem) -> Answers:
    hub = system.hub

    def list_nodes(_args: Values) -> Values:
        found = {ROSBRIDGE_NODE, *(service.node for service in system.services)}
        for topic in hub.topics:
            found.update(hub.publishers_of(topic), hub.subscribers_of(topic))
        return {"nodes": sorted(found)}

    def describe_node(args: Values) -> Values:
        node, topics = _text(args, "node"), _shown(system)
        return {
            "subscribing": [each.name for each in topics if node in hub.subscribers_of(each)],
            "publishing": [each.name for each in topics if node in hub.publishers_of(each)],
            "services": [each.name for each in system.services if each.node == node],
        }

    def find(args: Values) -> Service | None:
        return system.find_service(_text(args, "service"))

    return {
        "nodes": list_nodes,
        "node_details": describe_node,
        "services": lambda _: {
            "services": [each.name for each in system.services if HIDDEN not in each.name]
        },
        "services_for_type": lambda args: {"services": _names_of_type(args, system.services)},
        "service_type": lambda args: {
            "type": system.dialect.type_name(found.type, "srv") if (found := find(args)) else ""
        },
        "service_node": lambda args: {"node": found.node if (found := find(args)) else ""},
        # On ROS 1 rosapi finds none, whatever there is.
        "action_servers": lambda _: {
            "action_servers": [
                topic.name.partition(HIDDEN)[0]
                for topic in hub.topics
                if topic.name.endswith(f"{HIDDEN}feedback")
            ]
        },
    }


def _about_types(system: RosSystem) -> Answers:
    def describe(args: Values, part: str = "") -> Values:
        name = _text(args, "type") + part
        if not system.interfaces.knows(name):
            raise LinkError(f"Unable to load the type {name}.", hint="Is its package installed?")
        return {"typedefs": system.interfaces.details(name)}

    answers: Answers = {
        "message_details": describe,
        "service_request_details": lambda args: describe(args, "_Request"),
        "service_response_details": lambda args: describe(args, "_Response"),
    }
    if system.dialect is Dialect.ROS2:
        answers |= {
            "action_goal_details": lambda args: describe(args, "_Goal"),
            "action_result_details": lambda args: describe(args, "_Result"),
            "action_feedback_details": lambda args: describe(args, "_Feedback"),
        }
    return answers


def _only_on_ros2(system: RosSystem) -> Answers:
    def find_action_type(args: Values) -> Values:
        feedback = system.hub.find(f"{_text(args, 'action')}{HIDDEN}feedback")
        name = system.interfaces.said(feedback.type) if feedback else ""
        return {"type": name.removesuffix("_FeedbackMessage")}

    return {
        "get_ros_version": lambda _: {"version": 2, "distro": ROS2_DISTRIBUTION},
        "interfaces": lambda _: {"interfaces": system.interfaces.names},
        "action_type": find_action_type,
    }


def _about_parameters(parameters: Parameters) -> Answers:
    def get(args: Values) -> Values:
        value = parameters.find(_text(args, "name"))
        return {"value": str(args.get("default", "")) if value is None else json.dumps(value)}

    def put(args: Values) -> Values:
        value = _text(args, "value")
        with contextlib.suppress(json.JSONDecodeError, RecursionError):
            value = json.loads(value)
        parameters.put(_text(args, "name"), value)
        return {}

    def forget(args: Values) -> Values:
        parameters.forget(_text(args, "name"))
        return {}

    return {
        "get_param": get,
        "set_param": put,
        "has_param": lambda args: {"exists": parameters.find(_text(args, "name")) is not None},
        "delete_param": forget,
        "get_param_names": lambda _: {"names": parameters.names},
    }


def _shown(system: RosSystem) -> list[Topic]:
    return [topic for topic in system.hub.topics if HIDDEN not in topic.name]


def _names_of_type(args: Values, known: Sequence[Topic | Service]) -> list[str]:
    wanted = bare_type(_text(args, "type"))
    return [each.name for each in known if each.type == wanted]


def _text(args: Mapping[str, Any], name: str) -> str:
    value = args.get(name, "")
    if not isinstance(value, str):
        raise LinkError(
            f"Expected string in {name}, got {type(value).__name__}.", hint="See rosapi."
        )
    return value
