"""Parameters by the services of their node."""

from typing import Any

import rclpy
from rcl_interfaces.srv import GetParameters, SetParameters

PATIENCE_S = 5.0


def call_get_parameters(*, node: Any, node_name: str, parameter_names: list[str]) -> Any:  # noqa: ANN401
    request = GetParameters.Request(names=parameter_names)
    return _call(node, GetParameters, f"{node_name}/get_parameters", request)


def call_set_parameters(*, node: Any, node_name: str, parameters: list[Any]) -> Any:  # noqa: ANN401
    request = SetParameters.Request(parameters=parameters)
    return _call(node, SetParameters, f"{node_name}/set_parameters", request)


def _call(node: Any, kind: type, name: str, request: Any) -> Any:  # noqa: ANN401
    client = node.create_client(kind, name)
    try:
        if not client.wait_for_service(timeout_sec=PATIENCE_S):
            raise RuntimeError(f"there is no service {name}")
        future = client.call_async(request)
        rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE_S)
        return future.result()
    finally:
        node.destroy_client(client)
