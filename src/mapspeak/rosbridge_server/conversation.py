"""One client's operations, on goals too: carried out, and mostly without a report of errors."""

import re
from collections.abc import Awaitable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import anyio
from anyio.abc import TaskGroup

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.links.rosbridge.protocol.bounds import FrameError
from mapspeak.links.rosbridge.protocol.codec import decode_json
from mapspeak.links.rosbridge.protocol.conversation import Encoding
from mapspeak.ros.messages.fields import Dialect, bare_type
from mapspeak.rosbridge_server.hub import (
    Frame,
    Outbox,
    Publication,
    answer_frame,
    fragments_of,
)
from mapspeak.rosbridge_server.interfaces import RosSystem, refusal
from mapspeak.rosbridge_server.navigation import (
    ABORTED,
    ACTION,
    ACTION_TYPE,
    TF_ERROR,
    ServedDrive,
    result_of,
    status_of,
)

Operation = Mapping[str, Any]
LONGEST_MESSAGE = 10_000_000
"""rosbridge's `max_message_size`: on ROS 2 longer text is cut in pieces."""
FEEDBACK_DEPTH = 5


TOPIC_NAME = re.compile(r"/?[A-Za-z_]\w*(/\w+)*/?", re.ASCII)


@dataclass(slots=True)
class ClientSubscription:
    """A client's subscription to one topic; each of its ids with the options that came with it."""

    options: dict[str, Operation] = field(default_factory=dict)

    @property
    def throttle_s(self) -> float:
        """The shortest of the times asked for between two messages."""
        return min(_number(each, "throttle_rate") for each in self.options.values()) / 1000.0

    @property
    def queue_length(self) -> int:
        """The shortest of the queues asked for; 0 where none was."""
        return int(min(_number(each, "queue_length") for each in self.options.values()))

    @property
    def encoding(self) -> Encoding | None:
        """The last in rosbridge's order of those asked for; None for one that is not known."""
        asked = {str(each.get("compression") or "none") for each in self.options.values()}
        known = [each for each in Encoding if each in asked]
        return known[-1] if known else None


