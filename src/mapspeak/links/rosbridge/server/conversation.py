"""One client's operations: what it asks for is done, and what it gets wrong is mostly not told."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from anyio.abc import TaskGroup

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.links.rosbridge.protocol.bounds import FrameError
from mapspeak.links.rosbridge.protocol.decoding import decode_json
from mapspeak.links.rosbridge.server.actions import GoalOperations
from mapspeak.links.rosbridge.server.outbox import Outbox
from mapspeak.links.rosbridge.server.publication import (
    Compression,
    Frame,
    Publication,
    answer_frame,
)
from mapspeak.links.rosbridge.server.system import RosSystem, refusal
from mapspeak.ros.messages import Dialect, bare_type

Operation = Mapping[str, Any]
TOPIC_NAME = re.compile(r"/?[A-Za-z_]\w*(/\w+)*/?", re.ASCII)


@dataclass(slots=True)
class Subscription:
    """What a client asked for on one topic; each of its ids with the options that came with it."""

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
    def compression(self) -> Compression | None:
        """The last in rosbridge's order of those asked for; None for one that is not known."""
        asked = {str(each.get("compression") or "none") for each in self.options.values()}
        known = [each for each in Compression if each in asked]
        return known[-1] if known else None


class Conversation:
    """What one client has subscribed to, advertised and started.

    Args:
        stack: The robot's ROS.
        outbox: Where answers and messages go.
        tasks: Ends with the client.
        blocks: A goal holds up the client's further operations until it has ended.
    """

    def __init__(self, stack: RosSystem, outbox: Outbox, tasks: TaskGroup, *, blocks: bool) -> None:
        self._stack = stack
        self._outbox = outbox
        self._subscriptions: dict[str, Subscription] = {}
        self._advertised: dict[str, set[str]] = {}
        self._goals = GoalOperations(stack, outbox, tasks, blocks=blocks)
        self.fragment_length: int | None = None
        self._operations = {
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "call_service": self._call_service,
        }
        if stack.dialect is Dialect.ROS2:
            self._operations["send_action_goal"] = self._goals.send
            self._operations["cancel_action_goal"] = self._goals.cancel

    def frame_of(self, publication: Publication) -> Frame | None:
        """Gives a message as the client wants it; None where the real one stays silent."""
        subscription = self._subscriptions.get(publication.topic)
        compression = subscription.compression if subscription else None
        if compression is None or self._is_broken(compression, publication.type):
            return None
        return publication.frame(compression)

    async def handle(self, frame: str | bytes) -> None:
        """Carries one operation out."""
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
        """Forgets the client; its goals go on, as behind a real rosbridge."""
        for topic in self._subscriptions:
            self._stack.hub.unsubscribe(topic, self._outbox.hear)
        for topic in self._advertised:
            self._stack.hub.unadvertise(topic)

    # --- topics ---

    async def _subscribe(self, operation: Operation) -> None:
        topic = _name(operation, "topic")
        self._keep_fragment_length(operation)
        message_type = self._checked_type(topic, operation.get("type"))
        subscription = self._subscriptions.setdefault(topic, Subscription())
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
        service = self._stack.services.find(name)
        if service is not None and service.answer is None:
            return
        try:
            if service is None or service.answer is None:
                raise LinkError(f"Service {name} does not exist", hint="See /rosapi/services.")
            args = operation.get("args") or {}
            if not isinstance(args, dict):
                raise LinkError(f"The arguments of {name} are no object.", hint="Name each one.")
            values: object = await service.answer(args)
        except MapspeakError as error:
            self._answer_call(operation, refusal(error), is_done=False)
        else:
            self._answer_call(operation, values, is_done=True)

    def _answer_call(self, operation: Operation, values: object, *, is_done: bool) -> None:
        answer = {
            "op": "service_response",
            "service": operation["service"],
            "values": values,
            "result": is_done,
        }
        self._reply(operation, answer)

    # --- inside ---

    def _reply(self, operation: Operation, answer: Mapping[str, Any]) -> None:
        self._outbox.reply(answer_frame(operation, answer))

    def _is_broken(self, compression: Compression, message_type: str) -> bool:
        """True for what rosbridge on ROS 2 cannot send: any png, and lists of fixed length."""
        if self._stack.dialect is Dialect.ROS1 or compression is Compression.NONE:
            return False
        return compression is Compression.PNG or self._stack.interfaces.has_fixed_array(
            message_type
        )

    def _checked_type(self, topic: str, given: object) -> str:
        """Gives the topic's type; what is given must be that type, in either ROS's words."""
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
            self.fragment_length = min(length, self.fragment_length or length)


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
