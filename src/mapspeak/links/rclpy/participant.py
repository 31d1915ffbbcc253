"""Our node in a ROS 2 domain: its callbacks run in a thread of their own and come to the loop."""

import logging
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any

import anyio
import rclpy
from anyio.from_thread import BlockingPortal
from rclpy.context import Context
from rclpy.exceptions import NameValidationException, NoTypeSupportImportedException
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import get_rmw_implementation_identifier

from mapspeak.errors import LinkError
from mapspeak.ros.link import environment_with
from mapspeak.ros.port import new_id

LOG = logging.getLogger(__name__)
N_DIGITS = 8
"""Of the id in our node's name; two of the same name in one domain would be taken for one."""
LOOK_S = 0.02
"""Polling interval for facts that rclpy has no event for."""
PAUSE_S = 0.2
"""After an error of rclpy, so that one that stays does not fill the log."""

Node = Any  # rclpy has no types
ERRORS = (RuntimeError, OverflowError, NameValidationException, NoTypeSupportImportedException)
"""The errors that rclpy raises; those of ROS's own library are RuntimeErrors."""


class RclpyParticipant:
    """A node, in a context of its own, whose callbacks a thread of its own runs.

    Args:
        domain_id: As in ROS_DOMAIN_ID; None takes that variable's value.
        variables: Override those of the environment while the domain is entered.
    """

    def __init__(
        self, *, domain_id: int | None, portal: BlockingPortal, variables: Mapping[str, str]
    ) -> None:
        self.name = f"mapspeak_{new_id()[:N_DIGITS]}"
        self._domain_id = domain_id
        self._portal = portal
        self._variables = variables
        self._context = Context()
        self._end = Future()
        self._pause = threading.Event()
        self._loop_thread = threading.get_ident()
        self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
        self.node: Node = None

    @property
    def place(self) -> str:
        """The domain, and the middleware."""
        middleware = get_rmw_implementation_identifier()
        return f"ROS domain {self._context.get_domain_id()}, {middleware}"

    async def start(self) -> None:
        """Enter the domain.

        Raises:
            LinkError: ROS cannot be started.
        """
        try:
            await anyio.to_thread.run_sync(self._enter)
        except LinkError:
            self._context.try_shutdown()
            raise
        self._thread.start()

    async def aclose(self) -> None:
        """Leave the domain; neither the thread nor the node is left."""
        if self.node is not None:
            await anyio.to_thread.run_sync(self._leave)

    def hand_over(self, work: Callable[..., None], *arguments: Any) -> None:  # noqa: ANN401
        """Call a function in the event loop, and wait for its return.

        Waiting keeps a fast robot from filling our memory: messages that come meanwhile are left to
        ROS, which keeps the newest few of each topic.
        """
        if threading.get_ident() == self._loop_thread:
            work(*arguments)
            return
        try:
            self._portal.call(work, *arguments)
        except (CancelledError, RuntimeError):
            # The event loop takes no more work while we leave.
            if not self._pause.is_set():
                raise

    async def wait_for(self, future: Any) -> None:  # noqa: ANN401 - rclpy has no types
        """Return when one of rclpy's futures is done."""
        is_done = anyio.Event()
        future.add_done_callback(lambda _: self.hand_over(is_done.set))
        await is_done.wait()

    def _enter(self) -> None:
        # ROS and its middleware read their variables only when a domain is entered.
        with errors_of_ros("ROS 2 cannot be started"), environment_with(self._variables):
            rclpy.init(
                args=[],
                context=self._context,
                domain_id=self._domain_id,
                signal_handler_options=SignalHandlerOptions.NO,
            )
            self.node = rclpy.create_node(
                self.name,
                context=self._context,
                use_global_arguments=False,
                enable_rosout=False,
                start_parameter_services=False,
            )
            self._executor = SingleThreadedExecutor(context=self._context)
            self._executor.add_node(self.node)

    def _run(self) -> None:
        while not self._end.done():
            try:
                self._executor.spin_until_future_complete(self._end)
            except Exception:  # a message that cannot be read must not end all others
                LOG.exception("an error of rclpy")
                self._pause.wait(PAUSE_S)

    def _leave(self) -> None:
        self._pause.set()
        self._end.set_result(None)
        self._executor.wake()
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()


async def wait_until(is_so: Callable[[], bool], *, within_s: float) -> bool:
    """Wait until a condition is true or the time is over; return whether it is true."""
    with anyio.move_on_after(within_s):
        while not is_so():  # noqa: ASYNC110 - rclpy has no event for it
            await anyio.sleep(LOOK_S)
    return is_so()


@contextmanager
def errors_of_ros(what: str) -> Iterator[None]:
    """Turn errors of rclpy into a `LinkError`."""
    try:
        yield
    except ERRORS as error:
        first = " ".join(str(error).split())
        raise LinkError(
            f"{what}: {first[:300]}", hint="Check ROS on this machine: `ros2 topic list`."
        ) from error
