"""A page on a phone: is all of it seen, does the motor run, what does a small speaker play?"""

from __future__ import annotations

import re
from typing import Any

from playwright.sync_api import Page, ViewportSize

PHONE = ViewportSize(width=390, height=844)
KEYS = re.compile(r"\b(Esc|Escape|wheel|Shift|keyboard|arrow keys|space bar)\b")

# The words that are broken across lines, and the pairs of words that lie over each other. What a
# reader does not see (clipped, hidden, for decoration) and the stop, which stays in front while the
# page scrolls, are left out.
WORDS = """() => {
  const words = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const parent = walk.currentNode.parentElement;
    const isLeftOut = parent.closest("#stop, .unseen, [aria-hidden=true], option, pre");
    if (isLeftOut || !parent.checkVisibility()) continue;
    if (getComputedStyle(parent).clipPath !== "none") continue;
    for (const { 0: word, index } of walk.currentNode.data.matchAll(/[\\p{L}\\p{N}]+/gu)) {
      const range = document.createRange();
      range.setStart(walk.currentNode, index);
      range.setEnd(walk.currentNode, index + word.length);
      const rects = [...range.getClientRects()].filter(({ width }) => width > 0);
      if (rects.length) words.push({ word, rects });
    }
  }
  const lines = ({ rects }) => new Set(rects.map(({ top }) => Math.round(top))).size;
  const broken = words.filter((one) => lines(one) > 1);
  const over = [];
  for (const [index, one] of words.entries()) {
    for (const other of words.slice(index + 1)) {
      const [a, b] = [one.rects[0], other.rects[0]];
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      const isOver = across > 1 && down > 0.4 * Math.min(a.height, b.height);
      if (isOver) over.push(`${one.word} / ${other.word}`);
    }
  }
  return { broken: broken.map(({ word }) => word), over };
}"""
# The pairs of boxes in front of the page (fixed) that lie over each other. A box that covers the
# whole window, as a scene's overlay, and one within the other are left out.
BOXES = """() => {
  const boxes = [];
  for (const element of document.body.querySelectorAll("*")) {
    const style = getComputedStyle(element);
    const box = element.getBoundingClientRect();
    const isWhole = box.width >= innerWidth && box.height >= innerHeight;
    if (style.position !== "fixed" || style.clipPath !== "none" || isWhole) continue;
    if (!element.checkVisibility({ opacityProperty: true, visibilityProperty: true })) continue;
    boxes.push({ element, box });
  }
  const over = [];
  for (const [index, one] of boxes.entries()) {
    for (const other of boxes.slice(index + 1)) {
      if (one.element.contains(other.element)) continue;
      const [a, b] = [one.box, other.box];
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      const names = [one, other].map(({ element }) => element.id || element.tagName);
      if (across > 1 && down > 1) over.push(names.join(" / "));
    }
  }
  return over;
}"""
# Keeps what the page asks of the phone's motor (ms), since nothing vibrates here.
COUNT_VIBRATIONS = """
globalThis.vibrations = [];
navigator.vibrate = (pattern) => vibrations.push(pattern);
"""
# Keeps the strongest block (mean square) of what a small speaker plays of the page: behind a
# fourth-order Butterworth high-pass at 350 Hz.
LISTEN = """async () => {
  const {sound} = await import(new URL('hear.js', document.baseURI));
  await sound.start();
  const {context} = sound.output;
  const q = [0.5412, 1.3066].map((factor) => 20 * Math.log10(factor));
  const pass = q.map((Q) => new BiquadFilterNode(context, {type: 'highpass', frequency: 350, Q}));
  const meter = context.createScriptProcessor(2048, 1, 1); // 43 to 46 ms
  window.loudest = 0;
  meter.onaudioprocess = ({inputBuffer}) => {
    const samples = inputBuffer.getChannelData(0);
    const power = samples.reduce((sum, sample) => sum + sample * sample, 0) / samples.length;
    loudest = Math.max(loudest, power);
  };
  sound.output.connect(pass[0]).connect(pass[1]).connect(meter).connect(context.destination);
  window.meter = meter;
}"""
OPEN_ALL = "() => document.querySelectorAll('details').forEach((one) => (one.open = true))"


def complaints(page: Page) -> list[str]:
    """Return what is wrong with the page as it is now on a screen of PHONE's width, in words."""
    words: dict[str, Any] = page.evaluate(WORDS)
    wide = page.evaluate("document.scrollingElement.scrollWidth") - PHONE["width"]
    return [
        *(f"broken word: {word}" for word in words["broken"]),
        *(f"words over each other: {pair}" for pair in words["over"]),
        *(f"boxes over each other: {pair}" for pair in page.evaluate(BOXES)),
        *(f"names a key: {key}" for key in KEYS.findall(page.inner_text("body"))),
        *([f"scrolls sideways by {wide} px"] if wide > 0 else []),
    ]
