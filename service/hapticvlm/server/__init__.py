"""The WebSocket edge: bytes in and out, one owner of the outputs, static pages."""
