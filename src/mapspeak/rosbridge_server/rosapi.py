"""The services of rosapi: what there is on the robot, in questions and answers."""

import contextlib
import json
from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Dialect, bare_type, write_stamp
from mapspeak.rosbridge_server.graph import ROSAPI_NODE, Service
from mapspeak.rosbridge_server.hub import ROSBRIDGE_NODE, Topic
from mapspeak.rosbridge_server.interfaces import ROS2_DISTRIBUTION, RosSystem
from mapspeak.rosbridge_server.parameters import Parameters

Values = dict[str, Any]
Answer = Callable[[Values], Values]
HIDDEN = "/_action/"


def add_rosapi(system: RosSystem, parameters: Parameters, clock: Callable[[], float]) -> None:
    """Add rosapi's services to those there are.

    Args:
        system: What they tell of, and where they are added.
        parameters: Its nodes'.
        clock: Gives robot time, in seconds.
    """
    questions = Questions(system, parameters, clock)
    package = "rosapi" if system.dialect is Dialect.ROS1 else "rosapi_msgs"
    for name, (last, answer) in _answers(questions, system.dialect).items():
        system.services.add(
            Service(
                name=f"/rosapi/{name}",
                type=f"{package}/{last}",
                node=ROSAPI_NODE,
                answer=_awaited(answer) if answer else None,
            )
        )


def _answers(questions: "Questions", dialect: Dialect) -> dict[str, tuple[str, Answer | None]]:
    """Return the services' names with their types and what answers them."""
    answers: dict[str, tuple[str, Answer | None]] = {
        "topics": ("Topics", questions.topics),
        "topics_for_type": ("TopicsForType", questions.topics_for_type),
        "topics_and_raw_types": ("TopicsAndRawTypes", questions.topics_and_raw_types),
        "topic_type": ("TopicType", questions.topic_type),
        "publishers": ("Publishers", questions.publishers),
        "subscribers": ("Subscribers", questions.subscribers),
        "nodes": ("Nodes", questions.nodes),
        "node_details": ("NodeDetails", questions.node_details),
        "services": ("Services", questions.services),
        "services_for_type": ("ServicesForType", questions.services_for_type),
        "service_type": ("ServiceType", questions.service_type),
        "service_node": ("ServiceNode", questions.service_node),
        "service_request_details": ("ServiceRequestDetails", questions.request_details),
        "service_response_details": ("ServiceResponseDetails", questions.response_details),
        "action_servers": ("GetActionServers", questions.action_servers),
        "get_time": ("GetTime", questions.get_time),
        "get_param": ("GetParam", questions.get_param),
        "set_param": ("SetParam", questions.set_param),
        "has_param": ("HasParam", questions.has_param),
        "delete_param": ("DeleteParam", questions.delete_param),
    }
    is_ros1 = dialect is Dialect.ROS1
    # On ROS 2 these two end or hang rosapi: nobody may count on an answer.
    answers["message_details"] = ("MessageDetails", questions.message_details if is_ros1 else None)
    answers["get_param_names"] = ("GetParamNames", questions.get_param_names if is_ros1 else None)
    if not is_ros1:
        answers["get_ros_version"] = ("GetROSVersion", questions.get_ros_version)
        answers["interfaces"] = ("Interfaces", questions.interfaces)
        answers["action_type"] = ("ActionType", questions.action_type)
        for part in ("Goal", "Result", "Feedback"):
            answer = partial(questions.action_details, part)
            answers[f"action_{part.lower()}_details"] = (f"Action{part}Details", answer)
    return answers


