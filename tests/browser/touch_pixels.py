"""How soon a touch changes pixels of the touched object, beside what a bare picture takes.

    python tests/browser/touch_pixels.py --size 320x240 --size 1280x800 --touches 30

The WebXR example's page in headless Chromium, which draws on the processor. In turns a bare WebGL
canvas of the same size changes in the next animation frame (the floor), the scene is drawn again
(a bare picture), and a pointer event touches an object. `handled`: the page has done what it does
at once; then it waits for the browser's next frame. `drawn`: it has given its picture to WebGL.
`pixels`: pixels of that picture, drawn, were read, and for a touch they differ. Prints a
table and, last, one JSON line.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
from itertools import cycle, islice

import numpy as np
from playwright.sync_api import sync_playwright
from toolchains import missing
from webxr_scene import CHROMIUM, EXAMPLES, LLVMPIPE, SLOW_MS

from hapticvlm.client.local_service import running

OBJECTS = ("kettle", "linen", "bowl", "pan")
KINDS = ("floor", "bare picture", "touch")
LEAST_PX = 60  # colour values of 24 x 24 pixels that differ after a touch
REST_MS = 1000
SETUP = """async () => {
  const [main, three] = await Promise.all([import('./main.js'), import('three')]);
  const view = document.getElementById('view');
  const gl = view.getContext('webgl2');
  const bare = document.createElement('canvas');
  Object.assign(bare, {width: view.width, height: view.height});
  bare.style.cssText = 'position:fixed;inset:0;width:100%;height:100%;z-index:9;display:none';
  document.body.append(bare);
  const plain = bare.getContext('webgl2');
  const side = 24;
  let shade = 0;

  function spot(key) {
    const box = new three.Box3().setFromObject(main.objects.find((one) => one.key === key).root);
    const at = box.getCenter(new three.Vector3()).project(main.camera);
    return [(at.x + 1) / 2, (1 - at.y) / 2];
  }

  function read(context, key) {
    const [x, y] = spot(key);
    const pixels = new Uint8Array(4 * side * side);
    const corner = [x * view.width - side / 2, (1 - y) * view.height - side / 2];
    context.readPixels(...corner, side, side, context.RGBA, context.UNSIGNED_BYTE, pixels);
    return pixels;
  }

  async function nextPicture(count) {
    while (main.drawn.count === count) await new Promise(requestAnimationFrame);
    return main.drawn.at;
  }

  async function nextClear() {
    await new Promise(requestAnimationFrame);
    shade = 1 - shade;
    plain.clearColor(shade, shade, shade, 1);
    plain.clear(plain.COLOR_BUFFER_BIT);
    return performance.now();
  }

  const wait = (ms) => new Promise((done) => setTimeout(done, ms));

  async function rest() {
    for (let seen = -1; seen !== main.drawn.count; await wait(400)) seen = main.drawn.count;
  }

  // Times in ms since the press, and how many colour values differ from those before it.
  return async function press(kind, key) {
    const [x, y] = spot(key);
    const where = {clientX: x * view.clientWidth, clientY: y * view.clientHeight, pointerId: 1};
    const send = (type) => view.dispatchEvent(new PointerEvent(type, {...where, bubbles: true}));
    bare.style.display = kind === 'floor' ? 'block' : 'none';
    send('pointermove');
    await rest();
    const asked = main.drawn.count;
    main.redraw();
    await nextPicture(asked);
    const before = read(gl, key);
    await rest();
    const {count} = main.drawn;
    const started = performance.now();
    if (kind === 'touch') send('pointerdown');
    if (kind === 'bare picture') main.redraw();
    const handled = performance.now() - started;
    const drawn = (kind === 'floor' ? await nextClear() : await nextPicture(count)) - started;
    const after = read(kind === 'floor' ? plain : gl, key);
    const pixels = performance.now() - started;
    send('pointerup');
    const differs = before.reduce((sum, value, i) => sum + (Math.abs(value - after[i]) > 8), 0);
    return {handled, drawn, pixels, differs};
  };
}"""

PRESS = "(press, [kind, key]) => press(kind, key)"


def main() -> None:
    """Measure at each size and print what was seen."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", action="append", help="px, WIDTHxHEIGHT (320x240, 1280x800)")
    parser.add_argument("--touches", type=int, default=30)
    arguments = parser.parse_args()
    if reason := missing("chromium", "three"):
        raise SystemExit(reason)
    sizes = arguments.size or ["320x240", "1280x800"]
    found = {size: measure(size, arguments.touches) for size in sizes}
    print(f"{'size':>10}{'press':>14}{'handled, ms':>13}{'drawn':>9}{'pixels':>9}{'p95':>9}")
    for size, kinds in found.items():
        for kind, seen in kinds.items():
            times = "".join(f"{value:9.1f}" for value in seen.values())
            print(f"{size:>10}{kind:>14}    {times}")
    device = f"{platform.machine()}, {os.cpu_count()} cpus, load {os.getloadavg()[0]:.1f}"
    print(json.dumps({"touches": arguments.touches, "device": device, "sizes": found}))


def measure(size: str, touches: int) -> dict[str, dict[str, float]]:
    """Return medians and the 95th percentile of each kind of press, in ms, at one size."""
    width, height = (int(side) for side in size.split("x"))
    with running(["--scene", str(EXAMPLES)]) as service, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which(CHROMIUM), args=["--no-sandbox", *LLVMPIPE]
        )
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(2 * SLOW_MS)
        page.goto(f"{service.page}scene/webxr/")
        page.locator("#state", has_text="Connected").wait_for()
        page.wait_for_timeout(REST_MS)
        press = page.evaluate_handle(SETUP)
        for key in OBJECTS:  # shaders and textures of a first touch
            press.evaluate(PRESS, ["touch", key])
        seen: dict[str, list[dict[str, float]]] = {kind: [] for kind in KINDS}
        for key in islice(cycle(OBJECTS), touches):
            for kind in KINDS:
                seen[kind].append(press.evaluate(PRESS, [kind, key]))
        browser.close()
    assert all(one["differs"] > LEAST_PX for one in seen["touch"]), "a touch that was not seen"
    return {kind: _summary(presses) for kind, presses in seen.items()}


def _summary(presses: list[dict[str, float]]) -> dict[str, float]:
    times = {name: [one[name] for one in presses] for name in ("handled", "drawn", "pixels")}
    medians = {f"{name}_ms": round(float(np.median(found)), 2) for name, found in times.items()}
    return medians | {"pixels_p95_ms": round(float(np.percentile(times["pixels"], 95)), 2)}


if __name__ == "__main__":
    main()
