"""Models through the library `inspect-ai`: OpenAI, Anthropic, Google, local servers.

It speaks each provider's protocol and retries; what is said, called and counted stays ours. Only
who asks a model imports this module: the library is the optional extra `eval`.
"""

import base64
import re
from collections.abc import Sequence

# It has no public name, and is what a missing package or key is told with.
from inspect_ai._util.error import PrerequisiteError
from inspect_ai.model import (
    ChatMessage,
    ChatMessageSystem,
    ChatMessageTool,
    ChatMessageUser,
    Content,
    ContentImage,
    ContentText,
    GenerateConfig,
    Model,
    get_model,
)
from inspect_ai.tool import ToolCallError, ToolInfo, ToolParams
from mcp_types import Tool

from mapspeak.errors import ConfigError, LinkError
from mapspeak.evaluation.agent import Assignment, ToolAnswer
from mapspeak.evaluation.agents.models.chat import (
    AnsweredCalls,
    Reply,
    Thinking,
    ToolCallRequest,
)
from mapspeak.evaluation.trials import TrialState
from mapspeak.installation import shell_command

MOST_RETRIES = 5
ANSWER_WITHIN_S = 300
"""A request that takes longer is given up and made anew: a lost connection is never answered."""
MOST_SAID = 300
"""Characters of a provider's error that are passed on: some repeat the whole request."""


def open_model(name: str) -> Model:
    """Return the library's model, without asking it.

    Raises:
        ConfigError: A package, a key or an address is missing.
    """
    try:
        return get_model(name, memoize=False)
    except (PrerequisiteError, ValueError) as error:
        raise ConfigError(
            f"The model {name} cannot be asked: {_plain(error)}",
            hint="Install the provider's package and set its key, as the message says.",
        ) from error


def _plain(error: Exception) -> str:
    """Return a message as a sentence, without the library's markup and line ends."""
    said = " ".join(re.sub(r"\[/?[a-z ]*\]", "", str(error)).split())
    return f"{said.removeprefix('ERROR: ').rstrip('.')}."


class InspectConversation:
    """A conversation with a model behind the library.

    Args:
        thinking: How much the model may think; None leaves it to the provider.

    Raises:
        ConfigError: The model cannot be asked: a package, a key or an address is missing.
    """

    def __init__(
        self, name: str, thinking: Thinking | None, task: Assignment, tools: Sequence[Tool]
    ) -> None:
        self._model = open_model(name)
        self._messages: list[ChatMessage] = [
            ChatMessageSystem(content=task.system),
            ChatMessageUser(content=task.prompt),
        ]
        self._tools = [_as_info(tool) for tool in tools]
        self._config = GenerateConfig(
            max_retries=MOST_RETRIES,
            attempt_timeout=ANSWER_WITHIN_S,
            seed=task.seed,
            # The library makes a budget of it where a provider counts thoughts in tokens.
            reasoning_effort=None if thinking is None else thinking.value,
        )

    async def ask(self, answers: AnsweredCalls) -> Reply:
        """Return the model's reply to the conversation so far."""
        self._messages += [_as_message(call, answer) for call, answer in answers]
        try:
            output = await self._model.generate(
                self._messages, tools=self._tools, config=self._config
            )
        except Exception as error:  # each provider has its own errors, without a common base
            raise LinkError(
                f"{self._model} cannot be asked: {_say_cause(error)}",
                hint="See the provider's own words; "
                f"`{shell_command('eval --retry')}` runs what broke again.",
            ) from error
        # Sent back unchanged: some providers require their own signed thoughts.
        self._messages.append(output.message)
        n_read = n_written = None
        if (usage := output.usage) is not None:
            # The library counts cached tokens apart.
            cached = (usage.input_tokens_cache_read, usage.input_tokens_cache_write)
            n_read = usage.input_tokens + sum(n_tokens or 0 for n_tokens in cached)
            n_written = usage.output_tokens
        return Reply(
            text=output.completion,
            calls=tuple(
                ToolCallRequest(
                    id=call.id,
                    tool=call.function,
                    arguments=dict(call.arguments),
                    mistake=call.parse_error,
                )
                for call in output.message.tool_calls or ()
            ),
            n_input_tokens=n_read,
            n_output_tokens=n_written,
            state=_ENDINGS.get(output.stop_reason, TrialState.FINISHED),
        )


def _as_message(call: ToolCallRequest, answer: ToolAnswer) -> ChatMessage:
    content: list[Content] = [ContentText(text=answer.text)]
    for picture in answer.pictures:
        data = base64.b64encode(picture.data).decode()
        content.append(ContentImage(image=f"data:{picture.media_type};base64,{data}"))
    error = ToolCallError("unknown", answer.text) if answer.is_error else None
    return ChatMessageTool(content=content, tool_call_id=call.id, function=call.tool, error=error)


_ENDINGS = {
    "content_filter": TrialState.GAVE_UP,
    "max_tokens": TrialState.OUT_OF_BUDGET,
    "model_length": TrialState.OUT_OF_BUDGET,
}
"""Endings by the library's names."""


def _say_cause(error: BaseException) -> str:
    """Return what the provider said, which the library may have wrapped in its own errors."""
    while error.__cause__ is not None:
        error = error.__cause__
    said = " ".join(str(error).split())[:MOST_SAID].rstrip(".")
    return f"{type(error).__name__}: {said}."


def _as_info(tool: Tool) -> ToolInfo:
    schema = tool.input_schema
    return ToolInfo(
        name=tool.name,
        description=tool.description or tool.name,
        parameters=ToolParams.model_validate(
            {"properties": schema.get("properties", {}), "required": schema.get("required", [])}
        ),
    )
