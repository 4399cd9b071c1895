"""A touch's round trip and the frame path, with and without load, beside their floors."""
