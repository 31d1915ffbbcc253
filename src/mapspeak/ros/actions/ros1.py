"""Actions of ROS 1: five topics (actionlib), and goals by the ids that we give them."""

from collections.abc import Iterator, Mapping

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.actions.client import GONE, RESULT_LATE, SILENT, ActionClient
from mapspeak.ros.activity import ActionGoal, ActionState
from mapspeak.ros.messages.fields import LATEST_S, Dialect, Message, write_header, write_stamp
from mapspeak.ros.port import RosConnection, has_listeners, new_id

CANCEL_TYPE, STATUS_TYPE = "actionlib_msgs/GoalID", "actionlib_msgs/GoalStatusArray"
STATES = {
    0: ActionState.ACCEPTED,
    1: ActionState.RUNNING,
    2: ActionState.CANCELLED,
    3: ActionState.SUCCEEDED,
    4: ActionState.ABORTED,
    5: ActionState.REJECTED,
    6: ActionState.CANCELLING,
    7: ActionState.CANCELLING,
    8: ActionState.CANCELLED,
    9: ActionState.LOST,
}
"""actionlib_msgs/GoalStatus."""
NOW = write_stamp(LATEST_S, dialect=Dialect.ROS1)


class Ros1ActionClient(ActionClient):
    """Sends goals under ids of ours, by which actionlib's list of goals tells them for certain."""

    def __init__(self, connection: RosConnection, action: str, *, type_name: str) -> None:
        statuses, results, feedback = (
            connection.subscribe(f"{action}/{topic}", type_name=topic_type)
            for topic, topic_type in (
                ("status", STATUS_TYPE),
                ("result", f"{type_name}ActionResult"),
                ("feedback", f"{type_name}ActionFeedback"),
            )
        )
        super().__init__(connection, action, type_name=type_name, statuses=statuses)
        statuses.listen(self._take_list)
        results.listen(self._take_result)
        feedback.listen(self._take_feedback)

    def advertise(self, through: RosConnection) -> dict[str, str]:
        """Say that we will publish goals and cancellations; return the types by topic."""
        types = {
            f"{self.action}/cancel": CANCEL_TYPE,
            f"{self.action}/goal": f"{self.type_name}ActionGoal",
        }
        for topic, type_name in types.items():
            through.advertise(topic, type_name=type_name)
        return types

    async def cancel_all(self, through: RosConnection | None = None) -> int:
        """Cancel every goal of the action, of all clients; return how many there were."""
        self._publish_cancel("", through or self._connection)
        return sum(not state.is_final for state in self._statuses.values())

    async def _is_served(self) -> bool:
        return await has_listeners(self._connection, f"{self.action}/cancel")

    async def _begin(self, arguments: Message, through: RosConnection) -> ActionGoal:
        goal_id = new_id()
        goal = ActionGoal(goal_id=goal_id, action=self.action, ros_id=goal_id)
        # Known before it is sent: the answer may come while it is still being sent.
        self._keep(goal, through)
        message = {
            "header": write_header("", LATEST_S, dialect=Dialect.ROS1),
            "goal_id": {"stamp": NOW, "id": goal_id},
            "goal": arguments,
        }
        try:
            await through.publish(f"{self.action}/goal", message)
        except BaseException:
            del self._goals[goal_id]
            raise
        return goal

    def _ask_to_cancel(self, goal: ActionGoal) -> None:
        # Where nothing is open now, it is asked again as soon as the list shows the goal.
        message = {"stamp": NOW, "id": goal.id}
        goal.through.publish_everywhere(f"{self.action}/cancel", message)

    async def _cancel(self, goal: ActionGoal) -> bool:
        self._publish_cancel(goal.id, goal.through)
        return False

    def _publish_cancel(self, goal_id: str, through: RosConnection) -> None:
        through.advertise(f"{self.action}/cancel", type_name=CANCEL_TYPE)
        message = {"stamp": NOW, "id": goal_id}
        if through.publish_everywhere(f"{self.action}/cancel", message) == 0:
            raise LinkError(
                f"Nothing could be sent on {self.action}/cancel: there is no connection.",
                hint="Stop the robot by hand. The connection is made anew by itself.",
            )

    def _look_at(self, goal: ActionGoal) -> None:
        """Take in that a server has fallen silent; it sends its list five times a second."""
        if goal.listed_end_s is not None:
            self._end_by_list(goal, self._statuses.get(goal.id, ActionState.LOST), "")
        since_s = self._connection.connected_for_s
        if goal.is_over or since_s is None or since_s < self._patience.return_s:
            return
        silent_s = anyio.current_time() - max(self._list.arrived_s, goal.sent_s)
        if goal.state is not ActionState.SENT and silent_s > self._patience.return_s:
            self._withdraw(goal, ActionState.LOST, SILENT.format(silent_s))

    # --- messages of the topics

    def _take_list(self, message: Message) -> None:
        self._statuses = {}
        for goal_id, state, text in _read_list(message):
            self._statuses[goal_id] = state
            goal = self._goals.get(goal_id)
            if goal is not None:
                self._take_state(goal, state, text)
        for goal in self._goals.values():
            if goal.id not in self._statuses:
                self._take_absence(goal)
        self._tell()

    def _take_state(self, goal: ActionGoal, state: ActionState, text: str) -> None:
        if goal.is_over:
            if state.is_final:
                self._note_server_end(goal)
            else:
                self._note_life(goal)
        elif state.is_final:
            self._end_by_list(goal, state, text)
        else:
            goal.move_on(state)

    def _take_absence(self, goal: ActionGoal) -> None:
        """Take in that the server does not list a goal; actionlib does until 5 s after its end."""
        if goal.id in self._being_ended:
            self._note_server_end(goal)
        if goal.state is not ActionState.SENT and not goal.is_over:
            self._withdraw(goal, ActionState.LOST, GONE)

    def _end_by_list(self, goal: ActionGoal, state: ActionState, text: str) -> None:
        """End a goal by the list, once its result has had time to come."""
        now_s = anyio.current_time()
        goal.reason = goal.reason or text
        goal.move_on(ActionState.ACCEPTED)
        goal.listed_end_s = goal.listed_end_s or now_s
        if now_s - goal.listed_end_s >= self._patience.result_s:
            said = [f"{part.rstrip('.')}." for part in (goal.reason, RESULT_LATE) if part]
            goal.finish(state, reason=" ".join(said))

    def _take_result(self, message: Message) -> None:
        for goal_id, state, text in _read_list({"status_list": [message.get("status")]}):
            goal, result = self._goals.get(goal_id), message.get("result")
            if goal is None or not state.is_final:
                continue
            self._note_server_end(goal)
            goal.finish(state, reason=text, result=result if isinstance(result, Mapping) else None)
        self._tell()

    def _take_feedback(self, message: Message) -> None:
        for goal_id, _, _ in _read_list({"status_list": [message.get("status")]}):
            goal, feedback = self._goals.get(goal_id), message.get("feedback")
            if goal is not None and isinstance(feedback, Mapping):
                self._note_life(goal)
                goal.take_feedback(feedback)
                goal.count_feedback()
        self._tell()


def _read_list(message: Message) -> Iterator[tuple[str, ActionState, str]]:
    """Yield id, state and text of each goal of a list; leave out invalid entries."""
    entries = message.get("status_list")
    for entry in entries if isinstance(entries, list) else []:
        named = entry.get("goal_id") if isinstance(entry, Mapping) else None
        goal_id = named.get("id") if isinstance(named, Mapping) else None
        code = entry.get("status") if isinstance(entry, Mapping) else None
        state = STATES.get(code) if isinstance(code, int) else None
        if isinstance(goal_id, str) and state is not None:
            yield goal_id, state, str(entry.get("text", ""))
