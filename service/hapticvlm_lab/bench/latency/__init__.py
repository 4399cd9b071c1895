"""Round trips of touches and the path of frames, with and without load, beside their floors."""
