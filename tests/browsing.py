"""A real browser for tests, in which every error of a page fails."""

import shutil
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from playwright.async_api import async_playwright

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
KEEP = "MAPSPEAK_KEEP_PICTURES"
"""Where this variable is set, pictures for the documents are taken anew."""
PATIENCE_MS = 20_000
PHONE = {"width": 390, "height": 800}
DESK = {"width": 1280, "height": 800}


@asynccontextmanager
async def browse(
    address: str, *, size: dict[str, int] = DESK, is_dark: bool = False
) -> AsyncGenerator[Any]:
    """Open a page, and fail where it runs into an error of its own or asks elsewhere."""
    program = next(filter(None, map(shutil.which, BROWSERS)))
    errors: list[str] = []
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        scheme = "dark" if is_dark else "light"
        page = await browser.new_page(viewport=size, color_scheme=scheme)
        page.set_default_timeout(PATIENCE_MS)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("dialog", lambda dialog: errors.append(dialog.message))
        page.on("console", lambda said: _note_refusal(said.text, errors))
        await page.goto(address)
        yield page
        await browser.close()
    assert errors == []


def _note_refusal(said: str, errors: list[str]) -> None:
    if "Content Security Policy" in said:
        errors.append(said)
