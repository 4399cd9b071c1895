"""What the WebXR example's tests share: the page in an emulated headset's session, on a service.

What is emulated: the headset and its controllers (iwer). What is simulated: plate and speaker. The
browser, three.js, WebGL (on the processor), the WebSocket and the service are real.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from headless import LLVMPIPE, chromium
from pace import PACE
from playwright.sync_api import Page

from hapticvlm.client.local_service import Service, running

EXAMPLES = Path(__file__).parents[2] / "examples"
REACH = (Path(__file__).parent / "reach.js").read_text(encoding="utf-8")
SLOW_MS = 240_000 * PACE  # textures and shaders are computed on a processor that others use too
PATIENCE_MS = 20_000 * PACE
SIZE = (240, 160)  # px of the page: what is drawn for nobody costs time
# Where the object `key` is on the canvas, and how to send it the events of a pointer there.
AIM = """
  const main = await import(new URL('main.js', document.baseURI));
  const three = await import('three');
  const canvas = document.getElementById('view');
  const {root} = main.objects.find((one) => one.key === key);
  const at = new three.Box3().setFromObject(root).getCenter(new three.Vector3());
  at.project(main.camera);
  const [x, y] = [(at.x + 1) / 2, (1 - at.y) / 2];
  const where = {clientX: x * canvas.clientWidth, clientY: y * canvas.clientHeight, pointerId: 1};
  const send = (type) => canvas.dispatchEvent(new PointerEvent(type, {...where, bubbles: true}));
"""
MODULES = """async () => {
  const [main, three] = await Promise.all([import('./main.js'), import('three')]);
  return {main, three, session: await main.enter()};
}"""


@dataclass
class Visit:
    """The page in its emulated VR session, and what it complained of."""

    page: Any
    modules: Any
    complaints: list[str] = field(default_factory=list)

    def touch(
        self, key: str, *, patience_ms: float = PATIENCE_MS, feels_plate: bool = False
    ) -> Any:
        """Touch one object with the right controller; return the decision on it, or None."""
        wanted = {"key": key, "patience": patience_ms, "feelsPlate": feels_plate}
        return self.modules.evaluate(f"(modules, wanted) => ({REACH})(modules, wanted)", wanted)

    def truths(self) -> dict[str, str]:
        """Return what each object of one material truly is, by its key."""
        keys = """({main}) => main.objects.filter(({truths}) => !truths)
          .map(({key, truth}) => [key, truth])"""
        return dict(self.modules.evaluate(keys))


@contextmanager
def served(
    size: tuple[int, int], folder: Path = EXAMPLES, token: str | None = None
) -> Iterator[tuple[Service, Page]]:
    """Serve the examples or another scene, and open a page that shows nothing yet.

    With a token, pages are open to the local network, and a phone's browser gives it as the
    password.
    """
    options = ["--host", "0.0.0.0", "--pages-from", "lan", "--token", token] if token else []
    phone = {"has_touch": True, "is_mobile": True}
    given: Any = {"http_credentials": {"username": "anyone", "password": token}, **phone}
    with running(["--scene", str(folder), *options]) as service, chromium(*LLVMPIPE) as browser:
        page = browser.new_page(
            viewport={"width": size[0], "height": size[1]}, **(given if token else {})
        )
        page.set_default_timeout(SLOW_MS)
        yield service, page


@contextmanager
def visiting(size: tuple[int, int] = SIZE) -> Iterator[Visit]:
    """Serve the scene, open it and enter VR."""
    with served(size) as (service, page):
        complaints: list[str] = []

        def heard(said: Any) -> None:
            if said.type == "error":
                complaints.append(said.text)

        page.on("console", heard)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(f"{service.page}scene/webxr/?emulate")
        page.locator("#state", has_text="plate").wait_for()
        yield Visit(page, page.evaluate_handle(MODULES), complaints)
