"""rosbridge's operations on goals, which only ROS 2 has."""

from collections.abc import Mapping
from typing import Any

import anyio
from anyio.abc import TaskGroup

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.links.rosbridge.server.drives import Drive
from mapspeak.links.rosbridge.server.nav2 import (
    ABORTED,
    ACTION,
    ACTION_TYPE,
    TF_ERROR,
    Nav2,
    result_of,
    status_of,
)
from mapspeak.links.rosbridge.server.outbox import Outbox
from mapspeak.links.rosbridge.server.publication import answer_frame
from mapspeak.links.rosbridge.server.system import RosSystem, refusal
from mapspeak.ros.messages import bare_type

Operation = Mapping[str, Any]
FEEDBACK_DEPTH = 5


class GoalOperations:
    """One client's goals; the ids of all clients' goals share one dictionary, as in rosbridge."""

    def __init__(self, stack: RosSystem, outbox: Outbox, tasks: TaskGroup, *, blocks: bool) -> None:
        self._stack = stack
        self._outbox = outbox
        self._tasks = tasks
        self._blocks = blocks

    async def send(self, operation: Operation) -> None:
        """Carries out `send_action_goal`."""
        if self._blocks:
            await self._carry_out(operation)
        else:
            self._tasks.start_soon(self._carry_out, operation)

    async def cancel(self, operation: Operation) -> None:
        """Carries out `cancel_action_goal`; nothing is ever answered."""
        nav2 = self._stack.nav2
        if nav2 is not None:
            await nav2.cancel_operation(str(operation.get("id")))

    async def _carry_out(self, operation: Operation) -> None:
        action, action_type = operation.get("action"), operation.get("action_type")
        nav2 = self._stack.nav2
        if nav2 is None or not isinstance(action, str) or not isinstance(action_type, str):
            return
        if f"/{action.strip('/')}" != ACTION:
            return
        try:
            drive = await self._start(nav2, operation, action_type)
        except LinkError as error:
            self._answer(operation, refusal(error), status=0, is_done=False)
        except MapspeakError as error:
            await self._reject(operation, error)
        else:
            await self._follow(nav2, operation, drive)

    async def _start(self, nav2: Nav2, operation: Operation, action_type: str) -> Drive | str:
        if bare_type(action_type) != ACTION_TYPE:
            raise LinkError(f"{ACTION} is no {action_type}.", hint=f"It is a {ACTION_TYPE}.")
        args = operation.get("args") or {}
        return await nav2.navigate(self._stack.interfaces.fill(f"{ACTION_TYPE}_Goal", args))

    async def _reject(self, operation: Operation, error: MapspeakError) -> None:
        """Answers as newer rosbridges do; 2.1 never says so, and blocks the socket for ever."""
        if self._blocks:
            await anyio.sleep_forever()
        self._answer(operation, refusal(error), status=0, is_done=False)

    async def _follow(self, nav2: Nav2, operation: Operation, drive: Drive | str) -> None:
        if isinstance(drive, str):
            values = {"error_code": TF_ERROR, "error_msg": drive}
            self._answer(operation, values, status=ABORTED, is_done=True)
            return
        operation_id = str(operation.get("id"))
        nav2.by_operation[operation_id] = drive
        try:
            await self._feed_back(nav2, operation, drive)
        finally:
            if nav2.by_operation.get(operation_id) is drive:
                del nav2.by_operation[operation_id]
        self._answer(operation, result_of(drive), status=status_of(drive), is_done=True)

    async def _feed_back(self, nav2: Nav2, operation: Operation, drive: Drive) -> None:
        """Passes the feedback on until the drive is over; to a slow client only the latest."""
        lane = f"goal {operation.get('id')}"
        answer = {"op": "action_feedback", "action": operation["action"]}

        def pass_on(about: Drive, feedback: dict[str, Any]) -> None:
            if about is drive:
                frame = answer_frame(operation, {**answer, "values": feedback})
                self._outbox.offer(lane, frame)

        if operation.get("feedback") is True:
            self._outbox.open_lane(lane, depth=FEEDBACK_DEPTH, throttle_s=0.0, holds_back=False)
        nav2.followers.append(pass_on)
        try:
            await drive.is_over.wait()
        finally:
            nav2.followers.remove(pass_on)
            self._outbox.close_lane(lane)

    def _answer(self, operation: Operation, values: object, *, status: int, is_done: bool) -> None:
        answer = {
            "op": "action_result",
            "action": operation["action"],
            "values": values,
            "status": status,
            "result": is_done,
        }
        self._outbox.reply(answer_frame(operation, answer))
