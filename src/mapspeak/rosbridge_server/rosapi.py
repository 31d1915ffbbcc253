"""The services of rosapi: the robot's graph and the parameters of its nodes."""

import contextlib
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Dialect, bare_type, write_stamp
from mapspeak.ros.parameters import FIELD_OF_KIND, KIND_OF, NOT_SET
from mapspeak.rosbridge_server.hub import ROSBRIDGE_NODE, Topic
from mapspeak.rosbridge_server.interfaces import (
    ROS2_DISTRIBUTION,
    Answer,
    Interfaces,
    RosSystem,
    Service,
    Values,
)

ROS1_DISTRIBUTION = "noetic\n"
Answers = dict[str, Callable[[Values], Values]]
ROSAPI_NODE = "/rosapi"
HIDDEN = "/_action/"
OTHER_TYPES = {"action_servers": "GetActionServers", "get_ros_version": "GetROSVersion"}
"""Services whose type is not called as they are."""
NEVER_ANSWERED_ON_ROS2 = ("message_details", "get_param_names")
"""On ROS 2 these end or hang rosapi: clients must not count on an answer."""


class Parameters:
    """All parameters: their values can be read and set, without an effect on the robot.

    Args:
        dialect: The form of their names: "/node/name" on ROS 1, "/node:name" on ROS 2.
        by_node: Values by the names of nodes and their own.
    """

    def __init__(self, dialect: Dialect, by_node: Mapping[str, Values]) -> None:
        self._mark = "/" if dialect is Dialect.ROS1 else ":"
        self._values: Values = {}
        for node, values in by_node.items():
            for name, value in values.items():
                self.put(f"{node}{self._mark}{name}", value)
            if dialect is Dialect.ROS2:
                self.put(f"{node}:use_sim_time", value=True)
        if dialect is Dialect.ROS1:
            self._values |= {"/use_sim_time": True, "/rosdistro": ROS1_DISTRIBUTION}

    @property
    def names(self) -> list[str]:
        """All full names."""
        return sorted(self._values)

    @property
    def nodes(self) -> list[str]:
        """The nodes that have any."""
        return sorted({name.rpartition(self._mark)[0] for name in self._values} - {""})

    def find(self, name: str) -> object | None:
        """Find a value by its full name; a leading slash may be missing."""
        return self._values.get(f"/{name.lstrip('/')}")

    def put(self, name: str, value: object) -> None:
        """Set a value by its full name."""
        self._values[f"/{name.lstrip('/')}"] = value

    def forget(self, name: str) -> None:
        """Remove a value, if it is there."""
        self._values.pop(f"/{name.lstrip('/')}", None)

    def of_node(self, node: str) -> Values:
        """Return one node's parameters by their short names."""
        begin = f"{node}{self._mark}"
        return {
            name.removeprefix(begin): value
            for name, value in sorted(self._values.items())
            if name.startswith(begin)
        }


def add_parameter_services(system: RosSystem, parameters: Parameters) -> None:
    """Offer for each node the parameter services of every ROS 2 node."""
    for node in parameters.nodes:
        for name, answer in _answers_of(node, parameters, system.interfaces).items():
            last = name.title().replace("_", "")
            system.offer_typed(f"{node}/{name}", f"rcl_interfaces/{last}", node=node, answer=answer)


def _answers_of(node: str, parameters: Parameters, interfaces: Interfaces) -> dict[str, Answer]:
    def find_all(request: Values) -> list[tuple[str, object]]:
        values = parameters.of_node(node)
        return [(name, values.get(name)) for name in request["names"]]

    def list_names(request: Values) -> Values:
        begins = tuple(request["prefixes"])
        names = parameters.of_node(node)
        found = [name for name in names if not begins or name.startswith(begins)]
        return {"result": {"names": found, "prefixes": []}}

    def describe(request: Values) -> Values:
        descriptors = [
            {"name": name, "type": _kind_of(value), "description": ""}
            for name, value in find_all(request)
        ]
        return {"descriptors": descriptors}

    def write(value: object) -> Values:
        kind = _kind_of(value)
        filled = {FIELD_OF_KIND[kind]: value} if kind else {}
        return interfaces.fill("rcl_interfaces/ParameterValue", {"type": kind, **filled})

    def set_one(parameter: Values) -> Values:
        name, given, known = parameter["name"], parameter["value"], parameters.of_node(node)
        value = given.get(FIELD_OF_KIND.get(given["type"]))
        reason = ""
        if name not in known:
            reason = f"parameter '{name}' has not been declared"
        elif type(value) is not type(known[name]):
            reason = f"parameter '{name}' is of another type"
        else:
            parameters.put(f"{node}:{name}", value)
        return {"successful": not reason, "reason": reason}

    return {
        "list_parameters": list_names,
        "get_parameters": lambda request: {"values": [write(v) for _, v in find_all(request)]},
        "get_parameter_types": lambda request: {
            "types": bytes(_kind_of(value) for _, value in find_all(request))
        },
        "describe_parameters": describe,
        "set_parameters": lambda request: {
            "results": [set_one(each) for each in request["parameters"]]
        },
    }


def _kind_of(value: object) -> int:
    return KIND_OF.get(type(value), NOT_SET)


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
