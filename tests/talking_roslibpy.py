"""A program that uses a rosbridge through roslibpy, unchanged, and prints what it saw as JSON.

A program of its own, because roslibpy's reactor cannot be started twice.
Usage: talking_roslibpy.py PORT 1|2
"""

import json
import sys
import threading
from typing import Any

import roslibpy  # type: ignore[import-untyped]

PATIENCE_S = 60.0


def fetch_once(ros: Any, topic: str, message_type: str) -> dict[str, Any]:  # noqa: ANN401
    came, messages = threading.Event(), []

    def keep(message: dict[str, Any]) -> None:
        messages.append(message)
        came.set()

    subscription = roslibpy.Topic(ros, topic, message_type)
    subscription.subscribe(keep)
    assert came.wait(PATIENCE_S), topic
    subscription.unsubscribe()
    return messages[0]


def drive_with_nav2(ros: Any, pose: dict[str, Any]) -> tuple[int, int]:  # noqa: ANN401
    """Gives the goal's final status, and how often it fed back."""
    client = roslibpy.ActionClient(ros, "/navigate_to_pose", "nav2_msgs/action/NavigateToPose")
    over = threading.Event()
    results: list[Any] = []
    feedback: list[Any] = []

    def end(result: Any) -> None:  # noqa: ANN401
        results.append(result)
        over.set()

    client.send_goal(roslibpy.Goal({"pose": pose}), end, feedback.append, end)
    assert over.wait(PATIENCE_S)
    return results[0]["status"].value, len(feedback)


def drive_with_move_base(ros: Any, pose: dict[str, Any]) -> tuple[int, int]:  # noqa: ANN401
    """Gives the goal's final status, and how often it fed back."""
    from roslibpy.ros1 import actionlib  # type: ignore[import-untyped]  # noqa: PLC0415

    client = actionlib.ActionClient(ros, "/move_base", "move_base_msgs/MoveBaseAction")
    goal = actionlib.Goal(client, {"target_pose": pose})
    feedback: list[Any] = []
    goal.on("feedback", feedback.append)
    goal.send()
    goal.wait(PATIENCE_S)
    return goal.status["status"], len(feedback)


def main() -> None:
    port, version = int(sys.argv[1]), sys.argv[2]
    ros = roslibpy.Ros(host="127.0.0.1", port=port)
    ros.run(timeout=PATIENCE_S)
    kind = "nav_msgs/OccupancyGrid" if version == "1" else "nav_msgs/msg/OccupancyGrid"
    grid = fetch_once(ros, "/map", kind)
    odometry = fetch_once(ros, "/odom", kind.replace("OccupancyGrid", "Odometry"))
    here = odometry["pose"]["pose"]["position"]
    goal = {
        "header": {"frame_id": "map"},
        "pose": {
            "position": {"x": here["x"] + 0.5, "y": here["y"], "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }
    drive = drive_with_move_base if version == "1" else drive_with_nav2
    status, n_feedback = drive(ros, goal)
    there = fetch_once(ros, "/odom", kind.replace("OccupancyGrid", "Odometry"))
    seen = {
        "n_cells": len(grid["data"]),
        "size": [grid["info"]["width"], grid["info"]["height"]],
        "topics": ros.get_topics(),
        "map_type": ros.get_topic_type("/map"),
        "status": status,
        "n_feedback": n_feedback,
        "driven_m": there["pose"]["pose"]["position"]["x"] - here["x"],
    }
    sys.stdout.write(json.dumps(seen))
    sys.stdout.flush()
    ros.terminate()


if __name__ == "__main__":
    main()
