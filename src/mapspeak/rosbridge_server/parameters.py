"""The parameters of the robot's nodes: ROS 1 keeps them in one place, ROS 2 with each node."""

from collections.abc import Mapping

from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.parameters import FIELD_OF_KIND, KIND_OF, NOT_SET
from mapspeak.rosbridge_server.interfaces import Answer, Interfaces, RosSystem, Values

ROS1_DISTRIBUTION = "noetic\n"


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
