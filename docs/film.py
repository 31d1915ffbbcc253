# ruff: noqa: INP001 - a script beside the documents
"""Films the paper's three tasks for `docs/pictures/demo.gif`: `./run python docs/film.py`.

A client does them with the simulated robot over MCP. Each frame shows what it had at that moment:
the task, its last call, the answer, the map and the camera picture. The calls are fixed; the
answers, maps and pictures are the server's. The calls and answers are printed, too.
"""

import base64
import io
import json
import re
import sys
import textwrap
from dataclasses import dataclass, field
from pathlib import Path

import anyio
from mcp import ClientSession, StdioServerParameters
from mcp.client.stdio import stdio_client
from mcp_types import ImageContent, TextContent
from PIL import Image, ImageDraw, ImageFont

OUT = Path(__file__).parent / "pictures" / "demo.gif"
SERVER = (
    *("-m", "mapspeak", "serve", "--robot", "sim:warehouse"),
    *("--toolsets", "+explore", "--detector", "--clock", "virtual"),
)
SIZE_PX = (900, 510)
MAP_BOX, CAMERA_BOX = (8, 92, 560, 416), (578, 92, 312, 234)
INK, DIM, PAPER = "#1f2328", "#59636e", "#ffffff"
FRAME_MS, LAST_MS = 1100, 3000
MOST_TRIPS = 20
SURE_M = 6.0
SAFETY = re.compile(r"\b(fire|exit|first aid|eye wash)\b")
REPORTED = re.compile(r"- ([^,]+), ([+-][\d.]+) deg, ([\d.]+) m")


@dataclass(slots=True, kw_only=True)
class Film:
    """The frames so far, and what the next one shows."""

    session: ClientSession
    task: str = ""
    call: str = ""
    answer: str = ""
    map: Image.Image | None = None
    camera: Image.Image | None = None
    frames: list[Image.Image] = field(default_factory=list)
    durations_ms: list[int] = field(default_factory=list)

    async def ask(self, tool: str, **arguments: object) -> str:
        """Call a tool, keep its picture, and return its text."""
        result = await self.session.call_tool(tool, arguments)
        if result.is_error:
            raise RuntimeError(f"{tool}: {result.content}")
        for content in result.content:
            if isinstance(content, ImageContent):
                picture = Image.open(io.BytesIO(base64.b64decode(content.data))).convert("RGB")
                is_map = tool == "look_at_map"
                self.map, self.camera = (picture, self.camera) if is_map else (self.map, picture)
        return "\n".join(each.text for each in result.content if isinstance(each, TextContent))

    async def act(self, tool: str, **arguments: object) -> str:
        """Call a tool, look at the map and through the camera, and take a frame."""
        text = await self.ask(tool, **arguments)
        told = ", ".join(f"{key}: {json.dumps(value)}" for key, value in arguments.items())
        self.call, self.answer = f"{tool}({told})", _first_words(text)
        sys.stdout.write(f"{self.call}\n    {self.answer}\n")
        await self.ask("look_at_map")
        await self._note(await self.ask("look_through_camera"))
        self.frames.append(self._draw())
        self.durations_ms.append(FRAME_MS)
        return text

    async def drive(self, place: str) -> None:
        """Drive to a place, with a frame whenever an answer comes."""
        text = await self.act("navigate_to", place=place, wait_s=25)
        while '"state":"driving"' in text:
            text = await self.act("wait_for_goal", wait_s=25)

    async def _note(self, caption: str) -> None:
        """Remember what the robot's detector reports in a picture, as a model would."""
        seen = [
            {"label": label, "bearing_deg": float(bearing), "range_m": float(range_m)}
            for label, bearing, range_m in REPORTED.findall(caption)
            if float(range_m) <= SURE_M
        ]
        if seen:
            name = f"view {len(self.frames) + 1}"
            await self.ask(
                "write_semantic_data",
                name=name,
                description="What the robot's detector reports here.",
                safety_landmarks=[each for each in seen if SAFETY.search(str(each["label"]))],
                functional_landmarks=[
                    each for each in seen if not SAFETY.search(str(each["label"]))
                ],
                geometric_features=[],
            )

    def begin(self, task: str) -> None:
        """Begin a task; the last frame of the one before stays longer."""
        self.task = task
        sys.stdout.write(f"> {task}\n")
        if self.durations_ms:
            self.durations_ms[-1] = LAST_MS

    def _draw(self) -> Image.Image:
        frame = Image.new("RGB", SIZE_PX, PAPER)
        draw = ImageDraw.Draw(frame)
        draw.text((14, 8), f"“{self.task}”", fill=INK, font=ImageFont.load_default(22))
        draw.text((14, 42), self.call, fill=DIM, font=ImageFont.load_default(15))
        answer = textwrap.shorten(self.answer, 120, placeholder=" ...")
        draw.text((14, 64), answer, fill=DIM, font=ImageFont.load_default(14))
        for picture, (x, y, *size) in ((self.map, MAP_BOX), (self.camera, CAMERA_BOX)):
            if picture is not None:
                small = picture.copy()
                small.thumbnail((size[0], size[1]), Image.Resampling.LANCZOS)
                frame.paste(small, (x, y))
        return frame

    def save(self) -> None:
        """Write the animation."""
        self.durations_ms[-1] = LAST_MS
        first, *rest = (frame.quantize(96, dither=Image.Dither.NONE) for frame in self.frames)
        first.save(
            OUT, save_all=True, append_images=rest, duration=self.durations_ms, loop=0, disposal=1
        )


def _first_words(text: str) -> str:
    """Return what an answer says in its first line, or as its reason or state."""
    line = text.splitlines()[0]
    if not line.startswith("{"):
        return line
    report = json.loads(line)
    place = f" at {report['place']}" if "place" in report else ""
    return str(report.get("reason") or f"{report.get('state', '')}{place}")


async def _film() -> None:
    server = StdioServerParameters(command=sys.executable, args=list(SERVER))
    async with stdio_client(server) as streams, ClientSession(*streams) as session:
        await session.initialize()
        film = Film(session=session)
        film.begin("Update the map while moving.")
        for _ in range(MOST_TRIPS):
            text = await film.act("explore", n_goals=1, wait_s=25)
            if '"state":"driving"' not in text and '"state":"bound_reached"' not in text:
                break
        film.begin("Go to the smallest room.")
        await film.drive("smallest room")
        film.begin("Fire detected nearby. Navigate to the tool used for it.")
        await film.act("find_place", query="tool used for a fire")
        await film.drive("nearest fire extinguisher")
        film.save()


if __name__ == "__main__":
    anyio.run(_film)