class ClientConversation:
    """The subscriptions, advertisements and goals of one client.

    Args:
        tasks: Ends with the client.
        blocks: A goal holds up the client's further operations until it has ended.
    """

    def __init__(self, stack: RosSystem, outbox: Outbox, tasks: TaskGroup, *, blocks: bool) -> None:
        self._stack = stack
        self._outbox = outbox
        self._tasks = tasks
        self._blocks = blocks
        self._subscriptions: dict[str, ClientSubscription] = {}
        self._advertised: dict[str, set[str]] = {}
        self._fragment_length: int | None = None
        self._operations = {
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "call_service": self._call_service,
        }
        if stack.dialect is Dialect.ROS2:
            self._operations["send_action_goal"] = self._send_goal
            self._operations["cancel_action_goal"] = self._cancel_goal

    def frames_of(self, item: Frame | Publication) -> Iterable[Frame]:
        """Return an answer or a message as the client wants it; a long text is cut up.

        There is nothing where the real one stays silent: long CBOR is lost on ROS 2.
        """
        frame = self._frame_of(item) if isinstance(item, Publication) else item
        if frame is None:
            return ()
        length = self._fragment_length
        if self._stack.dialect is Dialect.ROS2:
            if not frame.is_text:
                return (frame,) if len(frame.data) <= LONGEST_MESSAGE else ()
            length = min(length or LONGEST_MESSAGE, LONGEST_MESSAGE)
        if not frame.is_text or length is None or len(frame.data) <= length:
            return (frame,)
        return fragments_of(frame, length=length)

    def _frame_of(self, publication: Publication) -> Frame | None:
        subscription = self._subscriptions.get(publication.topic)
        encoding = subscription.encoding if subscription else None
        if encoding is None or self._is_broken(encoding, publication.type):
            return None
        return publication.frame(encoding)

    async def handle(self, frame: str | bytes) -> None:
        """Carry one operation out."""
        try:
            operation = decode_json(frame.encode() if isinstance(frame, str) else frame)
        except (FrameError, UnicodeEncodeError):
            return  # Not even the log of ROS 1 hears of those.
        name = operation.get("op") if isinstance(operation, dict) else None
        if not isinstance(name, str) or name not in self._operations:
            self._stack.complain(f"Unknown operation: {name}.")
            return
        try:
            await self._operations[name](operation)
        except LinkError as error:
            self._stack.complain(f"[id: {operation.get('id')}] {name}: {error.message}")

    def close(self) -> None:
        """Forget the client; its goals go on, as behind a real rosbridge."""
        for topic in self._subscriptions:
            self._stack.hub.unsubscribe(topic, self._outbox.hear)
        for topic in self._advertised:
            self._stack.hub.unadvertise(topic)

    # --- topics ---

    async def _subscribe(self, operation: Operation) -> None:
        topic = _name(operation, "topic")
        self._keep_fragment_length(operation)
        message_type = self._checked_type(topic, operation.get("type"))
        subscription = self._subscriptions.setdefault(topic, ClientSubscription())
        subscription.options[_id(operation)] = operation
        known = self._stack.hub.find(topic)
        self._outbox.open_lane(
            topic,
            depth=max(subscription.queue_length, 0) or (known.depth if known else 50),
            throttle_s=subscription.throttle_s,
            holds_back=subscription.queue_length > 0 and subscription.throttle_s > 0,
        )
        self._stack.hub.subscribe(topic, message_type, self._outbox.hear)

    async def _unsubscribe(self, operation: Operation) -> None:
        topic = _name(operation, "topic")
        subscription = self._subscriptions.get(topic)
        if subscription is None:
            return
        if "id" in operation:
            subscription.options.pop(_id(operation), None)
        else:
            subscription.options.clear()
        if not subscription.options:
            del self._subscriptions[topic]
            self._outbox.close_lane(topic)
            self._stack.hub.unsubscribe(topic, self._outbox.hear)

    async def _advertise(self, operation: Operation) -> None:
        topic = _name(operation, "topic")
        message_type = self._checked_type(topic, _name(operation, "type"))
        if topic not in self._advertised:
            is_latched = operation.get("latch") is True
            self._stack.hub.advertise(topic, message_type, is_latched=is_latched)
        self._advertised.setdefault(topic, set()).add(_id(operation))

    async def _unadvertise(self, operation: Operation) -> None:
        topic = _name(operation, "topic")
        ids = self._advertised.get(topic, set())
        ids.discard(_id(operation))
        if topic in self._advertised and not ids:
            del self._advertised[topic]
            self._stack.hub.unadvertise(topic)

    async def _publish(self, operation: Operation) -> None:
        topic = _name(operation, "topic")
        known = self._stack.hub.find(topic)
        if known is None:
            # Without an advertisement the type is not known, unless the operation says it.
            await self._advertise(operation)
            known = self._stack.hub.find(topic)
        if known is not None:
            message = self._stack.interfaces.fill(known.type, operation.get("msg", {}))
            self._stack.hub.publish(topic, message)

    # --- services ---

    async def _call_service(self, operation: Operation) -> None:
        name = _name(operation, "service")
        service = self._stack.find_service(name)
        if service is not None and service.answer is None:
            return
        answer: dict[str, Any] = {"op": "service_response", "service": name}
        try:
            if service is None or service.answer is None:
                raise LinkError(f"Service {name} does not exist", hint="See /rosapi/services.")
            args = operation.get("args") or {}
            if not isinstance(args, dict):
                raise LinkError(f"The arguments of {name} are no object.", hint="Name each one.")
            values = service.answer(args)
            if isinstance(values, Awaitable):
                values = await values
        except MapspeakError as error:
            answer |= {"values": refusal(error), "result": False}
        else:
            answer |= {"values": values, "result": True}
        self._outbox.reply(answer_frame(operation, answer))

    # --- goals ---

    async def _send_goal(self, operation: Operation) -> None:
        if self._blocks:
            await self._pursue(operation)
        else:
            self._tasks.start_soon(self._pursue, operation)

    async def _cancel_goal(self, operation: Operation) -> None:
        """Cancel a goal of any client: their ids are one dictionary in rosbridge; no answer."""
        if self._stack.nav2 is not None:
            await self._stack.nav2.cancel_operation(_id(operation))

    async def _pursue(self, operation: Operation) -> None:
        action, action_type = operation.get("action"), operation.get("action_type")
        nav2 = self._stack.nav2
        if nav2 is None or not isinstance(action, str) or not isinstance(action_type, str):
            return
        if f"/{action.strip('/')}" != ACTION:
            return
        try:
            if bare_type(action_type) != ACTION_TYPE:
                raise LinkError(f"{ACTION} is no {action_type}.", hint=f"It is a {ACTION_TYPE}.")
            args = operation.get("args") or {}
            drive = await nav2.navigate(self._stack.interfaces.fill(f"{ACTION_TYPE}_Goal", args))
        except MapspeakError as error:
            if self._blocks and not isinstance(error, LinkError):
                # Version 2.1 never says that a goal is rejected, and blocks the socket for ever.
                await anyio.sleep_forever()
            self._end_goal(operation, refusal(error), status=0, is_done=False)
            return
        if isinstance(drive, str):
            values = {"error_code": TF_ERROR, "error_msg": drive}
            self._end_goal(operation, values, status=ABORTED, is_done=True)
            return
        await self._follow(operation, drive)
        self._end_goal(operation, result_of(drive), status=status_of(drive), is_done=True)

    async def _follow(self, operation: Operation, drive: ServedDrive) -> None:
        """Pass the feedback on until the drive is over; to a slow client only the latest."""
        lane = f"goal {_id(operation)}"
        answer = {"op": "action_feedback", "action": operation["action"]}
        if operation.get("feedback") is True:
            self._outbox.open_lane(lane, depth=FEEDBACK_DEPTH, throttle_s=0.0, holds_back=False)
        drive.operation_id = _id(operation)
        drive.follow = lambda feedback: self._outbox.offer(
            lane, answer_frame(operation, {**answer, "values": feedback})
        )
        try:
            await drive.is_over.wait()
        finally:
            drive.follow = None
            self._outbox.close_lane(lane)

    def _end_goal(self, asked: Operation, values: object, *, status: int, is_done: bool) -> None:
        ended = {"values": values, "status": status, "result": is_done}
        answer = {"op": "action_result", "action": asked["action"], **ended}
        self._outbox.reply(answer_frame(asked, answer))

    # --- inside ---

    def _is_broken(self, encoding: Encoding, message_type: str) -> bool:
        """Return True for what rosbridge on ROS 2 fails to send: png, lists of fixed length."""
        if self._stack.dialect is Dialect.ROS1 or encoding is Encoding.JSON:
            return False
        has_fixed_array = self._stack.interfaces.has_fixed_array
        return encoding is Encoding.PNG or has_fixed_array(message_type)

    def _checked_type(self, topic: str, given: object) -> str:
        """Return the topic's type; a given type must be the same, as either ROS writes it."""
        known = self._stack.hub.find(topic)
        if given is None and known is not None:
            return known.type
        if not isinstance(given, str):
            raise LinkError(f"Cannot infer topic type for topic {topic}.", hint="Give its type.")
        if known is not None and known.type != bare_type(given):
            raise LinkError(f"Topic {topic} is a {known.type}, not a {given}.", hint="Ask rosapi.")
        if not self._stack.interfaces.knows(given):
            raise LinkError(f"Unable to load the type {given}.", hint="Is it installed?")
        return bare_type(given)

    def _keep_fragment_length(self, operation: Operation) -> None:
        """Once asked for, pieces stay that short on the whole connection."""
        length = int(_number(operation, "fragment_size"))
        if length > 0:
            self._fragment_length = min(length, self._fragment_length or length)


def _name(operation: Operation, key: str) -> str:
    value = operation.get(key)
    if not isinstance(value, str) or not value:
        raise LinkError(f"Expected a string for {key}.", hint="Name it.")
    if key != "topic":
        return value
    if not TOPIC_NAME.fullmatch(value):
        raise LinkError(f"{value!r} is an invalid topic name.", hint="Use letters and digits.")
    return f"/{value.strip('/')}"


def _id(operation: Operation) -> str:
    return str(operation.get("id"))


def _number(operation: Operation, key: str) -> float:
    value = operation.get(key) or 0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < 1e9:
        raise LinkError(f"Expected a number for {key}.", hint="Give milliseconds, or a length.")
    return float(value)
