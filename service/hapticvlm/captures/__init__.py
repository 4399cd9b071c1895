"""Reads captures: a folder with capture.jsonl and pictures, or a video.

A video file gives its frames at their own times. A .jsonl file of the same name beside it adds the
other messages; without one, the object in the middle of the picture is touched all the time. A
screen or a camera is such a video without an end.
"""

from hapticvlm.captures.capture import CENTRE, Capture, Touched, read, watch
from hapticvlm.captures.lines import LINES, CaptureError, Line, Recorder
from hapticvlm.captures.video import Eye

__all__ = [
    "CENTRE",
    "LINES",
    "Capture",
    "CaptureError",
    "Eye",
    "Line",
    "Recorder",
    "Touched",
    "read",
    "watch",
]
