"""The parameters of the robot's nodes: ROS 1 keeps them in one place, ROS 2 with each node."""

from collections.abc import Mapping
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server.graph import (
    BASE_FRAME,
    BASE_NODE,
    SLAM_NODES,
    Service,
    Services,
    navigator_of,
)
from mapspeak.rosbridge_server.interfaces import Interfaces

Values = dict[str, Any]
ROS1_DISTRIBUTION = "noetic\n"
NOT_SET = 0
COSTMAP_OF = {
    Dialect.ROS1: ("/move_base", "global_costmap/"),
    Dialect.ROS2: ("/global_costmap/global_costmap", ""),
}
KINDS: dict[type, tuple[int, str]] = {
    bool: (1, "bool_value"),
    int: (2, "integer_value"),
    float: (3, "double_value"),
    str: (4, "string_value"),
}
"""What rcl_interfaces/ParameterType calls each kind, and the field of ParameterValue it fills."""


class Parameters:
    """All parameters: what they hold can be read and set, and changes nothing on the robot.

    Args:
        dialect: Whose names are used: "/node/name" on ROS 1, "/node:name" on ROS 2.
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

    @classmethod
    def of_robot(cls, dialect: Dialect, *, radius_m: float) -> "Parameters":
        """Return those of a robot with SLAM and navigation."""
        frames = {"map_frame": "map", "odom_frame": "odom", "base_frame": BASE_FRAME}
        by_node: dict[str, Values] = {
            SLAM_NODES[dialect]: frames,
            navigator_of(dialect): {"global_frame": "map", "robot_base_frame": BASE_FRAME},
            BASE_NODE: {"robot_radius": radius_m},
        }
        costmap, prefix = COSTMAP_OF[dialect]
        by_node.setdefault(costmap, {})[f"{prefix}robot_radius"] = radius_m
        return cls(dialect, by_node)

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


def add_parameter_services(
    services: Services, parameters: Parameters, interfaces: Interfaces
) -> None:
    """Offer for each node what every node of ROS 2 offers about its parameters."""
    for node in parameters.nodes:
        of_node = ServedNodeParameters(node, parameters)
        answers = {
            "list_parameters": ("ListParameters", of_node.list_all),
            "get_parameters": ("GetParameters", of_node.get),
            "get_parameter_types": ("GetParameterTypes", of_node.get_types),
            "describe_parameters": ("DescribeParameters", of_node.describe),
            "set_parameters": ("SetParameters", of_node.set),
        }
        for name, (last, answer) in answers.items():
            service_type = f"rcl_interfaces/{last}"
            services.add(
                Service(
                    name=f"{node}/{name}",
                    type=service_type,
                    node=node,
                    answer=interfaces.filled(f"{service_type}_Request", answer),
                )
            )


class ServedNodeParameters:
    """The answers of one node, named after its services."""

    def __init__(self, node: str, parameters: Parameters) -> None:
        self._node = node
        self._parameters = parameters

    async def list_all(self, request: Values) -> Values:
        """Return the names, those that begin as asked for."""
        begins = tuple(request["prefixes"])
        names = self._parameters.of_node(self._node)
        found = [name for name in names if not begins or name.startswith(begins)]
        return {"result": {"names": found, "prefixes": []}}

    async def get(self, request: Values) -> Values:
        """Return the values; one that is not there is not set."""
        values = self._parameters.of_node(self._node)
        return {"values": [_written(values.get(name)) for name in request["names"]]}

    async def get_types(self, request: Values) -> Values:
        """Return the kinds."""
        values = self._parameters.of_node(self._node)
        return {"types": bytes(_kind_of(values.get(name)) for name in request["names"])}

    async def describe(self, request: Values) -> Values:
        """Return the kinds with their names."""
        values = self._parameters.of_node(self._node)
        descriptors = [
            {"name": name, "type": _kind_of(values.get(name)), "description": ""}
            for name in request["names"]
        ]
        return {"descriptors": descriptors}

    async def set(self, request: Values) -> Values:
        """Set values of the kind that they have."""
        return {"results": [self._set_one(each) for each in request["parameters"]]}

    def _set_one(self, parameter: Values) -> Values:
        name, known = parameter["name"], self._parameters.of_node(self._node)
        try:
            value = _read(parameter["value"])
        except LinkError as error:
            return {"successful": False, "reason": error.message}
        if name not in known:
            return {"successful": False, "reason": f"parameter '{name}' has not been declared"}
        if type(value) is not type(known[name]):
            return {"successful": False, "reason": f"parameter '{name}' is of another type"}
        self._parameters.put(f"{self._node}:{name}", value)
        return {"successful": True, "reason": ""}


def _kind_of(value: object) -> int:
    return KINDS[type(value)][0] if type(value) in KINDS else NOT_SET


def _written(value: object) -> Values:
    """Write rcl_interfaces/ParameterValue: one field is meant, the others are empty."""
    empty: Values = {field: kind() for kind, (_, field) in KINDS.items()}
    arrays = ("byte", "bool", "integer", "double", "string")
    empty |= {f"{each}_array_value": [] for each in arrays}
    filled = {KINDS[type(value)][1]: value} if type(value) in KINDS else {}
    return {"type": _kind_of(value), **empty, **filled}


def _read(message: Mapping[str, Any]) -> object:
    for number, field in KINDS.values():
        if message["type"] == number:
            return message[field]
    raise LinkError(f"A parameter of type {message['type']} is not known.", hint="Use 1 to 4.")