class Questions:
    """The answers, one method each; named as rosapi names its services."""

    def __init__(
        self, system: RosSystem, parameters: Parameters, clock: Callable[[], float]
    ) -> None:
        self._services = system.services
        self._hub = system.hub
        self._interfaces = system.interfaces
        self._dialect = system.dialect
        self._parameters = parameters
        self._clock = clock

    # --- topics ---

    def topics(self, _args: Values) -> Values:
        """All topics and their types."""
        shown = self._shown()
        return {
            "topics": [topic.name for topic in shown],
            "types": [self._interfaces.said(topic.type) for topic in shown],
        }

    def topics_for_type(self, args: Values) -> Values:
        """Return the topics of one type."""
        wanted = bare_type(_text(args, "type"))
        return {"topics": [topic.name for topic in self._shown() if topic.type == wanted]}

    def topics_and_raw_types(self, args: Values) -> Values:
        """All topics, with their types' full definitions."""
        shown = self._shown()
        texts = [
            self._interfaces.full_text(topic.type) if self._interfaces.knows(topic.type) else ""
            for topic in shown
        ]
        return {**self.topics(args), "typedefs_full_text": texts}

    def topic_type(self, args: Values) -> Values:
        """Return the type of one topic; empty for one that is not there."""
        topic = self._hub.find(_text(args, "topic"))
        return {"type": self._interfaces.said(topic.type) if topic else ""}

    def publishers(self, args: Values) -> Values:
        """Return the nodes that publish a topic."""
        topic = self._hub.find(_text(args, "topic"))
        return {"publishers": self._hub.publishers_of(topic) if topic else []}

    def subscribers(self, args: Values) -> Values:
        """Return the nodes that hear a topic."""
        topic = self._hub.find(_text(args, "topic"))
        return {"subscribers": self._hub.subscribers_of(topic) if topic else []}

    def message_details(self, args: Values) -> Values:
        """Return the fields of a type and of all types within."""
        name = _text(args, "type")
        if not self._interfaces.knows(name):
            raise LinkError(f"Unable to load the type {name}.", hint="Is its package installed?")
        return {"typedefs": self._interfaces.details(name)}

    # --- nodes ---

    def nodes(self, _args: Values) -> Values:
        """All nodes."""
        found = {ROSBRIDGE_NODE, *(service.node for service in self._services.all)}
        for topic in self._hub.topics:
            found.update(self._hub.publishers_of(topic), self._hub.subscribers_of(topic))
        return {"nodes": sorted(found)}

    def node_details(self, args: Values) -> Values:
        """Return what one node hears, publishes and offers."""
        node, topics = _text(args, "node"), self._shown()
        return {
            "subscribing": [each.name for each in topics if node in self._hub.subscribers_of(each)],
            "publishing": [each.name for each in topics if node in self._hub.publishers_of(each)],
            "services": [each.name for each in self._services.all if each.node == node],
        }

    # --- services and actions ---

    def services(self, _args: Values) -> Values:
        """All services."""
        return {"services": [each.name for each in self._services.all if HIDDEN not in each.name]}

    def services_for_type(self, args: Values) -> Values:
        """Return the services of one type."""
        wanted = bare_type(_text(args, "type"))
        return {"services": [each.name for each in self._services.all if each.type == wanted]}

    def service_type(self, args: Values) -> Values:
        """Return the type of one service; empty for one that is not there."""
        service = self._services.find(_text(args, "service"))
        return {"type": self._dialect.service_type_name(service.type) if service else ""}

    def service_node(self, args: Values) -> Values:
        """Return the node that offers a service."""
        service = self._services.find(_text(args, "service"))
        return {"node": service.node if service else ""}

    def request_details(self, args: Values) -> Values:
        """Return the fields that a service type is asked with."""
        return self.message_details({"type": f"{_text(args, 'type')}_Request"})

    def response_details(self, args: Values) -> Values:
        """Return the fields that a service type answers with."""
        return self.message_details({"type": f"{_text(args, 'type')}_Response"})

    def action_servers(self, _args: Values) -> Values:
        """Return the actions; on ROS 1 rosapi finds none, whatever there is."""
        hidden = [
            topic.name for topic in self._hub.topics if topic.name.endswith(f"{HIDDEN}feedback")
        ]
        return {"action_servers": [name.partition(HIDDEN)[0] for name in hidden]}

    def action_type(self, args: Values) -> Values:
        """Return the type of one action; empty for one that is not there."""
        feedback = self._hub.find(f"{_text(args, 'action')}{HIDDEN}feedback")
        name = self._interfaces.said(feedback.type) if feedback else ""
        return {"type": name.removesuffix("_FeedbackMessage")}

    def action_details(self, part: str, args: Values) -> Values:
        """Return the fields of an action type's goal, result or feedback."""
        return self.message_details({"type": f"{_text(args, 'type')}_{part}"})

    def interfaces(self, _args: Values) -> Values:
        """All types that are known."""
        return {"interfaces": self._interfaces.names}

    # --- time, version, parameters ---

    def get_time(self, _args: Values) -> Values:
        """Robot time."""
        return {"time": write_stamp(self._clock(), dialect=self._dialect)}

    def get_ros_version(self, _args: Values) -> Values:
        """Which ROS 2 it is."""
        return {"version": 2, "distro": ROS2_DISTRIBUTION}

    def get_param(self, args: Values) -> Values:
        """Return the value of a parameter as JSON; the default given for one that is not there."""
        value = self._parameters.find(_text(args, "name"))
        return {"value": str(args.get("default", "")) if value is None else json.dumps(value)}

    def set_param(self, args: Values) -> Values:
        """Keep a parameter; its value is JSON."""
        value = _text(args, "value")
        with contextlib.suppress(json.JSONDecodeError, RecursionError):
            value = json.loads(value)
        self._parameters.put(_text(args, "name"), value)
        return {}

    def has_param(self, args: Values) -> Values:
        """Whether a parameter is there."""
        return {"exists": self._parameters.find(_text(args, "name")) is not None}

    def delete_param(self, args: Values) -> Values:
        """Forget a parameter."""
        self._parameters.forget(_text(args, "name"))
        return {}

    def get_param_names(self, _args: Values) -> Values:
        """All parameters."""
        return {"names": self._parameters.names}

    def _shown(self) -> list[Topic]:
        return [topic for topic in self._hub.topics if HIDDEN not in topic.name]


def _text(args: Mapping[str, Any], name: str) -> str:
    value = args.get(name, "")
    if not isinstance(value, str):
        raise LinkError(
            f"Expected string in {name}, got {type(value).__name__}.", hint="See rosapi."
        )
    return value


def _awaited(answer: Answer) -> Callable[[Values], Awaitable[Values]]:
    async def reply(args: Values) -> Values:
        return answer(args)

    return reply
