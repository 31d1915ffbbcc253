"""The parameters of a ROS 2 node, by the services that every node offers for them."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import bytes_of

FIELD_OF_KIND = {
    1: "bool_value",
    2: "integer_value",
    3: "double_value",
    4: "string_value",
    5: "byte_array_value",
    6: "bool_array_value",
    7: "integer_array_value",
    8: "double_array_value",
    9: "string_array_value",
}
"""By rcl_interfaces/ParameterType, the field of ParameterValue that holds the value; 0 is unset."""
NOT_SET = 0
KIND_OF: dict[type, int] = {bool: 1, int: 2, float: 3, str: 4}
DOUBLE, DOUBLE_ARRAY, ARRAY_SHIFT = 3, 8, 5


class ParameterServices(ABC):
    """The part of the port about parameters, as nodes of ROS 2 serve them."""

    @abstractmethod
    async def call_service(
        self,
        service: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        type_name: str | None = None,
        timeout_s: float | None = None,
    ) -> dict[str, Any]:
        """Return the answer of a service.

        Where no type is given it is looked up; where no limit is, the usual one is taken.
        """

    async def fetch_parameter_names(self, node: str) -> tuple[str, ...]:
        """Return the names of a node's parameters; ROS 1 keeps them below the node's name."""
        answer = await self._ask(node, "list_parameters", "ListParameters", {"depth": 0})
        names = _part(answer.get("result"), "names", node)
        return tuple(sorted(str(name) for name in names))

    async def fetch_parameter(self, node: str, name: str) -> Any:  # noqa: ANN401 - any value ROS has
        """Return the value of a node's parameter; None where it is not set."""
        answer = await self._ask(node, "get_parameters", "GetParameters", {"names": [name]})
        values = _part(answer, "values", node)
        value = values[0] if len(values) else {}
        field = FIELD_OF_KIND.get(value.get("type", 0)) if isinstance(value, dict) else None
        found = None if field is None else value.get(field)
        if isinstance(found, bytes):
            return list(found)
        return found.tolist() if isinstance(found, np.ndarray) else found

    async def set_parameter(self, node: str, name: str, value: Any) -> None:  # noqa: ANN401
        """Set a node's parameter; convert a whole number to a double where the node keeps doubles.

        None deletes it, which a node allows only for what it has not declared.

        Raises:
            LinkError: The node refuses it, and says why.
        """
        written: dict[str, Any] = {"type": NOT_SET}
        if value is not None:
            asked = {"names": [name]}
            answer = await self._ask(node, "get_parameter_types", "GetParameterTypes", asked)
            written = _write(
                value, wanted=(bytes_of(answer.get("types") or b"", "types") or b"\0")[0]
            )
        parameters = {"parameters": [{"name": name, "value": written}]}
        answer = await self._ask(node, "set_parameters", "SetParameters", parameters)
        for result in _part(answer, "results", node):
            if isinstance(result, dict) and not result.get("successful", False):
                raise _refused(node, name, value, result.get("reason"))

    async def _ask(
        self, node: str, service: str, type_name: str, arguments: Mapping[str, Any]
    ) -> dict[str, Any]:
        return await self.call_service(
            f"{node}/{service}", arguments, type_name=f"rcl_interfaces/srv/{type_name}"
        )


def _refused(node: str, name: str, value: object, said: object) -> LinkError:
    reason = str(said or "it gives no reason").rstrip(". ") + "."
    if value is None:
        return LinkError(
            f"{node} does not delete {name}: {reason}",
            hint="A parameter that a node has declared can only be set.",
        )
    return LinkError(
        f"{node} refuses {name} = {str(value)[:80]}: {reason}",
        hint="Read the parameter and its type first; give a value of that type.",
    )


def _part(answer: Any, key: str, node: str) -> Any:  # noqa: ANN401 - ROS JSON enters here
    part = answer.get(key) if isinstance(answer, Mapping) else None
    if part is None or isinstance(part, str) or not hasattr(part, "__len__"):
        raise LinkError(
            f"{node} answers without {key}.", hint="Ask for the list of nodes: it may have ended."
        )
    return part


def _write(value: Any, *, wanted: int) -> dict[str, Any]:  # noqa: ANN401 - any value ROS has
    """Return a rcl_interfaces/ParameterValue."""
    kind = _kind_of(value)
    if (kind, wanted) == (KIND_OF[int], DOUBLE):
        kind, value = DOUBLE, float(value)
    if (kind, wanted) == (KIND_OF[int] + ARRAY_SHIFT, DOUBLE_ARRAY):
        kind, value = DOUBLE_ARRAY, [float(part) for part in value]
    return {"type": kind, FIELD_OF_KIND[kind]: value}


def _kind_of(value: Any) -> int:  # noqa: ANN401 - any value ROS has
    if type(value) in KIND_OF:
        return KIND_OF[type(value)]
    if isinstance(value, list) and value and len({type(part) for part in value}) == 1:
        return _kind_of(value[0]) + ARRAY_SHIFT
    raise LinkError(
        f"{str(value)[:80]!r} is no value of a parameter.",
        hint="Give true or false, a number, a text, or a list of one of these kinds.",
    )
